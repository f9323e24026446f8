// Values and derivatives of materials against the textbook formulas on dual numbers in extended precision.
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "tests/materials/cosines.h"
#include "tests/seed.h"

namespace isochron {
namespace {

using namespace testing;

template <class T>
T smith_lambda(const T& cosine, const T& alpha) {
  const T tan2 = (T(1) - cosine * cosine) / (cosine * cosine);
  return (sqrt(T(1) + alpha * alpha * tan2) - T(1)) / T(2);
}

/// D G2 / (4 cos_i cos_o), term by term as in Heitz 2014.
template <class T>
T textbook(const T& cos_i, const T& cos_o, const T& cos_io, const T& alpha) {
  const T cos_h = (cos_i + cos_o) / sqrt(T(2) + T(2) * cos_io);
  const T tan2_h = (T(1) - cos_h * cos_h) / (cos_h * cos_h);
  const T factor = T(1) + tan2_h / (alpha * alpha);
  const T d = T(1) / (T(3.14159265358979323846264338327950288L) * alpha * alpha * cos_h * cos_h * cos_h * cos_h *
                      factor * factor);
  const T g2 = T(1) / (T(1) + smith_lambda(cos_i, alpha) + smith_lambda(cos_o, alpha));
  return d * g2 / (T(4) * cos_i * cos_o);
}

struct Cosines {
  double i, o, io;
};

Cosines cosines(double theta_i, double theta_o, double phi) {
  return {std::cos(theta_i), std::cos(theta_o),
          std::cos(theta_i) * std::cos(theta_o) + std::sin(theta_i) * std::sin(theta_o) * std::cos(phi)};
}

void expect_matches_textbook(const Cosines& c, double alpha) {
  using Jet = ceres::Jet<long double, 4>;
  const Jet expected = log(textbook(Jet(c.i, 0), Jet(c.o, 1), Jet(c.io, 2), Jet(alpha, 3)));
  const CosineDerivative got = derivative(white_conductor(alpha), c.i, c.o, c.io);

  // q - p^2 is rounded to a few ulp of q, and the lobe divides by q - p^2 + alpha^2 p^2: that is its
  // condition.
  const long double q = 2 + 2 * static_cast<long double>(c.io), p = static_cast<long double>(c.i) + c.o;
  const long double t = q - (1 - static_cast<long double>(alpha) * alpha) * p * p;
  const double tolerance = 16 * std::numeric_limits<double>::epsilon() * static_cast<double>(1 + 2 / t);
  EXPECT_NEAR(std::log(got.value), static_cast<double>(expected.a), tolerance) << alpha;
  EXPECT_NEAR(got.value / value(white_conductor(alpha), c.i, c.o, c.io), 1, tolerance);
  const double d[4] = {got.by_cos_i, got.by_cos_o, got.by_cos_io, got.by_roughness};
  double scale = 0;
  for (int k = 0; k < 4; ++k) scale = std::max(scale, std::abs(static_cast<double>(expected.v[k])));
  // The textbook's own 1 / cos cancels at grazing, down to an ulp of the extended type.
  const double textbook_error = 0x1p-62 / std::min(c.i, c.o);
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(d[k], static_cast<double>(expected.v[k]), tolerance * scale + textbook_error)
        << "argument " << k << " alpha " << alpha << " cosines " << c.i << ' ' << c.o << ' ' << c.io;
  }
}

TEST(BsdfDerivative, MatchesDualNumbers) {
  std::mt19937 generator(test_seed(3));
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int k = 0; k < 2000; ++k) {
    const double theta_i = 1.55 * uniform(generator), theta_o = 1.55 * uniform(generator);
    const double alpha = 0.01 * std::pow(100.0, uniform(generator));
    expect_matches_textbook(cosines(theta_i, theta_o, 6.28 * uniform(generator)), alpha);
  }
}

TEST(BsdfDerivative, MatchesDualNumbersNearTheMirrorDirection) {
  for (const double alpha : {0.01, 0.05, 0.3}) {
    for (const double theta : {0.1, 0.8, 1.3, 1.5}) {
      for (const double off : {1e-6, 1e-4, 1e-2}) {
        expect_matches_textbook(cosines(theta + off, theta, 3.14159265358979), alpha);
        expect_matches_textbook(cosines(theta, theta, 3.14159265358979 - off), alpha);
      }
    }
  }
}

TEST(BsdfDerivative, MatchesDualNumbersAtGrazing) {
  constexpr double kHalfPi = 1.5707963267948966;
  for (const double alpha : {0.01, 0.1, 1.0}) {
    for (const double grazing : {1e-2, 1e-4, 1e-6}) {
      expect_matches_textbook(cosines(kHalfPi - grazing, 0.7, 2.0), alpha);
      expect_matches_textbook(cosines(0.7, kHalfPi - grazing, 2.0), alpha);
      expect_matches_textbook(cosines(kHalfPi - grazing, kHalfPi - 2 * grazing, 1.0), alpha);
    }
  }
}

