// Bins with a response: the convolution, its derivative and what is drawn from them; which way time runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "core/base/error.h"
#include "core/gates/gate.h"
#include "tests/gates/quadrature.h"
#include "tests/seed.h"

namespace isochron {
namespace {

using Table = std::vector<double>;

/// The table as a density, by a plain search.
double response_at(const Table& offsets, const Table& values, double x) {
  double area = 0, value = 0;
  for (std::size_t i = 0; i + 1 < offsets.size(); ++i) {
    const double a = offsets[i], b = offsets[i + 1];
    area += 0.5 * (b - a) * (values[i] + values[i + 1]);
    if (x >= a && x < b) value = values[i] + (values[i + 1] - values[i]) * (x - a) / (b - a);
  }
  return value / area;
}

/// The reading under the bin [begin, end] of light of length l, as defined.
double reading(const Table& offsets, const Table& values, double begin, double end, double l) {
  constexpr int kSteps = 20000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i)
    sum += response_at(offsets, values, begin + (i + 0.5) / kSteps * (end - begin) - l) / kSteps;
  return sum;
}

GateSet contiguous(const GateShape& bin, double start, int count) {
  std::vector<double> centers;
  for (int g = 0; g < count; ++g) centers.push_back(start + (g + 0.5) * (bin.end() - bin.begin()));
  return GateSet(bin, centers);
}

struct Response {
  const char* name;
  Table offsets, values;
};
/// Under bins 0.4 wide: steps that fit a whole number of times, that do not, and uneven ones.
const std::vector<Response> kResponses{{"two steps a bin", kResponseOffsets, kResponseValues},
                                       {"a step a bin, not zero at its ends", {-0.4, 0, 0.4, 0.8}, {1, 4, 2, 1}},
                                       {"broken steps", {0.1, 0.25, 0.4, 0.55, 0.7, 0.85}, {0, 3, 2, 1, 0.5, 0.25}},
                                       {"uneven", {0, 0.05, 0.3, 0.35, 1.9}, {0, 4, 3, 1, 0}},
                                       {"jumps", kMeasuredOffsets, kMeasuredValues}};

TEST(Bins, ReadingsAreTheConvolution) {
  for (const Response& r : kResponses) {
    const GateSet set = contiguous(GateShape::bin(0.4, r.offsets, r.values), -0.8, 15);
    for (double l = -3.1; l < 8; l += 0.377) {
      std::map<int, double> got;
      set.for_each_value(l, [&](int g, double w) { got[g] = w; });
      for (int g = 0; g < 15; ++g) {
        const double expected = reading(r.offsets, r.values, -0.8 + 0.4 * g, -0.4 + 0.4 * g, l);
        EXPECT_NEAR(got.contains(g) ? got[g] : 0, expected, 3e-4) << r.name << ", bin " << g << ", length " << l;
      }
    }
  }
}

// The response says how much later than it arrived light is counted.
TEST(Bins, LightIsCountedLater) {
  const GateSet delayed = contiguous(GateShape::bin(1, {2, 2.5}, {1, 1}), 0, 20);
  std::map<int, double> got;
  delayed.for_each_value(5.25, [&](int g, double w) { got[g] = w; });
  EXPECT_NEAR(got[7], 1, 1e-12);  // at 7.25 to 7.75
  for (const auto& [g, w] : got)
    if (g != 7) {
      EXPECT_NEAR(w, 0, 1e-12) << g;
    }
  // On average later by the mean of the response, and mostly after the light has come.
  const GateSet tail = contiguous(GateShape::bin(0.1, {0, 0.2, 2}, {0, 1, 0}), 0, 200);
  double sum = 0, mean = 0, before = 0;
  tail.for_each_value(6, [&](int g, double w) {
    sum += 0.1 * w;
    mean += 0.1 * w * tail.center(g);
    if (tail.center(g) < 6) before += 0.1 * w;
  });
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_NEAR(before, 0, 1e-12);
  EXPECT_NEAR(mean, 6 + (0 + 0.2 + 2) / 3.0, 1e-3);
}

// Whatever its length, light is counted once: readings per length, times the bins' width.
TEST(Bins, CountEveryLengthOnce) {
  for (const Response& r : kResponses) {
    const GateSet set = contiguous(GateShape::bin(0.4, r.offsets, r.values), 0, 60);
    for (double l = 3; l < 20; l += 0.0917) {
      double sum = 0, slopes = 0;
      set.for_each_derivative(l, [&](int, double w, double slope) {
        sum += 0.4 * w;
        slopes += slope;
      });
      EXPECT_NEAR(sum, 1, 1e-12) << r.name << ' ' << l;
      EXPECT_NEAR(slopes, 0, 1e-11) << r.name << ' ' << l;
    }
  }
}

// Neighbours take the response's values from each other; each must have those of its own shape.
TEST(Bins, ContiguousOrNotTheSameGates) {
  std::mt19937 generator(test_seed(3));
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const Response& r : kResponses)
    for (const double width : {0.4, 0.37, 3.2, 0.1 * std::sqrt(2.0), 0.025}) {
      const GateShape bin = GateShape::bin(width, r.offsets, r.values);
      std::vector<double> gaps;
      for (int g = 0; g < 30; ++g) gaps.push_back(-2 + (1.5 * g + 0.5) * width);
      for (const GateSet& set : {contiguous(bin, -2, 30), GateSet(bin, gaps)})
        for (int k = 0; k < 500; ++k) {
          const double l = set.lower() - 1 + uniform(generator) * (set.upper() - set.lower() + 2);
          int calls = 0;
          set.for_each_derivative(l, [&](int g, double w, double slope) {
            const auto expected = bin.value_and_derivative(l - set.center(g));
            EXPECT_NEAR(w, expected.value, 1e-12) << r.name << ' ' << l;
            EXPECT_NEAR(slope, expected.derivative, 1e-10) << r.name << ' ' << l;
            ++calls;
          });
          int expected_calls = 0;
          for (int g = 0; g < set.size(); ++g) {
            const double x = l - set.center(g);
            expected_calls += x >= bin.lower() && x <= bin.upper();
          }
          EXPECT_EQ(calls, expected_calls);
        }
    }
}

