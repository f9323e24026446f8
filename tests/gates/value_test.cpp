// Gate values, masses, widths, supports and densities against closed forms and quadrature.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "core/base/error.h"
#include "core/gates/gate.h"
#include "tests/gates/quadrature.h"
#include "tests/seed.h"

namespace isochron {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

long double normal_density(long double x, long double sigma) {
  return std::exp(-0.5L * (x / sigma) * (x / sigma)) / (sigma * std::sqrt(2 * 3.14159265358979323846264338327950288L));
}

TEST(FastExp2, MatchesLibrary) {
  double worst = 0;
  for (int i = 0; i <= 200000; ++i) {
    const double y = -54.0 * i / 200000;
    worst = std::max(worst, std::abs(static_cast<double>(fast_exp2(y) / std::exp2(static_cast<long double>(y)) - 1)));
  }
  EXPECT_LT(worst, 1e-14);
  EXPECT_EQ(fast_exp2(0), 1);
  EXPECT_EQ(fast_exp2(-3), 0.125);
  EXPECT_NEAR(fast_exp2(-1000.5) / std::exp2(-1000.5), 1, 1e-14);
}

// P(x) recovered by the library's erfc, to a few ulp of x times the condition number.
TEST(NormalQuantile, InvertsTheDistribution) {
  for (double p = 1e-17; p < 0.5; p *= 1.1) {
    const long double x = normal_quantile_lower(p, p - 0.5);
    const long double density = normal_density(x, 1), got = 0.5L * std::erfc(-x * std::sqrt(0.5L));
    EXPECT_NEAR(static_cast<double>((got - p) / density), 0, 2e-15 * static_cast<double>(1 + std::abs(x))) << p;
  }
  // Near the median `from_half` alone carries the digits: x = sqrt(2 pi) (P - 1/2).
  EXPECT_NEAR(normal_quantile_lower(0.5, -1e-20) / (-1e-20 * std::sqrt(kTwoPi)), 1, 1e-15);
}

TEST(GateShape, GaussianValues) {
  for (const double sigma : {1e-12, 0.3, 1e12}) {
    const GateShape gate = GateShape::gaussian(sigma);
    for (double x = -8.5; x <= 8.5; x += 0.01) {
      const double expected = static_cast<double>(normal_density(x * sigma, sigma));
      EXPECT_NEAR(gate.value(x * sigma) / expected, 1, 1e-13);
      EXPECT_NEAR(gate.derivative(x * sigma), -x / sigma * expected, 1e-13 * std::abs(x / sigma * expected));
    }
    EXPECT_EQ(gate.width(), sigma);
    EXPECT_EQ(gate.mass(), 1);
    EXPECT_NEAR(gate.value(gate.upper()) / gate.value(0), 0x1p-53, 1e-3 * 0x1p-53);
    EXPECT_EQ(gate.lower(), -gate.upper());
    EXPECT_EQ(gate.value(1.0001 * gate.upper()), 0);
    EXPECT_EQ(gate.derivative(-1.0001 * gate.upper()), 0);
  }
}

TEST(GateShape, TruncatedGaussianIsTheGaussianInside) {
  const GateShape whole = GateShape::gaussian(0.3), cut = GateShape::truncated_gaussian(0.3, 0.4);
  for (const double x : {-0.399, -0.1, 0.0, 0.25, 0.4}) {
    EXPECT_EQ(cut.value(x), whole.value(x));
    EXPECT_EQ(cut.derivative(x), whole.derivative(x));
  }
  EXPECT_EQ(cut.value(0.4001), 0);
  EXPECT_EQ(cut.value(-0.4001), 0);
  EXPECT_EQ(cut.lower(), -0.4);
  EXPECT_EQ(cut.upper(), 0.4);
}

TEST(GateShape, BoxcarAndSteadyValues) {
  const GateShape box = GateShape::boxcar(0.5);
  EXPECT_EQ(box.value(0.2), 2);
  EXPECT_EQ(box.value(-0.2), 2);
  EXPECT_EQ(box.value(0.26), 0);
  EXPECT_EQ(box.derivative(0.1), 0);
  EXPECT_DOUBLE_EQ(box.width(), 0.5 / std::sqrt(12.0));
  const GateShape steady = GateShape::steady();
  EXPECT_TRUE(steady.is_steady());
  EXPECT_EQ(steady.value(-1e300), 1);
  EXPECT_EQ(steady.value(7), 1);
  EXPECT_EQ(steady.derivative(7), 0);
  EXPECT_EQ(steady.width(), kInfinity);
  EXPECT_EQ(steady.lower(), -kInfinity);
}

// Knots (0,1) (1,3) jump to 2, (3,0): area 2 + 2 = 4.
TEST(GateShape, TabulatedValues) {
  const GateShape gate = GateShape::tabulated({0, 1, 1, 3}, {1, 3, 2, 0});
  EXPECT_DOUBLE_EQ(gate.value(0), 0.25);
  EXPECT_DOUBLE_EQ(gate.value(0.5), 0.5);
  EXPECT_DOUBLE_EQ(gate.value(1), 0.5);  // from the right
  EXPECT_DOUBLE_EQ(gate.value(2), 0.25);
  EXPECT_DOUBLE_EQ(gate.value(3), 0);
  EXPECT_EQ(gate.value(-0.001), 0);
  EXPECT_EQ(gate.value(3.001), 0);
  EXPECT_DOUBLE_EQ(gate.derivative(0.5), 0.5);
  EXPECT_DOUBLE_EQ(gate.derivative(2.5), -0.25);
  EXPECT_EQ(gate.lower(), 0);
  EXPECT_EQ(gate.upper(), 3);
  // First moments 7/6 (x (1 + 2x) on [0, 1]) and 10/3 (x (3 - x) on [1, 3]), second 5/6 and 6, over the
  // area 4.
  const double mean = (7.0 / 6 + 10.0 / 3) / 4, square = (5.0 / 6 + 6) / 4;
  EXPECT_NEAR(gate.width(), std::sqrt(square - mean * mean), 1e-14);
}

// Unevenly spaced knots, many per bucket and many buckets per knot, against a linear search.
TEST(GateShape, TabulatedLookupFindsTheInterval) {
  std::mt19937 generator(test_seed(5));
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> offsets{-3}, values{0.1};
  for (int i = 0; i < 300; ++i) {
    if (i % 17 != 0)
      offsets.push_back(offsets.back() + std::pow(10.0, -6 * uniform(generator)));
    else
      offsets.push_back(offsets.back());
    values.push_back(uniform(generator));
  }
  const GateShape gate = GateShape::tabulated(offsets, values);
  double area = 0;
  for (std::size_t i = 0; i + 1 < offsets.size(); ++i) {
    area += 0.5 * (values[i] + values[i + 1]) * (offsets[i + 1] - offsets[i]);
  }
  for (std::size_t i = 0; i + 1 < offsets.size(); ++i) {
    const double a = offsets[i], b = offsets[i + 1];
    if (a == b) continue;
    for (const double f : {1e-3, 0.3, 0.999}) {
      EXPECT_NEAR(gate.value(a + f * (b - a)) * area, (1 - f) * values[i] + f * values[i + 1], 1e-8);
      EXPECT_NEAR(gate.derivative(a + f * (b - a)) * area * (b - a), values[i + 1] - values[i], 1e-8);
    }
  }
}

TEST(GateShape, ValueIntegratesToMassAndWidth) {
  for (const auto& [name, gate] : finite_gates()) {
    const double scale = gate.upper() - gate.lower();
    const double mass = integrate(gate, [&](double x) { return gate.value(x); });
    EXPECT_NEAR(mass, gate.mass(), 1e-12) << name;
    const double mean = integrate(gate, [&](double x) { return x * gate.value(x); }) / mass;
    const double variance = integrate(gate, [&](double x) { return (x - mean) * (x - mean) * gate.value(x); }) / mass;
    EXPECT_NEAR(gate.width() / std::sqrt(variance), 1, 1e-10) << name;
    EXPECT_LT(gate.width(), scale) << name;
  }
  EXPECT_NEAR(GateShape::truncated_gaussian(1, 1).mass(), 0.682689492137086, 1e-15);
}

TEST(GateShape, ScalesExactly) {
  for (const double s : {1e-12, 1e12}) {
    const auto expect_scaled = [s](const GateShape& one, const GateShape& big) {
      EXPECT_NEAR(big.mass(), one.mass(), 1e-14);
      EXPECT_NEAR(big.width() / (s * one.width()), 1, 1e-14);
      for (const double u : {1e-9, 0.1, 0.5, 0.77, 1 - 1e-9}) {
        const double x = one.sample(u, 0.5);
        EXPECT_NEAR(big.sample(u, 0.5) / s, x, 1e-13 * one.upper());
        EXPECT_NEAR(big.value(s * x) * s, one.value(x), 1e-12 * one.value(0.1));
        EXPECT_NEAR(big.derivative(s * x) * s * s, one.derivative(x), 1e-12 * one.value(0.1));
      }
      for (const PairPart part : {PairPart::smooth, PairPart::dirac}) {
        EXPECT_NEAR(big.pair_mass(part) * s, one.pair_mass(part), 1e-13);
        if (one.pair_mass(part) > 0) {
          EXPECT_NEAR(big.sample_pair(part, 0.3).plus / s, one.sample_pair(part, 0.3).plus, 1e-13);
        }
      }
    };
    expect_scaled(GateShape::gaussian(0.7), GateShape::gaussian(0.7 * s));
    expect_scaled(GateShape::boxcar(0.7), GateShape::boxcar(0.7 * s));
    expect_scaled(GateShape::truncated_gaussian(0.7, 0.9), GateShape::truncated_gaussian(0.7 * s, 0.9 * s));
    expect_scaled(GateShape::tabulated({-1, 0, 0, 2}, {1, 4, 3, 0.5}),
                  GateShape::tabulated({-s, 0, 0, 2 * s}, {1, 4, 3, 0.5}));
  }
}

TEST(GateShape, RejectsWhatIsNoGate) {
  const double nan = std::nan("");
  for (const double bad : {0.0, -1.0, nan, kInfinity}) {
    EXPECT_THROW(GateShape::gaussian(bad), InputError);
    EXPECT_THROW(GateShape::boxcar(bad), InputError);
    EXPECT_THROW(GateShape::truncated_gaussian(bad, 1), InputError);
    EXPECT_THROW(GateShape::truncated_gaussian(1, bad), InputError);
  }
  EXPECT_THROW(GateShape::tabulated({}, {}), InputError);
  EXPECT_THROW(GateShape::tabulated({0}, {1}), InputError);
  EXPECT_THROW(GateShape::tabulated({0, 0}, {1, 1}), InputError);
  EXPECT_THROW(GateShape::tabulated({0, 1}, {1}), InputError);
  EXPECT_THROW(GateShape::tabulated({0, 1, 0.5}, {1, 1, 1}), InputError);
  EXPECT_THROW(GateShape::tabulated({0, 1, 2}, {1, -0.1, 1}), InputError);
  EXPECT_THROW(GateShape::tabulated({0, 1}, {0, 0}), InputError);
  EXPECT_THROW(GateShape::tabulated({0, nan}, {1, 1}), InputError);
  EXPECT_THROW(GateShape::tabulated({0, 1}, {1, kInfinity}), InputError);
  EXPECT_THROW(GateSet(GateShape::steady(), {}), InputError);
  EXPECT_THROW(GateSet(GateShape::steady(), {1, nan}), InputError);
}

TEST(GateShape, SaysWhatIsWrong) {
  try {
    GateShape::tabulated({0, 1, 2}, {1, -0.1, 1});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), testing::AllOf(testing::HasSubstr("row 2"), testing::HasSubstr("negative")));
  }
}