TEST(BsdfDerivative, MatchesDifferencesOfValue) {
  const double alpha = 0.3, h = 1e-6;
  const Cosines c = cosines(0.9, 0.5, 2.5);
  const auto ln = [&](double di, double d_o, double dio, double da) {
    return std::log(value(white_conductor(alpha + da), c.i + di, c.o + d_o, c.io + dio));
  };
  const CosineDerivative d = derivative(white_conductor(alpha), c.i, c.o, c.io);
  EXPECT_NEAR(d.by_cos_i, (ln(h, 0, 0, 0) - ln(-h, 0, 0, 0)) / (2 * h), 1e-7);
  EXPECT_NEAR(d.by_cos_o, (ln(0, h, 0, 0) - ln(0, -h, 0, 0)) / (2 * h), 1e-7);
  EXPECT_NEAR(d.by_cos_io, (ln(0, 0, h, 0) - ln(0, 0, -h, 0)) / (2 * h), 1e-7);
  EXPECT_NEAR(d.by_roughness, (ln(0, 0, 0, h) - ln(0, 0, 0, -h)) / (2 * h), 1e-7);
}

TEST(Bsdf, PeakInClosedForm) {
  for (const double alpha : {0.01, 0.2, 1.0}) {
    // Normal incidence: D = 1 / (pi alpha^2), G2 = 1.
    EXPECT_DOUBLE_EQ(value(white_conductor(alpha), 1, 1, 1), 1 / (4 * kPi * alpha * alpha));
  }
  // alpha = 1: D = 1 / pi for every h and Lambda = (1 / cos - 1) / 2, so lobe = 1 / (2 pi (cos_i + cos_o)).
  EXPECT_NEAR(value(white_conductor(1), 0.3, 0.8, 0.5), 1 / (2 * kPi * 1.1), 1e-15);
}

TEST(Bsdf, Diffuse) {
  const Material m = white_diffuse();
  EXPECT_EQ(value(m, 0.2, 0.9, 0.1), kInvPi);
  const CosineDerivative d = derivative(m, 0.2, 0.9, 0.1);
  EXPECT_EQ(d.value, kInvPi);
  EXPECT_EQ(d.by_cos_i, 0);
  EXPECT_EQ(d.by_cos_o, 0);
  EXPECT_EQ(d.by_cos_io, 0);
  EXPECT_EQ(d.by_roughness, 0);
}

TEST(Bsdf, Reciprocal) {
  const Cosines c = cosines(1.2, 0.3, 2.0);
  for (const double alpha : {0.02, 0.5}) {
    EXPECT_DOUBLE_EQ(value(white_conductor(alpha), c.i, c.o, c.io), value(white_conductor(alpha), c.o, c.i, c.io));
  }
}

TEST(Bsdf, NothingBelowTheSurface) {
  for (Material m : {white_diffuse(), white_conductor(0.3)}) {
    for (const bool two_sided : {false, true}) {
      m.bsdf().set_two_sided(two_sided);
      for (const auto& [i, o] : std::vector<std::pair<double, double>>{{-0.5, 0.5}, {0.5, -0.5}, {0, 0.5}, {0.5, 0}}) {
        EXPECT_EQ(value(m, i, o, 0.1), 0);
        EXPECT_EQ(pdf(m, i, o, 0.1), 0);
        const CosineDerivative d = derivative(m, i, o, 0.1);
        EXPECT_EQ(d.value, 0);
        EXPECT_EQ(d.by_cos_i, 0);
        EXPECT_EQ(d.by_roughness, 0);
      }
    }
    m.bsdf().set_two_sided(false);
    EXPECT_EQ(value(m, -0.5, -0.5, 0.6), 0);
    EXPECT_EQ(pdf(m, -0.5, -0.5, 0.6), 0);
    EXPECT_EQ(derivative(m, -0.5, -0.5, 0.6).value, 0);
  }
}

// Opposite directions graze each other through the surface: no half vector, no lobe, and no NaN.
TEST(Bsdf, OppositeDirections) {
  EXPECT_EQ(value(white_conductor(0.1), 1e-20, 1e-20, -1), 0);
  EXPECT_EQ(pdf(white_conductor(0.1), 1e-20, 1e-20, -1), 0);
  EXPECT_EQ(derivative(white_conductor(0.1), 1e-20, 1e-20, -1).by_cos_io, 0);
}

TEST(Bsdf, TwoSidedMirrorsValueAndDerivative) {
  const Material m = white_conductor(0.25, true);
  const Cosines c = cosines(0.8, 0.5, 2.8);
  const CosineDerivative front = derivative(m, c.i, c.o, c.io), back = derivative(m, -c.i, -c.o, c.io);
  EXPECT_GT(front.value, 0);
  EXPECT_EQ(back.value, front.value);
  EXPECT_EQ(back.by_cos_i, -front.by_cos_i);
  EXPECT_EQ(back.by_cos_o, -front.by_cos_o);
  EXPECT_EQ(back.by_cos_io, front.by_cos_io);
  EXPECT_EQ(back.by_roughness, front.by_roughness);
  EXPECT_EQ(value(m, -c.i, -c.o, c.io), value(m, c.i, c.o, c.io));
  EXPECT_EQ(pdf(m, -c.i, -c.o, c.io), pdf(m, c.i, c.o, c.io));
  // The sign, by differences of the lobe behind the surface.
  const double h = 1e-6;
  const double by_i = std::log(value(m, -c.i + h, -c.o, c.io) / value(m, -c.i - h, -c.o, c.io)) / (2 * h);
  EXPECT_NEAR(back.by_cos_i, by_i, 1e-7 * std::abs(by_i));
}

}  // namespace
}  // namespace isochron
