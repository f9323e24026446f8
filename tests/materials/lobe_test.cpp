// Values and derivatives of the lobes against the textbook formulas on dual numbers in extended precision.
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "core/scene/materials/material.h"

namespace isochron {
namespace {

Material conductor(double alpha, bool two_sided = false) {
  Material m;
  m.type = MaterialType::rough_conductor;
  m.roughness = alpha;
  m.two_sided = two_sided;
  return m;
}

template <class T>
T smith_lambda(const T& cosine, const T& alpha) {
  const T tan2 = (T(1) - cosine * cosine) / (cosine * cosine);
  return (sqrt(T(1) + alpha * alpha * tan2) - T(1)) / T(2);
}

/// D G2 / (4 cos_i cos_o), term by term as in Heitz 2014.
template <class T>
T textbook_lobe(const T& cos_i, const T& cos_o, const T& cos_io, const T& alpha) {
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
  const Jet expected = log(textbook_lobe(Jet(c.i, 0), Jet(c.o, 1), Jet(c.io, 2), Jet(alpha, 3)));
  const LobeDerivative got = lobe_derivative(conductor(alpha), c.i, c.o, c.io);

  // q - p^2 is rounded to a few ulp of q, and the lobe divides by q - p^2 + alpha^2 p^2: that is its
  // condition.
  const long double q = 2 + 2 * static_cast<long double>(c.io), p = static_cast<long double>(c.i) + c.o;
  const long double t = q - (1 - static_cast<long double>(alpha) * alpha) * p * p;
  const double tolerance = 16 * std::numeric_limits<double>::epsilon() * static_cast<double>(1 + 2 / t);
  EXPECT_NEAR(std::log(got.value), static_cast<double>(expected.a), tolerance) << alpha;
  EXPECT_NEAR(got.value / lobe(conductor(alpha), c.i, c.o, c.io), 1, tolerance);
  const double d[4] = {got.d_cos_i, got.d_cos_o, got.d_cos_io, got.d_roughness};
  double scale = 0;
  for (int k = 0; k < 4; ++k) scale = std::max(scale, std::abs(static_cast<double>(expected.v[k])));
  // The textbook's own 1 / cos cancels at grazing, down to an ulp of the extended type.
  const double textbook_error = 0x1p-62 / std::min(c.i, c.o);
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(d[k], static_cast<double>(expected.v[k]), tolerance * scale + textbook_error)
        << "argument " << k << " alpha " << alpha << " cosines " << c.i << ' ' << c.o << ' ' << c.io;
  }
}

TEST(LobeDerivative, MatchesDualNumbers) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int k = 0; k < 2000; ++k) {
    const double theta_i = 1.55 * uniform(generator), theta_o = 1.55 * uniform(generator);
    const double alpha = 0.01 * std::pow(100.0, uniform(generator));
    expect_matches_textbook(cosines(theta_i, theta_o, 6.28 * uniform(generator)), alpha);
  }
}

TEST(LobeDerivative, MatchesDualNumbersNearTheMirrorDirection) {
  for (const double alpha : {0.01, 0.05, 0.3}) {
    for (const double theta : {0.1, 0.8, 1.3, 1.5}) {
      for (const double off : {1e-6, 1e-4, 1e-2}) {
        expect_matches_textbook(cosines(theta + off, theta, 3.14159265358979), alpha);
        expect_matches_textbook(cosines(theta, theta, 3.14159265358979 - off), alpha);
      }
    }
  }
}

TEST(LobeDerivative, MatchesDualNumbersAtGrazing) {
  constexpr double kHalfPi = 1.5707963267948966;
  for (const double alpha : {0.01, 0.1, 1.0}) {
    for (const double grazing : {1e-2, 1e-4, 1e-6}) {
      expect_matches_textbook(cosines(kHalfPi - grazing, 0.7, 2.0), alpha);
      expect_matches_textbook(cosines(0.7, kHalfPi - grazing, 2.0), alpha);
      expect_matches_textbook(cosines(kHalfPi - grazing, kHalfPi - 2 * grazing, 1.0), alpha);
    }
  }
}

TEST(LobeDerivative, MatchesDifferencesOfLobe) {
  const double alpha = 0.3, h = 1e-6;
  const Cosines c = cosines(0.9, 0.5, 2.5);
  const auto ln = [&](double di, double d_o, double dio, double da) {
    return std::log(lobe(conductor(alpha + da), c.i + di, c.o + d_o, c.io + dio));
  };
  const LobeDerivative d = lobe_derivative(conductor(alpha), c.i, c.o, c.io);
  EXPECT_NEAR(d.d_cos_i, (ln(h, 0, 0, 0) - ln(-h, 0, 0, 0)) / (2 * h), 1e-7);
  EXPECT_NEAR(d.d_cos_o, (ln(0, h, 0, 0) - ln(0, -h, 0, 0)) / (2 * h), 1e-7);
  EXPECT_NEAR(d.d_cos_io, (ln(0, 0, h, 0) - ln(0, 0, -h, 0)) / (2 * h), 1e-7);
  EXPECT_NEAR(d.d_roughness, (ln(0, 0, 0, h) - ln(0, 0, 0, -h)) / (2 * h), 1e-7);
}

