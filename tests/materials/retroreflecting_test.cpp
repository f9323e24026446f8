// The retroreflecting material: its value against the textbook's mirrors seen in a mirror, derivatives on dual
// numbers. Sampling: two_lobes_test.cpp.
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <vector>

#include "core/base/random.h"
#include "tests/materials/cosines.h"

namespace isochron {
namespace {

using testing::direction;
using testing::directions;

constexpr double kDiffuse[3] = {0.3, 0.1, 0.5}, kBack[3] = {0.6, 0.2, 0.05};

Material retroreflector(double alpha, const Rgb& albedo = {0.3, 0.1, 0.5}, const Rgb& reflectance = {0.6, 0.2, 0.05}) {
  Material m("retroreflecting");
  m.set("albedo", albedo);
  m.set("reflectance", reflectance);
  m.set("roughness", alpha);
  return m;
}

/// D G2 / (4 cos_i cos_o) of mirrors that receive v, w_o mirrored about n = (0, 0, 1), by half vector (Heitz 2014).
template <class T>
T textbook(const Vec3T<T>& n, const Vec3T<T>& w_i, const Vec3T<T>& w_o, const T& alpha) {
  const T c_i = dot(n, w_i), c_o = dot(n, w_o);
  const Vec3T<T> v = n * (T(2) * c_o) - w_o, h = (w_i + v) / sqrt(dot(w_i + v, w_i + v));
  const T c_h = dot(n, h), a2 = alpha * alpha, base = c_h * c_h * (a2 - T(1)) + T(1);
  const auto lambda = [&](const T& c) { return (sqrt(T(1) + a2 * (T(1) - c * c) / (c * c)) - T(1)) / T(2); };
  return a2 / (T(kPi) * base * base) / (T(1) + lambda(c_i) + lambda(c_o)) / (T(4) * c_i * c_o);
}

// All ten arguments of each colour's ln f: the three vectors (as free ones), the numbers of the colour, alpha.
TEST(Retroreflecting, MatchesDualNumbers) {
  using Jet = ceres::Jet<double, 12>;
  Rng rng({31, 0, 0}, 0, 0);
  for (int k = 0; k < 2000; ++k) {
    const double alpha = 0.05 * std::pow(20.0, rng.uniform());
    const Vec3 i = direction(1.4 * rng.uniform(), kTwoPi * rng.uniform());
    const bool near = k % 2;  // where the light goes
    const Vec3 o = near ? normalize(i + direction(kPi * rng.uniform(), kTwoPi * rng.uniform()) * (0.3 * alpha))
                        : direction(1.4 * rng.uniform(), kTwoPi * rng.uniform());
    if (o.z < 0.05) continue;
    const Material m = retroreflector(alpha);
    const Directions d = directions(i, o);
    const BsdfDerivative got = m.bsdf().derivative(d);
    EXPECT_TRUE(got.coloured);
    for (int c = 0; c < 3; ++c) {
      const auto free = [&](const Vec3& v, int first) {
        return Vec3T<Jet>{Jet(v.x, first), Jet(v.y, first + 1), Jet(v.z, first + 2)};
      };
      const Vec3T<Jet> n = free(d.n, 0), w_i = free(i, 3), w_o = free(o, 6);
      const Jet f = Jet(kDiffuse[c], 9) / kPi + Jet(kBack[c], 10) * textbook(n, w_i, w_o, Jet(alpha, 11));
      EXPECT_NEAR(m.bsdf().value(d)[c] / f.a, 1, 1e-10);
      const Jet ln = log(f);
      // Free vectors leave the set where cosines are all that counts; what survives is the part along tangents.
      const auto tangential = [](const Vec3& g, const Vec3& at) { return g - at * dot(g, at); };
      const Vec3 expected[3] = {{ln.v[0], ln.v[1], ln.v[2]}, {ln.v[3], ln.v[4], ln.v[5]}, {ln.v[6], ln.v[7], ln.v[8]}};
      const auto& by = got.by_directions[c];
      const Vec3 actual[3] = {by.n, by.w_i, by.w_o}, at[3] = {d.n, i, o};
      double scale = 1;
      for (const Vec3& g : expected) scale = std::max(scale, length(g));
      for (int v = 0; v < 3; ++v) {
        EXPECT_LT(length(tangential(actual[v] - expected[v], at[v])), 1e-9 * scale)
            << "vector " << v << " alpha " << alpha;
      }
      EXPECT_NEAR(got.by_number[c][c], ln.v[9], 1e-9 * std::abs(ln.v[9]));
      EXPECT_NEAR(got.by_number[3 + c][c], ln.v[10], 1e-9 * std::abs(ln.v[10]));
      EXPECT_NEAR(got.by_number[6][c], ln.v[11], 1e-9 * (1 + std::abs(ln.v[11])));
      EXPECT_EQ(got.by_number[c][(c + 1) % 3], 0);
    }
  }
}

// Straight back the half vector is the normal: D = 1 / (pi alpha^2), and Smith's G2 of equal angles.
TEST(Retroreflecting, GoesBackTheWayItCame) {
  constexpr double kAlpha = 0.05;
  const Material m = retroreflector(kAlpha, Rgb(0), Rgb(1));
  for (const double theta : {0.0, 0.5, 1.0}) {
    const Vec3 i = direction(theta, 0.7), mirrored = direction(theta, 0.7 + kPi);
    const double back = m.bsdf().value(directions(i, i)).r, tangent = std::tan(theta);
    const double g2 = 1 / std::sqrt(1 + kAlpha * kAlpha * tangent * tangent);
    EXPECT_NEAR(back, g2 / (4 * kPi * kAlpha * kAlpha * i.z * i.z), 1e-12 * back);
    if (theta > 0) {
      EXPECT_LT(m.bsdf().value(directions(i, mirrored)).r, 1e-3 * back);
    }
  }
}

}  // namespace
}  // namespace isochron