TEST(Bins, DerivativeIsTheSlope) {
  for (const Response& r : kResponses) {
    const GateShape bin = GateShape::bin(0.4, r.offsets, r.values);
    constexpr double kStep = 1e-5;
    for (double x = bin.lower() - 0.1003; x < bin.upper() + 0.1; x += 0.0237) {
      const double slope = (bin.value(x + kStep) - bin.value(x - kStep)) / (2 * kStep);
      EXPECT_NEAR(bin.derivative(x), slope, 1e-6) << r.name << ' ' << x;
    }
  }
}

TEST(Bins, LengthsFollowTheGate) {
  std::mt19937_64 generator(test_seed(8));
  std::uniform_real_distribution<double> uniform(0, 1);
  constexpr int kCells = 40, kDraws = 200000;
  for (const Response& r : kResponses) {
    const GateShape bin = GateShape::bin(0.4, r.offsets, r.values);
    const double cell = (bin.upper() - bin.lower()) / kCells;
    std::vector<double> counts(kCells), below(kCells + 1);
    for (int i = 0; i < kDraws; ++i) {
      const double u = uniform(generator), v = uniform(generator);
      const double place = (bin.sample(u, v) - bin.lower()) / cell;
      ASSERT_TRUE(place >= -1e-12 && place <= kCells + 1e-12);
      counts[std::clamp(static_cast<int>(place), 0, kCells - 1)] += 1;
    }
    for (int i = 1; i <= kCells; ++i)
      below[i] = integrate(
          bin, [&](double x) { return bin.value(x); }, bin.lower() + i * cell);
    double chi_square = 0;
    int degrees = -1;
    for (int i = 0; i < kCells; ++i) {
      const double expected = kDraws * (below[i + 1] - below[i]);
      if (expected < 10) continue;
      chi_square += (counts[i] - expected) * (counts[i] - expected) / expected;
      ++degrees;
    }
    EXPECT_LT(chi_square, degrees + 4 * std::sqrt(2.0 * degrees)) << r.name;
  }
}

// Both sides of a pair are delayed alike; one belongs to the begin of the bin, where the reading rises with the length, one to
// its end. (That the pairs' means are integrals of dW is checked for all kinds in sampling_test.cpp.)
TEST(Bins, PairsShareTheDelay) {
  const GateShape bin = GateShape::bin(0.4, kResponseOffsets, kResponseValues);
  EXPECT_NEAR(bin.pair_mass(PairPart::smooth), 2.5, 1e-15);
  EXPECT_EQ(bin.pair_mass(PairPart::dirac), 0);
  double last = 1e9;
  for (const double u : {1e-9, 0.1, 0.5, 0.9, 1 - 1e-9}) {
    const CoupledPair pair = bin.sample_pair(PairPart::smooth, u);
    EXPECT_TRUE(pair.has_plus && pair.has_minus && !pair.plus_is_jump && !pair.minus_is_jump);
    EXPECT_NEAR(pair.minus - pair.plus, 0.4, 1e-15);
    EXPECT_LT(pair.plus, last);
    EXPECT_LE(pair.plus, -0.2);
    EXPECT_GE(pair.plus, -0.2 - 1.6);
    last = pair.plus;
  }
}

