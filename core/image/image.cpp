#include "core/image/image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace isochron {

double GatedImage::mean(int gate) const {
  double sum = 0;
  for (int pixel = 0; pixel < pixels(); ++pixel) {
    for (int channel = 0; channel < channels; ++channel) sum += at(pixel, gate, channel);
  }
  return sum / (static_cast<double>(pixels()) * channels);
}

void require_finite(const GatedImage& image, const std::string& what) {
  const auto wrong = std::count_if(image.data.begin(), image.data.end(), [](double value) {
    return !(std::abs(value) <= std::numeric_limits<float>::max());
  });
  require_none_wrong(static_cast<std::size_t>(wrong), image.data.size(), what);
}

void require_none_wrong(std::size_t wrong, std::size_t values, const std::string& what) {
  if (wrong > 0)
    throw std::runtime_error(
        fmt::format("{} of {} values of {} are no finite 32-bit floats: emission or gates are too "
                    "extreme",
                    wrong, values, what));
}

}  // namespace isochron
