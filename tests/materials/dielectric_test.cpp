// The rough dielectric against Walter et al. 2007 written independently with half vectors, Snell's law and Fresnel's equations:
// values and derivatives on dual numbers in extended precision, energy by quadrature, sampling by chi-square.
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/base/random.h"
#include "tests/materials/chi_square.h"
#include "tests/materials/cosines.h"
#include "tests/materials/walter.h"

namespace isochron {
namespace {

using namespace textbook;
using testing::CosineDerivative;
using testing::derivative, testing::direction, testing::glass, testing::pdf, testing::value;

struct BothCosines {
  double i, o, io;
};

BothCosines cosines(const Vec3& i, const Vec3& o) {
  return {i.z, o.z, dot(i, o)};
}

/// Refracts o at the microfacet h (o.h > 0) into a medium of relative index m; false under total reflection.
bool refract(const Vec3& o, const Vec3& h, double m, Vec3& i) {
  const Vec3 tangent = (dot(o, h) * h - o) / m;
  if (length_squared(tangent) >= 1) return false;
  i = tangent - std::sqrt(1 - length_squared(tangent)) * h;
  return true;
}

void expect_matches_walter(const BothCosines& c, double alpha, double ior, int& compared) {
  using Jet = ceres::Jet<long double, 5>;
  const Jet expected = walter(Jet(c.i, 0), Jet(c.o, 1), Jet(c.io, 2), Jet(alpha, 3), Jet(ior, 4));
  const Material m = glass(alpha, ior);
  const CosineDerivative got = derivative(m, c.i, c.o, c.io);
  EXPECT_EQ(got.value, value(m, c.i, c.o, c.io));
  EXPECT_EQ(got.value > 0, expected.a > 0) << c.i << ' ' << c.o << ' ' << c.io << ' ' << alpha << ' ' << ior;
  if (!(got.value > 0) || !(expected.a > 0)) return;
  ++compared;
  // What a rounding step of the three cosines changes, of the roughness and of the index, whose reciprocal counts from behind: the
  // logarithm's derivatives say. Of 20 seeds the worst is two such steps.
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  const Jet logarithm = log(expected);
  double slope = 1;
  const double steps[5] = {1, 1, 1, alpha, ior};
  for (int k = 0; k < 5; ++k) slope += steps[k] * std::abs(static_cast<double>(logarithm.v[k]));
  EXPECT_NEAR(got.value / static_cast<double>(expected.a), 1, 8 * kEpsilon * slope) << c.i << ' ' << c.o;
  const double d[5] = {got.by_cos_i, got.by_cos_o, got.by_cos_io, got.by_roughness, got.by_ior};
  double scale = 0;
  for (int k = 0; k < 5; ++k) scale = std::max(scale, std::abs(static_cast<double>(logarithm.v[k])));
  for (int k = 0; k < 5; ++k)
    EXPECT_NEAR(d[k], static_cast<double>(logarithm.v[k]), 1e-9 * scale + 1024 * kEpsilon * slope * scale)
        << "argument " << k << " alpha " << alpha << " ior " << ior << " cosines " << c.i << ' ' << c.o << ' ' << c.io;
}

TEST(DielectricLobe, MatchesDualNumbers) {
  Rng rng({21, 0, 0}, 0, 0);
  int reflections = 0, refractions = 0;
  for (int k = 0; k < 20000; ++k) {
    const double ior = k % 2 ? 1 + 1.5 * rng.uniform() : 0.4 + 0.6 * rng.uniform();
    const double alpha = 0.01 * std::pow(100.0, rng.uniform());
    const double theta_i = kPi * rng.uniform(), theta_o = kPi * rng.uniform(), phi = kTwoPi * rng.uniform();
    const Vec3 i = direction(theta_i, phi), o = direction(theta_o, 0.3);
    expect_matches_walter(cosines(i, o), alpha, ior, i.z * o.z > 0 ? reflections : refractions);
  }
  EXPECT_GT(reflections, 8000);
  EXPECT_GT(refractions, 1000);
}

// Near the specular directions, at grazing, at normal incidence and at the critical angle, down to ior = 1.001.
TEST(DielectricLobe, MatchesDualNumbersInHardPlaces) {
  int compared = 0;
  for (const double ior : {1.001, 1.5, 0.999, 0.5})
    for (const double alpha : {0.01, 0.3})
      for (const bool behind : {false, true}) {
        const double m = behind ? 1 / ior : ior;
        std::vector<double> thetas = {0, 1e-7, 0.5, 1.4, 0.5 * kPi - 1e-4};
        if (m < 1)
          for (const double off : {-1e-3, -1e-6, 1e-6, 1e-3}) thetas.push_back(std::asin(m) + off);
        for (const double theta : thetas)
          for (const double tilt : {0.0, 1e-6, 1e-3, 0.1 * alpha}) {
            const Vec3 o = direction(theta, 0.7), h = direction(tilt, 2.0);
            if (dot(o, h) <= 0) continue;
            Vec3 i = 2 * dot(o, h) * h - o;
            const auto check = [&](Vec3 a, Vec3 b) {
              if (behind) a.z = -a.z, b.z = -b.z;
              expect_matches_walter(cosines(a, b), alpha, ior, compared);
            };
            if (i.z > 1e-6) check(i, o);
            if (refract(o, h, m, i) && i.z < -1e-6) check(i, o);
          }
      }
  EXPECT_GT(compared, 300);
}

TEST(DielectricLobe, ReciprocalUpToTheSquaredIndex) {
  Rng rng({22, 0, 0}, 0, 0);
  for (int k = 0; k < 2000; ++k) {
    const double ior = k % 2 ? 1.6 : 0.6;
    const Vec3 i = direction(kPi * rng.uniform(), kTwoPi * rng.uniform()), o = direction(kPi * rng.uniform(), 0);
    const Material m = glass(0.3, ior);
    const double n_i = i.z > 0 ? 1 : ior, n_o = o.z > 0 ? 1 : ior;
    const double there = value(m, i.z, o.z, dot(i, o)) / (n_o * n_o);
    EXPECT_NEAR(there, value(m, o.z, i.z, dot(i, o)) / (n_i * n_i), 1e-14 * there);
  }
}

constexpr int kHalf = kSide * kSide;

/// The half vector's slope over alpha, as 1 / sqrt(1 + slope^2), and its azimuth: reflections first, then refractions.
int bin_of(const Vec3& i, const Vec3& o, double m, double alpha) {
  Vec3 h = i.z > 0 ? i + o : i * m + o;
  if (h.z < 0) h = -h;
  const double slope2 = (h.x * h.x + h.y * h.y) / (h.z * h.z * alpha * alpha);
  return (i.z > 0 ? 0 : kHalf) + bin(1 / std::sqrt(1 + slope2), std::atan2(h.y, h.x));
}

// Every visible microfacet reflects or refracts. What stays on its side of the surface has the density of
// direction_pdf; that and what Walter's formulas say gets lost add up to one (the white furnace with the masking of one
// direction). 54 tests at |z| < 5.5: false alarm 6e-5.
TEST(DielectricSampling, FollowsItsDensityAndLosesNothingElse) {
  for (const double alpha : {0.02, 0.3, 0.8})
    for (const double ior : {1.5, 1.02, 0.6})
      for (const bool behind : {false, true})
        for (const double theta : {0.0, 0.8, 1.4}) {
          const Material m = glass(alpha, ior);
          const double side = behind ? -1 : 1, relative = behind ? 1 / ior : ior;
          const Vec3 o = direction(theta, 0.4);
          std::vector<double> probability(2 * kHalf + 1);
          double total = 0, lost = 0;
          constexpr int kSub = 16;
          for (int a = 0; a < kSide * kSub; ++a)
            for (int b = 0; b < kSide * kSub; ++b) {
              const double g = (a + 0.5) / (kSide * kSub), phi = kTwoPi * (b + 0.5) / (kSide * kSub);
              const double r = std::sqrt((1 - g) * (1 + g)) / g;
              const Vec3 h = normalize(Vec3{alpha * r * std::cos(phi), alpha * r * std::sin(phi), 1});
              const double x = dot(o, h);
              if (x <= 0) continue;
              const double solid_angle = std::pow(h.z / g, 3) * alpha * alpha * kTwoPi / (kHalf * kSub * kSub);
              const double visible = ggx(h.z, alpha) * smith_g1(o.z, alpha) * x / o.z * solid_angle;
              const auto add = [&](const Vec3& i, double jacobian) {
                const double mass = pdf(m, side * i.z, side * o.z, dot(i, o)) * jacobian * solid_angle;
                probability[bin_of(i, o, relative, alpha)] += mass;
                total += mass;
              };
              const Vec3 mirrored = 2 * x * h - o;
              Vec3 bent;
              const bool refracts = refract(o, h, relative, bent);
              const double reflectance = refracts ? fresnel(x, -dot(bent, h), 1.0, relative) : 1;
              if (mirrored.z > 0) {
                add(mirrored, 4 * x);
              } else {
                lost += visible * reflectance;
              }
              if (!refracts) continue;
              if (bent.z < 0) {
                const double sum = relative * dot(bent, h) + x;
                add(bent, sum * sum / (relative * relative * -dot(bent, h)));
              } else {
                lost += visible * (1 - reflectance);
              }
            }
          const std::string where = "alpha " + std::to_string(alpha) + " ior " + std::to_string(ior) + " theta " +
                                    std::to_string(theta) + (behind ? " behind" : "");
          EXPECT_NEAR(total + lost, 1, 2e-3) << where;
          probability.back() = std::max(1 - total, 0.0);

          std::vector<int> counts(2 * kHalf + 1);
          Rng rng({23, 0, 0}, 0, 0);
          for (int k = 0; k < kSamples; ++k) {
            const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
            const auto sample = testing::sample(m, {0, 0, side}, o, u0, u1, u2);
            ++counts[sample ? bin_of(sample->direction, o, relative, alpha) : 2 * kHalf];
          }
          EXPECT_LT(std::abs(chi_square_z(counts, probability)), 5.5) << where;
        }
}

TEST(DielectricSampling, WeightAndDensityAgreeWithTheLobe) {
  Rng rng({24, 0, 0}, 0, 0);
  int refractions = 0;
  for (const TransportMode mode : {TransportMode::radiance, TransportMode::importance})
    for (const double alpha : {0.01, 0.1, 0.8})
      for (const double ior : {1.5, 0.7})
        for (int k = 0; k < 1000; ++k) {
          const Material m = glass(alpha, ior);
          const Vec3 given = direction(kPi * rng.uniform(), 0.9);
          const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
          const auto sample = testing::sample(m, {0, 0, 1}, given, u0, u1, u2, mode);
          if (!sample) continue;
          const Vec3& drawn = sample->direction;
          refractions += drawn.z * given.z < 0;
          EXPECT_NEAR(length(drawn), 1, 1e-14);
          const double c = dot(given, drawn);
          EXPECT_NEAR(sample->pdf / pdf(m, drawn.z, given.z, c), 1, 1e-8);
          const bool light = mode == TransportMode::radiance;
          const double f = value(m, light ? drawn.z : given.z, light ? given.z : drawn.z, c);
          EXPECT_NEAR(sample->weight.r * sample->pdf / (f * std::abs(drawn.z)), 1, 1e-8);
        }
  EXPECT_GT(refractions, 3000);
}

/// Share of the energy of light from `given` that leaves, by the midpoint rule over both hemispheres.
double energy(const Material& m, const Vec3& given) {
  constexpr int kTheta = 800, kPhi = 400;
  double sum = 0;
  for (int a = 0; a < kTheta; ++a)
    for (int b = 0; b < kPhi; ++b) {
      const Vec3 o = direction(kPi * (a + 0.5) / kTheta, kTwoPi * (b + 0.5) / kPhi);
      sum += value(m, given.z, o.z, dot(given, o)) * std::abs(o.z) * std::sqrt((1 - o.z) * (1 + o.z));
    }
  return sum * (kPi / kTheta) * (kTwoPi / kPhi);
}

// Never more than comes in; the mean weight of a walk that carries energy is that share. 24 tests at |z| < 5: false
// alarm 1.4e-5.
TEST(DielectricSampling, ConservesEnergy) {
  for (const double alpha : {0.2, 0.5, 1.0})
    for (const double ior : {1.5, 0.6})
      for (const double theta : {0.3, 1.2, 2.0, 2.9}) {
        const Material m = glass(alpha, ior);
        const Vec3 given = direction(theta, 0.4);
        const double expected = energy(m, given);
        EXPECT_LT(expected, 1 + 1e-5);
        EXPECT_GT(expected, 0.3);
        double sum = 0, squares = 0;
        Rng rng({25, 0, 0}, 0, 0);
        for (int k = 0; k < kSamples; ++k) {
          const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
          const auto sample = testing::sample(m, {0, 0, 1}, given, u0, u1, u2, TransportMode::importance);
          const double w = sample ? sample->weight.r : 0;
          EXPECT_LE(w, 1 + 1e-12);
          sum += w;
          squares += w * w;
        }
        const double mean = sum / kSamples, error = std::sqrt((squares / kSamples - mean * mean) / kSamples);
        EXPECT_NEAR(mean, expected, 5 * error + 2e-4) << "alpha " << alpha << " ior " << ior << " theta " << theta;
      }
}

// A smooth face is Fresnel's: at normal incidence ((n - 1) / (n + 1))^2 is reflected; beyond the critical angle, all.
TEST(DielectricSampling, SmoothFaceFollowsFresnel) {
  const auto reflected = [](double theta, bool behind) {
    double sum = 0;
    Rng rng({26, 0, 0}, 0, 0);
    for (int k = 0; k < kSamples; ++k) {
      const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
      const auto s = testing::sample(glass(0.001, 1.5), {0, 0, behind ? -1.0 : 1.0}, direction(theta, 0), u0, u1, u2);
      if (s && s->direction.z > 0) sum += s->weight.r;
    }
    return sum / kSamples;
  };
  EXPECT_NEAR(reflected(0, false), 0.04, 5 * std::sqrt(0.04 * 0.96 / kSamples));
  EXPECT_NEAR(reflected(0, true), 0.04, 5 * std::sqrt(0.04 * 0.96 / kSamples));
  EXPECT_NEAR(reflected(std::asin(1 / 1.5) + 0.02, true), 1, 1e-3);
}

}  // namespace
}  // namespace isochron