TEST(Bins, SupportLeavesOutZerosOfTheResponse) {
  const GateShape bin = GateShape::bin(1, {-3, -2, -1, 0, 1, 2, 3}, {0, 0, 0, 1, 0, 0, 0});
  EXPECT_NEAR(bin.lower(), -0.5 - 1, 1e-15);
  EXPECT_NEAR(bin.upper(), 0.5 + 1, 1e-15);
  EXPECT_NEAR(bin.value(0), 0.75, 1e-15);
  EXPECT_NEAR(bin.width(), std::sqrt(1 / 12.0 + 1 / 6.0), 1e-15);
  EXPECT_NEAR(bin.detail(), std::sqrt(1 / 12.0), 1e-15);
}

TEST(Bins, RejectsWhatIsNoResponse) {
  EXPECT_THROW(GateShape::bin(0, {0, 1}, {1, 1}), InputError);
  EXPECT_THROW(GateShape::bin(1, {}, {}), InputError);
  EXPECT_THROW(GateShape::bin(1, {0, 1}, {0, 0}), InputError);
  EXPECT_THROW(GateShape::bin(1, {0, 1, 2}, {1, 1}), InputError);
  try {
    GateShape::bin(1, {0, 1, 2}, {1, -1, 1});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "row 2 of the response: negative value");
  }
}

TEST(Modulated, IsACosineOfEitherSign) {
  const GateShape gate = GateShape::modulated(2.5);
  EXPECT_TRUE(gate.is_unbounded());
  EXPECT_FALSE(gate.is_steady());
  EXPECT_EQ(gate.pair_mass(PairPart::smooth), 0);
  EXPECT_EQ(gate.pair_mass(PairPart::dirac), 0);
  EXPECT_EQ(gate.detail(), 0.4);
  const GateSet set(gate, {0, 0.5 * kPi / 2.5, kPi / 2.5});  // phases of 0, 90 and 180 degrees
  EXPECT_EQ(set.lower(), 0);
  EXPECT_EQ(set.upper(), std::numeric_limits<double>::infinity());
  EXPECT_EQ(set.relative_width(), std::numeric_limits<double>::infinity());
  EXPECT_EQ(set.relative_coverage(), std::numeric_limits<double>::infinity());
  for (const double l : {0.0, 0.3, 17.0}) {
    std::map<int, std::pair<double, double>> got;
    set.for_each_derivative(l, [&](int g, double w, double slope) { got[g] = {w, slope}; });
    ASSERT_EQ(got.size(), 3u);
    for (int g = 0; g < 3; ++g) {
      EXPECT_NEAR(got[g].first, std::cos(2.5 * l - g * kPi / 2), 1e-13);
      EXPECT_NEAR(got[g].second, -2.5 * std::sin(2.5 * l - g * kPi / 2), 1e-12);
    }
  }
  EXPECT_THROW(GateShape::modulated(0), InputError);
}

// Light that is counted later by t: readings W(l + t).
TEST(GateSet, ShiftedMovesCentres) {
  auto gates = finite_gates();
  gates.emplace_back("modulated", GateShape::modulated(3));
  for (const auto& [name, gate] : gates) {
    const GateSet set(gate, {4, 3.1, 5}), moved = set.shifted(-0.75);
    EXPECT_EQ(moved.center(1), 3.1 - 0.75);
    for (double l = 0.013; l < 8; l += 0.11) {
      std::map<int, double> expected;
      set.for_each_value(l + 0.75, [&](int g, double w) { expected[g] = w; });
      int calls = 0;
      moved.for_each_value(l, [&](int g, double w) {
        EXPECT_NEAR(w, expected.contains(g) ? expected[g] : 0, 1e-11 * (1 + w)) << name << ' ' << l;
        ++calls;
      });
      EXPECT_EQ(calls, static_cast<int>(expected.size())) << name << ' ' << l;
    }
  }
}

// Bins may begin before light does.
TEST(GateSet, RelativeWidthLeavesOutWhatNoLengthReaches) {
  const GateShape box = GateShape::boxcar(1);
  EXPECT_DOUBLE_EQ(GateSet(box, {-2, 4, 6}).relative_width(), 3 * box.width() / 10);
  EXPECT_EQ(GateSet(box, {-2, -1}).relative_width(), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace isochron
