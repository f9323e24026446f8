// Sampling of directions: chi-square against the density integrated over bins, energy against quadrature.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/base/random.h"
#include "tests/materials/chi_square.h"
#include "tests/materials/cosines.h"

namespace isochron {
namespace {

const Vec3 kNormal = normalize(Vec3{0.3, -0.5, 0.7});

using namespace testing;

struct LocalFrame {
  LocalFrame() { complete_frame(kNormal, s, t); }
  Vec3 world(const Vec3& v) const { return v.x * s + v.y * t + v.z * kNormal; }
  Vec3 local(const Vec3& v) const { return {dot(v, s), dot(v, t), dot(v, kNormal)}; }
  Vec3 s, t;
};

Vec3 tilted(double theta) {
  return {std::sin(theta) * std::cos(0.4), std::sin(theta) * std::sin(0.4), std::cos(theta)};
}

// Bins in the half vector's slope, g = 1 / sqrt(1 + r^2) with r = tan(theta_h) / alpha, so that no lobe is
// too narrow: dw_i = 4 (w_o.h) dw_h and dw_h = cos^3(theta_h) alpha^2 / g^3 dg dphi. 18 tests at |z| < 5.5
// (the tail of a chi-square with 250 degrees of freedom beyond it: about 1e-6): false alarm 2e-5.
TEST(SampleDirection, ConductorFollowsItsDensity) {
  const LocalFrame frame;
  for (const double alpha : {0.01, 0.2, 0.7}) {
    for (const double theta : {0.0, 0.6, 1.2, 1.5, 1.55, 1.5705}) {
      const Material m = white_conductor(alpha);
      const Vec3 o = tilted(theta), w_o = frame.world(o);
      std::vector<double> probability(kSide * kSide + 1);
      constexpr int kSub = 24;
      double total = 0;
      for (int a = 0; a < kSide * kSub; ++a) {
        for (int b = 0; b < kSide * kSub; ++b) {
          const double g = (a + 0.5) / (kSide * kSub), phi = kTwoPi * (b + 0.5) / (kSide * kSub);
          const double r = std::sqrt((1 - g) * (1 + g)) / g;
          const Vec3 h = normalize(Vec3{alpha * r * std::cos(phi), alpha * r * std::sin(phi), 1});
          const double facing = dot(o, h);
          if (facing <= 0) continue;
          const Vec3 i = 2 * facing * h - o;
          const double by_g_phi = 4 * facing * std::pow(h.z / g, 3) * alpha * alpha;
          const double mass = pdf(m, i.z, o.z, dot(i, o)) * by_g_phi * kTwoPi / (kSide * kSide * kSub * kSub);
          probability[bin(g, phi)] += mass;
          total += mass;
        }
      }
      EXPECT_LT(total, 1 + 1e-3);
      probability.back() = std::max(1 - total, 0.0);

      std::vector<int> counts(kSide * kSide + 1);
      Rng rng({11, 0, 0}, 0, 0);
      for (int k = 0; k < kSamples; ++k) {
        const double u0 = rng.uniform(), u1 = rng.uniform();
        const auto sample = testing::sample(m, kNormal, w_o, u0, u1);
        if (!sample) {
          ++counts.back();
          continue;
        }
        const Vec3 i = frame.local(sample->direction), h = normalize(i + o);
        const double r2 = (h.x * h.x + h.y * h.y) / (h.z * h.z * alpha * alpha);
        ++counts[bin(1 / std::sqrt(1 + r2), std::atan2(h.y, h.x))];
      }
      EXPECT_LT(std::abs(chi_square_z(counts, probability)), 5.5) << "alpha " << alpha << " theta " << theta;
    }
  }
}

// Equal areas of the projected disc; one test at |z| < 5.5.
TEST(SampleDirection, DiffuseFollowsTheCosine) {
  const LocalFrame frame;
  std::vector<int> counts(kSide * kSide + 1);
  std::vector<double> probability(kSide * kSide + 1, 1.0 / (kSide * kSide));
  probability.back() = 0;
  Rng rng({12, 0, 0}, 0, 0);
  for (int k = 0; k < kSamples; ++k) {
    const double u0 = rng.uniform(), u1 = rng.uniform();
    const auto sample = testing::sample(white_diffuse(), kNormal, frame.world(tilted(1.0)), u0, u1);
    ASSERT_TRUE(sample);
    const Vec3 i = frame.local(sample->direction);
    ++counts[bin(i.x * i.x + i.y * i.y, std::atan2(i.y, i.x))];
  }
  EXPECT_LT(std::abs(chi_square_z(counts, probability)), 5.5);
}

TEST(SampleDirection, WeightAndDensityAgreeWithTheLobe) {
  const LocalFrame frame;
  Rng rng({13, 0, 0}, 0, 0);
  for (const bool behind : {false, true}) {
    for (const double alpha : {0.0, 0.01, 0.1, 0.8}) {  // 0: diffuse
      const Material m = alpha == 0 ? white_diffuse(behind) : white_conductor(alpha, behind);
      for (int k = 0; k < 2000; ++k) {
        Vec3 o = tilted(1.57 * rng.uniform());
        if (behind) o.z = -o.z;
        const double u0 = rng.uniform(), u1 = rng.uniform();
        const Vec3 w_o = frame.world(o);
        const auto sample = testing::sample(m, kNormal, w_o, u0, u1);
        if (!sample) continue;
        const double cos_i = dot(kNormal, sample->direction), cos_o = dot(kNormal, w_o);
        const double cos_io = dot(sample->direction, w_o);
        EXPECT_GT(cos_i * cos_o, 0);
        EXPECT_NEAR(length(sample->direction), 1, 1e-14);
        // Contracted multiply-adds may round the cosines differently here; the density amplifies that by the
        // inverse of sin^2(theta_h) + alpha^2 cos^2(theta_h), whose terms are sums and differences of |w_i +
        // w_o|^2.
        const double q = 2 + 2 * cos_io, p = cos_i + cos_o;
        const double t = alpha * alpha * p * p + std::max(q - p * p, 0.0);
        const double tolerance = 16 * std::numeric_limits<double>::epsilon() * (1 + (alpha > 0 ? 2 / t + 1 / q : 0));
        EXPECT_NEAR(sample->pdf / pdf(m, cos_i, cos_o, cos_io), 1, tolerance);
        const double expected = value(m, cos_i, cos_o, cos_io) * std::abs(cos_i);
        EXPECT_NEAR(sample->weight.r * sample->pdf / expected, 1, tolerance + 8e-16 / std::abs(cos_i));
      }
    }
  }
}

TEST(SampleDirection, NothingBehindAOneSidedSurface) {
  const LocalFrame frame;
  for (Material m : {white_diffuse(), white_conductor(0.2)}) {
    EXPECT_FALSE(sample(m, kNormal, frame.world({0.6, 0, -0.8}), 0.3, 0.6));
    m.bsdf().set_two_sided(true);
    EXPECT_TRUE(sample(m, kNormal, frame.world({0.6, 0, -0.8}), 0.3, 0.6));
  }
}

/// Directional albedo by the midpoint rule over the hemisphere.
double albedo(const Material& m, const Vec3& o) {
  constexpr int kTheta = 600, kPhi = 600;
  double sum = 0;
  for (int a = 0; a < kTheta; ++a) {
    const double theta = 0.5 * kPi * (a + 0.5) / kTheta, z = std::cos(theta), r = std::sin(theta);
    for (int b = 0; b < kPhi; ++b) {
      const double phi = kTwoPi * (b + 0.5) / kPhi;
      const Vec3 i{r * std::cos(phi), r * std::sin(phi), z};
      sum += value(m, i.z, o.z, dot(i, o)) * i.z * r;
    }
  }
  return sum * (0.5 * kPi / kTheta) * (kTwoPi / kPhi);
}

// Monte Carlo mean of the weights against quadrature. 12 tests at |z| < 5: false alarm 7e-6.
TEST(SampleDirection, EnergyMatchesQuadrature) {
  const LocalFrame frame;
  for (const double alpha : {0.1, 0.4, 1.0}) {
    const Material m = white_conductor(alpha);
    for (const double theta : {0.0, 0.8, 1.3, 1.5}) {
      const double expected = albedo(m, tilted(theta));
      EXPECT_LT(expected, 1 + 1e-6);
      EXPECT_GT(expected, 0.3);
      double sum = 0, squares = 0;
      Rng rng({14, 0, 0}, 0, 0);
      for (int k = 0; k < kSamples; ++k) {
        const double u0 = rng.uniform(), u1 = rng.uniform();
        const auto sample = testing::sample(m, kNormal, frame.world(tilted(theta)), u0, u1);
        const double w = sample ? sample->weight.r : 0;
        EXPECT_LE(w, 1 + 1e-12);
        sum += w;
        squares += w * w;
      }
      const double mean = sum / kSamples;
      const double error = std::sqrt((squares / kSamples - mean * mean) / kSamples);
      EXPECT_NEAR(mean, expected, 5 * error + 1e-5) << "alpha " << alpha << " theta " << theta;
    }
  }
}

TEST(Bsdf, DiffuseWhiteFurnace) {
  EXPECT_NEAR(albedo(white_diffuse(), tilted(0.9)), 1, 1e-5);
  EXPECT_EQ(sample(white_diffuse(), {0, 0, 1}, {0, 0, 1}, 0.2, 0.7)->weight.r, 1);
}

// A smooth conductor loses almost nothing: the white furnace of GGX as alpha goes to zero.
TEST(Bsdf, SmoothConductorKeepsItsEnergy) {
  double sum = 0;
  Rng rng({15, 0, 0}, 0, 0);
  for (int k = 0; k < 10000; ++k) {
    const double u0 = rng.uniform(), u1 = rng.uniform();
    const auto sample = testing::sample(white_conductor(0.01), {0, 0, 1}, tilted(0.5), u0, u1);
    if (sample) sum += sample->weight.r;
  }
  EXPECT_NEAR(sum / 10000, 1, 2e-3);
}

}  // namespace
}  // namespace isochron
