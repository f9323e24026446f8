// Random pairs of a triangle and an ellipsoid, most of which meet.
#pragma once
#include <cmath>
#include <random>

#include "core/geometry/ellipsoid.h"
#include "tests/seed.h"

namespace isochron {

struct Triangle {
  Vec3 v0, v1, v2;
  double area() const { return 0.5 * length(cross(v1 - v0, v2 - v0)); }
  Vec3 normal() const { return normalize(cross(v1 - v0, v2 - v0)); }
};

class RandomCases {
 public:
  Vec3 vec(double scale) { return {scale * normal_(rng_), scale * normal_(rng_), scale * normal_(rng_)}; }
  double uniform() { return uniform_(rng_); }
  Triangle triangle() {
    // A common centre, sizes over two decades, one vertex in eight pulled on the opposite edge: a sliver.
    const double size = std::pow(10.0, 2 * uniform() - 1);
    const Vec3 centre = vec(0.5);
    Triangle t{centre + vec(size), centre + vec(size), centre + vec(size)};
    if (uniform() < 0.125) t.v2 = t.v0 + (t.v1 - t.v0) * uniform() + (t.v2 - t.v0) * 1e-3;
    return t;
  }
  /// Three quarters of them pass through a point of the triangle, so that the two meet.
  Ellipsoid ellipsoid(const Triangle& t) {
    const Vec3 a = vec(1);
    const double kind = uniform();
    const Vec3 b = kind < 0.1 ? a : vec(1);
    double tau = length(b - a) * (1 + std::pow(10.0, 4 * uniform() - 4)) + 1e-3 * uniform();
    if (uniform() < 0.75) {
      const double x = uniform(), y = uniform() * (1 - x);
      const Vec3 q = t.v0 + (t.v1 - t.v0) * x + (t.v2 - t.v0) * y;
      tau = length(q - a) + length(q - b);
    }
    return Ellipsoid(a, b, tau);
  }

 private:
  std::mt19937_64 rng_{test_seed(20240611)};
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

}  // namespace isochron
