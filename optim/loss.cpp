#include "optim/loss.h"

#include <cmath>
#include <limits>

namespace isochron {

double mean_squared_error(const GatedImage& image, const GatedImage& target) {
  double sum = 0;
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    const double residual = image.data[i] - target.data[i];
    sum += residual * residual;
  }
  return std::isfinite(sum) ? sum / static_cast<double>(image.data.size())
                            : std::numeric_limits<double>::quiet_NaN();
}

GatedImage loss_adjoint(const GatedImage& image, const GatedImage& target) {
  GatedImage adjoint = image;
  const double scale = 2.0 / static_cast<double>(image.data.size());
  for (std::size_t i = 0; i < adjoint.data.size(); ++i)
    adjoint.data[i] = scale * (image.data[i] - target.data[i]);
  return adjoint;
}

double root_mean_square(const GatedImage& image) {
  return std::sqrt(inner_product(image, image) / static_cast<double>(image.data.size()));
}

double inner_product(const GatedImage& a, const GatedImage& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += a.data[i] * b.data[i];
  return sum;
}

}  // namespace isochron