// Unsorted centres of every spacing against a plain loop over all gates.
TEST(GateSet, VisitsExactlyTheGatesThatHoldTheLength) {
  std::mt19937 generator(test_seed(9));
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const auto& [name, gate] : finite_gates()) {
    const double scale = gate.upper() - gate.lower();
    for (const int count : {1, 7, 8, 9, 50}) {
      std::vector<double> centers;
      for (int g = 0; g < count; ++g) centers.push_back(scale * (20 + 5 * uniform(generator)));
      const GateSet set(gate, centers);
      EXPECT_EQ(set.size(), count);
      for (int k = 0; k < 200; ++k) {
        const double l = scale * (19 + 7 * uniform(generator));
        std::map<int, double> values, slopes;
        set.for_each_value(l, [&](int g, double w) { EXPECT_TRUE(values.emplace(g, w).second); });
        set.for_each_derivative(l, [&](int g, double w, double slope) {
          EXPECT_NEAR(w, values.at(g), 1e-13 * w);
          slopes[g] = slope;
        });
        EXPECT_EQ(values.size(), slopes.size());
        for (int g = 0; g < count; ++g) {
          const double x = l - centers[g], w = gate.value(x), slope = gate.derivative(x);
          // Those of bins are differences of two lookups.
          const double rounding = gate.kind() == GateKind::bin ? 1e-12 : 0;
          EXPECT_NEAR(values.count(g) ? values[g] : 0, w, 1e-13 * w + rounding) << name;
          EXPECT_NEAR(slopes.count(g) ? slopes[g] : 0, slope, 1e-13 * std::abs(slope) + rounding) << name;
          EXPECT_EQ(set.center(g), centers[g]);
          if (x < gate.lower() || x > gate.upper()) {
            EXPECT_EQ(values.count(g), 0u);
          }
          if (w > 0) {
            EXPECT_TRUE(l >= set.lower() && l <= set.upper());
          }
        }
      }
    }
  }
}

TEST(GateSet, SteadyKeepsTheNumberOfGates) {
  const GateSet set(GateShape::steady(), {5, 6, 7});
  EXPECT_EQ(set.size(), 3);
  EXPECT_EQ(set.lower(), 0);
  EXPECT_EQ(set.upper(), kInfinity);
  int calls = 0;
  set.for_each_derivative(123, [&](int g, double w, double slope) {
    EXPECT_EQ(g, calls++);
    EXPECT_EQ(w, 1);
    EXPECT_EQ(slope, 0);
  });
  EXPECT_EQ(calls, 3);
}

}  // namespace
}  // namespace isochron
