#include "optim/problem/photon_noise.h"

#include <algorithm>
#include <cmath>

namespace isochron {
namespace {

/// Walks up the distribution function. A mean below 10 leaves less than 2e-10 of the mass above 40; u has 32
/// bits.
double poisson_by_inversion(double mean, Rng& rng) {
  const double u = rng.uniform();
  double mass = std::exp(-mean), sum = mass;
  int count = 0;
  while (u > sum && mass > 0) {
    ++count;
    mass *= mean / count;
    sum += mass;
  }
  return count;
}

double poisson_by_rejection(double mean, Rng& rng) {
  const double b = 0.931 + 2.53 * std::sqrt(mean);
  const double a = -0.059 + 0.02483 * b;
  const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
  const double squeeze = 0.9277 - 3.6224 / (b - 2);
  for (;;) {
    const double u = rng.uniform() - 0.5, v = rng.uniform();
    const double distance = 0.5 - std::abs(u);
    const double count = std::floor((2 * a / distance + b) * u + mean + 0.43);
    if (distance >= 0.07 && v <= squeeze) return count;
    if (count < 0 || (distance < 0.013 && v > distance)) continue;
    if (std::log(v * inverse_alpha / (a / (distance * distance) + b)) <=
        count * std::log(mean) - mean - std::lgamma(count + 1))
      return count;
  }
}

/// Of entries above zero; all others become zero.
template <class Count>
void replace_by_counts(GatedImage& image, const Stream& stream, const Count& count) {
  for (int pixel = 0; pixel < image.pixels(); ++pixel)
    for (int g = 0; g < image.gates; ++g)
      for (int c = 0; c < image.channels; ++c) {
        double& value = image.at(pixel, g, c);
        Rng rng(stream, static_cast<std::uint64_t>(pixel), static_cast<std::uint32_t>(g * image.channels + c));
        value = value > 0 ? count(value, rng) : 0;
      }
}

}  // namespace

double poisson(double mean, Rng& rng) {
  return mean < 10 ? poisson_by_inversion(mean, rng) : poisson_by_rejection(mean, rng);
}

void add_photon_noise(GatedImage& image, double photons, const Stream& stream) {
  double brightest = 0;
  for (int g = 0; g < image.gates; ++g) brightest = std::max(brightest, image.mean(g));
  replace_by_counts(image, stream, [&](double value, Rng& rng) {
    return poisson(photons * (value / brightest), rng) * (brightest / photons);
  });
}

void draw_counts(GatedImage& image, const Stream& stream) {
  replace_by_counts(image, stream, poisson);
}

}  // namespace isochron
