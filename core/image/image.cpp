#include "core/image/image.h"

namespace isochron {

double GatedImage::mean(int gate) const {
  double sum = 0;
  for (int pixel = 0; pixel < pixels(); ++pixel) {
    for (int channel = 0; channel < channels; ++channel) sum += at(pixel, gate, channel);
  }
  return sum / (static_cast<double>(pixels()) * channels);
}

}  // namespace isochron