TEST(Lobe, PeakInClosedForm) {
  for (const double alpha : {0.01, 0.2, 1.0}) {
    // Normal incidence: D = 1 / (pi alpha^2), G2 = 1.
    EXPECT_DOUBLE_EQ(lobe(conductor(alpha), 1, 1, 1), 1 / (4 * kPi * alpha * alpha));
  }
  // alpha = 1: D = 1 / pi for every h and Lambda = (1 / cos - 1) / 2, so lobe = 1 / (2 pi (cos_i + cos_o)).
  EXPECT_NEAR(lobe(conductor(1), 0.3, 0.8, 0.5), 1 / (2 * kPi * 1.1), 1e-15);
}

TEST(Lobe, Diffuse) {
  const Material m;
  EXPECT_EQ(lobe(m, 0.2, 0.9, 0.1), kInvPi);
  const LobeDerivative d = lobe_derivative(m, 0.2, 0.9, 0.1);
  EXPECT_EQ(d.value, kInvPi);
  EXPECT_EQ(d.d_cos_i, 0);
  EXPECT_EQ(d.d_cos_o, 0);
  EXPECT_EQ(d.d_cos_io, 0);
  EXPECT_EQ(d.d_roughness, 0);
}

TEST(Lobe, Reciprocal) {
  const Cosines c = cosines(1.2, 0.3, 2.0);
  for (const double alpha : {0.02, 0.5}) {
    EXPECT_DOUBLE_EQ(lobe(conductor(alpha), c.i, c.o, c.io), lobe(conductor(alpha), c.o, c.i, c.io));
  }
}

TEST(Lobe, NothingBelowTheSurface) {
  for (Material m : {Material{}, conductor(0.3)}) {
    for (const bool two_sided : {false, true}) {
      m.two_sided = two_sided;
      for (const auto& [i, o] : std::vector<std::pair<double, double>>{{-0.5, 0.5}, {0.5, -0.5}, {0, 0.5}, {0.5, 0}}) {
        EXPECT_EQ(lobe(m, i, o, 0.1), 0);
        EXPECT_EQ(direction_pdf(m, i, o, 0.1), 0);
        const LobeDerivative d = lobe_derivative(m, i, o, 0.1);
        EXPECT_EQ(d.value, 0);
        EXPECT_EQ(d.d_cos_i, 0);
        EXPECT_EQ(d.d_roughness, 0);
      }
    }
    m.two_sided = false;
    EXPECT_EQ(lobe(m, -0.5, -0.5, 0.6), 0);
    EXPECT_EQ(direction_pdf(m, -0.5, -0.5, 0.6), 0);
    EXPECT_EQ(lobe_derivative(m, -0.5, -0.5, 0.6).value, 0);
  }
}

// Opposite directions graze each other through the surface: no half vector, no lobe, and no NaN.
TEST(Lobe, OppositeDirections) {
  EXPECT_EQ(lobe(conductor(0.1), 1e-20, 1e-20, -1), 0);
  EXPECT_EQ(direction_pdf(conductor(0.1), 1e-20, 1e-20, -1), 0);
  EXPECT_EQ(lobe_derivative(conductor(0.1), 1e-20, 1e-20, -1).d_cos_io, 0);
}

TEST(Lobe, TwoSidedMirrorsValueAndDerivative) {
  const Material m = conductor(0.25, true);
  const Cosines c = cosines(0.8, 0.5, 2.8);
  const LobeDerivative front = lobe_derivative(m, c.i, c.o, c.io), back = lobe_derivative(m, -c.i, -c.o, c.io);
  EXPECT_GT(front.value, 0);
  EXPECT_EQ(back.value, front.value);
  EXPECT_EQ(back.d_cos_i, -front.d_cos_i);
  EXPECT_EQ(back.d_cos_o, -front.d_cos_o);
  EXPECT_EQ(back.d_cos_io, front.d_cos_io);
  EXPECT_EQ(back.d_roughness, front.d_roughness);
  EXPECT_EQ(lobe(m, -c.i, -c.o, c.io), lobe(m, c.i, c.o, c.io));
  EXPECT_EQ(direction_pdf(m, -c.i, -c.o, c.io), direction_pdf(m, c.i, c.o, c.io));
  // The sign, by differences of the lobe behind the surface.
  const double h = 1e-6;
  const double by_i = std::log(lobe(m, -c.i + h, -c.o, c.io) / lobe(m, -c.i - h, -c.o, c.io)) / (2 * h);
  EXPECT_NEAR(back.d_cos_i, by_i, 1e-7 * std::abs(by_i));
}

}  // namespace
}  // namespace isochron
