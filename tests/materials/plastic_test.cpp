// Plastic against textbook formulas: GGX mirrors (Heitz 2014) with Fresnel's reflectance over a base seen through the coat, by
// Walsh's closed form of the reflectance for diffuse light; derivatives on dual numbers. Sampling: two_lobes_test.cpp.
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/materials/cosines.h"

namespace isochron {
namespace {

using testing::direction;
using testing::directions;

constexpr double kBase[3] = {0.3, 0, 0.9}, kCoat[3] = {1, 0.4, 0};

Material plastic(double alpha, double ior) {
  Material m("plastic");
  m.set("albedo", {kBase[0], kBase[1], kBase[2]});
  m.set("reflectance", {kCoat[0], kCoat[1], kCoat[2]});
  m.set("roughness", alpha);
  m.set("ior", ior);
  return m;
}

/// From Snell's law and the amplitudes of both polarisations.
template <class T>
T fresnel(const T& cosine, const T& n) {
  const T refracted = sqrt(T(1) - (T(1) - cosine * cosine) / (n * n));
  const T s = (cosine - n * refracted) / (cosine + n * refracted),
          p = (n * cosine - refracted) / (n * cosine + refracted);
  return (s * s + p * p) / T(2);
}

/// Walsh 1926: the reflectance of a smooth face for diffuse light from outside.
template <class T>
T walsh(const T& n) {
  const T n2 = n * n, n4 = n2 * n2, p = n2 + T(1), m = n2 - T(1);
  return T(0.5) + (n - T(1)) * (T(3) * n + T(1)) / (T(6) * (n + T(1)) * (n + T(1))) +
         n2 * m * m / (p * p * p) * log((n - T(1)) / (n + T(1))) -
         T(2) * n * n2 * (n2 + T(2) * n - T(1)) / (p * (n4 - T(1))) +
         T(8) * n4 * (n4 + T(1)) / (p * (n4 - T(1)) * (n4 - T(1))) * log(n);
}

template <class T>
T textbook(const Vec3T<T>& n, const Vec3T<T>& w_i, const Vec3T<T>& w_o, const T& albedo, const T& reflectance,
           const T& alpha, const T& ior) {
  const T c_i = dot(n, w_i), c_o = dot(n, w_o);
  const Vec3T<T> h = (w_i + w_o) / sqrt(dot(w_i + w_o, w_i + w_o));
  const T c_h = dot(n, h), a2 = alpha * alpha, slope = c_h * c_h * (a2 - T(1)) + T(1);
  const auto lambda = [&](const T& c) { return (sqrt(T(1) + a2 * (T(1) - c * c) / (c * c)) - T(1)) / T(2); };
  const T mirrors = a2 / (T(kPi) * slope * slope) / (T(1) + lambda(c_i) + lambda(c_o)) / (T(4) * c_i * c_o);
  const T inside = T(1) - (T(1) - walsh(ior)) / (ior * ior);
  const T base = albedo / (T(kPi) * ior * ior * (T(1) - albedo * inside));
  return base * (T(1) - fresnel(c_i, ior)) * (T(1) - fresnel(c_o, ior)) +
         reflectance * fresnel(T(sqrt((T(1) + dot(w_i, w_o)) / T(2))), ior) * mirrors;
}

// All thirteen arguments of each colour's ln f: the three vectors (as free ones), the numbers of the colour, alpha, index. The
// index of the program's base is by quadrature, good to 1e-8.
TEST(Plastic, MatchesDualNumbers) {
  using Jet = ceres::Jet<double, 13>;
  Rng rng({41, 0, 0}, 0, 0);
  for (int k = 0; k < 2000; ++k) {
    const double alpha = 0.05 * std::pow(20.0, rng.uniform()), ior = 1.2 + 1.3 * rng.uniform();
    const Vec3 i = direction(1.4 * rng.uniform(), kTwoPi * rng.uniform());
    const bool near = k % 2;  // where the mirrors send the light
    const Vec3 mirrored{-i.x, -i.y, i.z};
    const Vec3 o = near ? normalize(mirrored + direction(kPi * rng.uniform(), kTwoPi * rng.uniform()) * (0.3 * alpha))
                        : direction(1.4 * rng.uniform(), kTwoPi * rng.uniform());
    if (o.z < 0.05) continue;
    const Material m = plastic(alpha, ior);
    const Directions d = directions(i, o);
    const BsdfDerivative got = m.bsdf().derivative(d);
    EXPECT_TRUE(got.coloured);
    for (int c = 0; c < 3; ++c) {
      const auto free = [&](const Vec3& v, int first) {
        return Vec3T<Jet>{Jet(v.x, first), Jet(v.y, first + 1), Jet(v.z, first + 2)};
      };
      const Jet f = textbook(free(d.n, 0), free(i, 3), free(o, 6), Jet(kBase[c], 9), Jet(kCoat[c], 10), Jet(alpha, 11),
                             Jet(ior, 12));
      EXPECT_NEAR(m.bsdf().value(d)[c] / f.a, 1, 1e-7);
      // Free vectors leave the set where cosines are all that counts; what survives is the part along tangents.
      const auto tangential = [](const Vec3& g, const Vec3& at) { return g - at * dot(g, at); };
      const auto of_ln = [&](int first) { return Vec3{f.v[first], f.v[first + 1], f.v[first + 2]} / f.a; };
      const auto& by = got.by_directions[c];
      const Vec3 expected[3] = {of_ln(0), of_ln(3), of_ln(6)}, actual[3] = {by.n, by.w_i, by.w_o}, at[3] = {d.n, i, o};
      double scale = 1;
      for (const Vec3& g : expected) scale = std::max(scale, length(g));
      for (int v = 0; v < 3; ++v) {
        EXPECT_LT(length(tangential(actual[v] - expected[v], at[v])), 1e-7 * scale)
            << "vector " << v << " alpha " << alpha << " index " << ior;
      }
      const int number[4] = {c, 3 + c, 6, 7};
      for (int q = 0; q < 4; ++q)
        EXPECT_NEAR(got.by_number[number[q]][c], f.v[9 + q] / f.a, 1e-6 * (1 + std::abs(f.v[9 + q] / f.a))) << q;
      EXPECT_EQ(got.by_number[c][(c + 1) % 3], 0);
    }
  }
}

// A smooth coat over white keeps all light: what it does not mirror comes back out of the base. 1.05 and 3: the quadrature of
// the diffuse reflectance from weak to strong coats.
TEST(Plastic, WhiteUnderASmoothCoatKeepsAllLight) {
  for (const double ior : {1.05, 1.5, 3.0}) {
    Material m("plastic");
    m.set("albedo", 1);
    m.set("reflectance", 0);
    m.set("ior", ior);
    for (const double theta : {0.0, 0.7, 1.3}) {
      double kept = 0;
      constexpr int kSteps = 4000;
      for (int k = 0; k < kSteps; ++k) {
        const double z = (k + 0.5) / kSteps;
        kept += kTwoPi * z * m.bsdf().value(directions(direction(std::acos(z), 0), direction(theta, 2))).r / kSteps;
      }
      EXPECT_NEAR(kept, 1 - fresnel(std::cos(theta), ior), 1e-5) << ior << " " << theta;
    }
  }
}

// Numbers that optimisers set have what follows from them; so has a copy.
TEST(Plastic, FollowsItsIndex) {
  Material m = plastic(0.3, 1.3);
  m.set_number(7, 1.9);
  const Material copy = m, fresh = plastic(0.3, 1.9);
  const Directions d = directions(direction(0.4, 0), direction(0.9, 2));
  EXPECT_EQ(m.bsdf().value(d), fresh.bsdf().value(d));
  EXPECT_EQ(copy.bsdf().value(d), fresh.bsdf().value(d));
}

}  // namespace
}  // namespace isochron
