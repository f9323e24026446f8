#include "optim/loss.h"

#include <cmath>
#include <limits>

namespace isochron {

double RobustLoss::value(double r) const {
  if (kind == LossKind::huber && std::abs(r) > scale) return scale * (2 * std::abs(r) - scale);
  if (kind == LossKind::cauchy) return scale * scale * std::log1p((r / scale) * (r / scale));
  return r * r;
}

double RobustLoss::weight(double r) const {
  if (kind == LossKind::huber && std::abs(r) > scale) return scale / std::abs(r);
  if (kind == LossKind::cauchy) return 1 / (1 + (r / scale) * (r / scale));
  return 1;
}

double mean_loss(const GatedImage& image, const GatedImage& target, const RobustLoss& rho) {
  double sum = 0;
  for (std::size_t i = 0; i < image.data.size(); ++i) sum += rho.value(image.data[i] - target.data[i]);
  return std::isfinite(sum) ? sum / static_cast<double>(image.data.size()) : std::numeric_limits<double>::quiet_NaN();
}

GatedImage loss_adjoint(const GatedImage& image, const GatedImage& target, const RobustLoss& rho) {
  GatedImage adjoint = image;
  const double scale = 2.0 / static_cast<double>(image.data.size());
  for (std::size_t i = 0; i < adjoint.data.size(); ++i) {
    const double residual = image.data[i] - target.data[i];
    adjoint.data[i] = scale * rho.weight(residual) * residual;
  }
  return adjoint;
}

double mean_square(const GatedImage& image) {
  return inner_product(image, image) / static_cast<double>(image.data.size());
}

double inner_product(const GatedImage& a, const GatedImage& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += a.data[i] * b.data[i];
  return sum;
}

}  // namespace isochron
