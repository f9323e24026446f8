// Sampling of lengths and of coupled pairs: quantiles against distribution functions, and the identity
// sum over parts of mass * E[h(plus) - h(minus)] = integral of h dW = -integral of h' W.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/gates/gate.h"
#include "tests/gates/quadrature.h"

namespace isochron {
namespace {

struct TestFunction {
  const char* name;
  std::function<double(double)> h, slope;
};

const std::vector<TestFunction> kFunctions{
    {"x", [](double x) { return x; }, [](double) { return 1.0; }},
    {"x^2 + 3 x^3", [](double x) { return x * x + 3 * x * x * x; }, [](double x) { return 2 * x + 9 * x * x; }},
    {"sin(2 x + 1)", [](double x) { return std::sin(2 * x + 1); }, [](double x) { return 2 * std::cos(2 * x + 1); }}};

/// Expectation over u by the midpoint rule: u -> sample is piecewise smooth, with square roots at the ends.
template <class F>
double expect_over_u(F&& f) {
  constexpr int kSteps = 200000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) sum += f((i + 0.5) / kSteps);
  return sum / kSteps;
}

double pair_term(const GateShape& gate, PairPart part, const TestFunction& t) {
  if (gate.pair_mass(part) == 0) return 0;
  return gate.pair_mass(part) * expect_over_u([&](double u) {
           const CoupledPair p = gate.sample_pair(part, u);
           return (p.has_plus ? t.h(p.plus) : 0.0) - (p.has_minus ? t.h(p.minus) : 0.0);
         });
}

TEST(SamplePair, IntegratesTheDerivativeMeasure) {
  for (const auto& [name, gate] : finite_gates()) {
    for (const TestFunction& t : kFunctions) {
      const double expected = -integrate(gate, [&](double x) { return t.slope(x) * gate.value(x); });
      const double got = pair_term(gate, PairPart::smooth, t) + pair_term(gate, PairPart::dirac, t);
      EXPECT_NEAR(got, expected, 2e-5) << name << ", h = " << t.name;
    }
  }
}

// The continuous part is W', the Dirac parts are what is left: what standard sampling takes by the gate's slope, and what
// ellipsoidal sampling takes in pairs, are the same term.
TEST(SamplePair, PartsAreTheSlopeAndTheJumps) {
  for (const auto& [name, gate] : finite_gates()) {
    for (const TestFunction& t : kFunctions) {
      const double expected = -integrate(gate, [&](double x) { return t.slope(x) * gate.value(x); });
      const double smooth = integrate(gate, [&](double x) { return t.h(x) * gate.derivative(x); });
      // The narrow gate's two halves are 1e3 times larger than their sum, hence the scale.
      const double scale = 1 + gate.pair_mass(PairPart::smooth) + gate.pair_mass(PairPart::dirac);
      EXPECT_NEAR(pair_term(gate, PairPart::smooth, t), smooth, 2e-5 * scale) << name << ", h = " << t.name;
      EXPECT_NEAR(smooth + pair_term(gate, PairPart::dirac, t), expected, 2e-5 * scale) << name << ", h = " << t.name;
    }
  }
}

// Each side alone is the positive or negative part: its total is the variation of the gate, and it lies where
// W rises or falls.
TEST(SamplePair, SidesAreTheJordanParts) {
  for (const auto& [name, gate] : finite_gates()) {
    if (gate.kind() == GateKind::bin) continue;  // no Jordan parts, see bins_test.cpp
    for (const PairPart part : {PairPart::smooth, PairPart::dirac}) {
      if (gate.pair_mass(part) == 0) continue;
      for (int i = 0; i < 1000; ++i) {
        const CoupledPair p = gate.sample_pair(part, (i + 0.5) / 1000);
        EXPECT_TRUE(p.has_plus || p.has_minus);
        EXPECT_EQ(p.has_plus, p.plus_is_jump == (part == PairPart::dirac));
        EXPECT_EQ(p.has_minus, p.minus_is_jump == (part == PairPart::dirac));
        if (!p.plus_is_jump) {
          EXPECT_GT(gate.derivative(p.plus), 0) << name << ' ' << p.plus;
        }
        if (!p.minus_is_jump) {
          EXPECT_LT(gate.derivative(p.minus), 0) << name << ' ' << p.minus;
        }
        const double probe = 1e-6 * gate.width();
        if (p.plus_is_jump) {
          EXPECT_GT(gate.value(p.plus + probe), gate.value(p.plus - probe)) << name;
        }
        if (p.minus_is_jump) {
          EXPECT_LT(gate.value(p.minus + probe), gate.value(p.minus - probe)) << name;
        }
      }
    }
  }
}

TEST(SamplePair, MassesInClosedForm) {
  const auto masses = [](const GateShape& gate) {
    return std::array<double, 2>{gate.pair_mass(PairPart::smooth), gate.pair_mass(PairPart::dirac)};
  };
  const auto expect = [&](const GateShape& gate, double smooth, double dirac) {
    const auto m = masses(gate);
    EXPECT_NEAR(m[0], smooth, 1e-14);
    EXPECT_NEAR(m[1], dirac, 1e-14);
  };
  const double peak = 1 / (0.3 * std::sqrt(kTwoPi)), edge = peak * std::exp(-0.5);
  expect(GateShape::steady(), 0, 0);
  expect(GateShape::gaussian(0.3), peak, 0);
  expect(GateShape::boxcar(0.8), 0, 1.25);
  expect(GateShape::truncated_gaussian(0.3, 0.3), peak - edge, edge);
  expect(GateShape::truncated_gaussian(0.3, 3), peak, 0);
  expect(GateShape::tabulated({-0.5, 0, 0.5}, {0, 1, 0}), 2, 0);
  expect(GateShape::tabulated({-0.5, 0.1, 0.5}, {3, 3, 3}), 0, 1);
  expect(GateShape::tabulated({0, 0, 1}, {0, 1, 0}), 2, 2);  // a jump against a slope
  // What has no continuous part must not ask for a pass over it, however the rounding falls.
  EXPECT_EQ(
      GateShape::tabulated({0, 0.3, 0.3, 0.9, 0.9, 1}, {0.1, 0.1, 0.7, 0.7, 0.2, 0.2}).pair_mass(PairPart::smooth), 0);
}

TEST(SamplePair, OrientationAndCoupling) {
  const GateShape gaussian = GateShape::gaussian(0.3);
  for (const double u : {1e-10, 0.2, 0.9, 1 - 1e-10}) {
    const CoupledPair p = gaussian.sample_pair(PairPart::smooth, u);
    EXPECT_LT(p.plus, 0);
    EXPECT_EQ(p.minus, -p.plus);
    EXPECT_NEAR(-std::expm1(-0.5 * p.minus * p.minus / 0.09), u, 1e-14);  // Rayleigh
  }
  const CoupledPair box = GateShape::boxcar(0.8).sample_pair(PairPart::dirac, 0.7);
  EXPECT_EQ(box.plus, -0.4);
  EXPECT_EQ(box.minus, 0.4);
  const CoupledPair saw = GateShape::tabulated({0, 0, 1}, {0, 1, 0}).sample_pair(PairPart::dirac, 0.7);
  EXPECT_TRUE(saw.has_plus && saw.plus_is_jump);
  EXPECT_FALSE(saw.has_minus);
  const CoupledPair slope = GateShape::tabulated({0, 0, 1}, {0, 1, 0}).sample_pair(PairPart::smooth, 0.7);
  EXPECT_FALSE(slope.has_plus);
  EXPECT_TRUE(slope.has_minus && !slope.minus_is_jump);
  // Quantile coupling shifts the rising half of a triangle onto the falling one.
  const GateShape triangle = GateShape::tabulated({-0.5, 0, 0.5}, {0, 1, 0});
  for (const double u : {0.01, 0.4, 0.99}) {
    const CoupledPair p = triangle.sample_pair(PairPart::smooth, u);
    EXPECT_NEAR(p.minus - p.plus, 0.5, 1e-15);
  }
}

TEST(SamplePair, StaysInsideTheSupport) {
  for (const auto& [name, gate] : finite_gates()) {
    for (const PairPart part : {PairPart::smooth, PairPart::dirac}) {
      if (gate.pair_mass(part) == 0) continue;
      for (const double u : {0x1p-53, 0.5, 1 - 0x1p-53}) {
        const CoupledPair p = gate.sample_pair(part, u);
        const double slack = 1e-15 * (gate.upper() - gate.lower());
        EXPECT_GE(std::min(p.plus, p.minus), gate.lower() - slack) << name;
        EXPECT_LE(std::max(p.plus, p.minus), gate.upper() + slack) << name;
      }
    }
  }
}

// The sample at u has distribution function u: the integral of the value up to it.
TEST(Sample, InvertsTheDistribution) {
  for (const auto& [name, gate] : finite_gates()) {
    if (gate.kind() == GateKind::bin) continue;  // takes two numbers, see bins_test.cpp
    double last = gate.lower();
    for (int i = 1; i < 64; ++i) {
      const double u = i / 64.0, x = gate.sample(u, 0.5);
      EXPECT_GT(x, last) << name;
      last = x;
      const double below = integrate(
          gate, [&](double y) { return gate.value(y); }, x);
      EXPECT_NEAR(below / gate.mass(), u, 1e-12) << name;
    }
  }
}

TEST(Sample, GaussianTailsInClosedForm) {
  const GateShape gate = GateShape::gaussian(0.3);
  for (double u = 1e-16; u < 0.5; u *= 3) {
    const long double x = gate.sample(u, 0.5) / 0.3L;
    const long double tail = 0.5L * std::erfc(-x * std::sqrt(0.5L));
    EXPECT_NEAR(static_cast<double>(tail / u), 1, 1e-13) << u;
    if (u > 1e-12) {
      EXPECT_NEAR(gate.sample(1 - u, 0.5), -gate.sample(u, 0.5), 1e-3 * u + 1e-16 / u);
    }
  }
  EXPECT_EQ(gate.sample(0.5, 0.5), 0);
}

TEST(Sample, TruncatedGaussianInClosedForm) {
  for (const double c : {1e-6, 0.3, 2.0, 6.0}) {
    const GateShape gate = GateShape::truncated_gaussian(0.3, 0.3 * c);
    for (const double u : {1e-9, 1e-3, 0.2, 0.49, 0.5, 0.6, 0.999}) {
      const long double x = gate.sample(u, 0.5) / 0.3L;
      const long double half = std::sqrt(0.5L);
      const long double expected = (2 * static_cast<long double>(u) - 1) * std::erf(c * half);
      EXPECT_NEAR(static_cast<double>((std::erf(x * half) - expected) / std::erf(c * half)), 0, 1e-14) << c << ' ' << u;
    }
  }
}

// Boxcar and table are exact: piecewise quadratic distribution functions.
TEST(Sample, TableInClosedForm) {
  const GateShape gate = GateShape::tabulated({0, 1, 1, 3}, {1, 3, 2, 0});  // x + x^2 up to 1, area 4
  for (const double x : {1e-8, 0.25, 0.9}) EXPECT_NEAR(gate.sample((x + x * x) / 4, 0.5) / x, 1, 1e-14);
  for (const double x : {1.1, 2.0, 2.9}) EXPECT_NEAR(gate.sample(1 - (3 - x) * (3 - x) / 8, 0.5), x, 1e-13);
  const GateShape gap = GateShape::tabulated({0, 1, 1, 2, 2, 3}, {1, 1, 0, 0, 1, 1});
  for (double u = 0.005; u < 1; u += 0.01) EXPECT_GT(gap.value(gap.sample(u, 0.5)), 0);
  EXPECT_NEAR(gap.sample(0.75, 0.5), 2.5, 1e-15);
  EXPECT_DOUBLE_EQ(GateShape::boxcar(0.8).sample(0.25, 0.5), -0.2);
}

}  // namespace
}  // namespace isochron
