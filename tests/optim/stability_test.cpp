// Labels of the stability map, on synthetic estimators that fail for a known reason. Fixed seeds.
#include "optim/analysis/stability.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/error.h"
#include "core/base/random.h"
#include "tests/optim/gate_spec.h"
#include "tests/optim/tiny_scene.h"
#include "tests/seed.h"

namespace isochron {
namespace {

const double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// `count` vectors about `center`, normal noise of standard deviation `noise` in each component.
Repeats noisy(int count, const std::vector<double>& center, double noise, std::uint32_t number) {
  Rng rng(Stream{91, number, 0}, 0, 0);
  Repeats repeats(count, center);
  for (auto& repeat : repeats)
    for (double& x : repeat)
      x += noise * std::sqrt(-2 * std::log(rng.uniform())) * std::cos(2 * std::numbers::pi * rng.uniform());
  return repeats;
}

Reference reference_of(const std::vector<double>& truth, double noise) {
  Reference reference;
  reference.repeats = noisy(32, truth, noise, 1);
  const WeightedRepeats alone{&reference.repeats, 1};
  reference.norm2 = squared_norm({&alone, 1});
  return reference;
}

TEST(Stability, DirectionByHand) {
  const Reference reference = reference_of({0, 4}, 0);
  const Direction d = direction({{0, 8}, {-4, 0}, {0, 0}, {0, -4}}, reference);
  EXPECT_DOUBLE_EQ(d.positive, 0.25);  // the second is at a right angle
  EXPECT_DOUBLE_EQ(d.zero, 0.25);
  EXPECT_NEAR(d.cosine.value, 0, 1e-15);
  EXPECT_NEAR(d.cosine.standard_error, std::sqrt(0.5 / 3), 1e-15);
}

// Two thirds of 200 estimates that are noise alone point to one side with probability 2e-6. False alarms: 1e-5.
TEST(Stability, ReasonsOfFailure) {
  const Reference reference = reference_of({3, 4}, 0.1);
  ASSERT_TRUE(resolved(reference));
  const auto reason = [&](const Repeats& estimates, double ratio) {
    return failure(direction(estimates, reference), true, ratio);
  };
  const Repeats good = noisy(24, {3, 4}, 0.3, 2);
  EXPECT_EQ(reason(good, 0.1), Failure::none);
  EXPECT_EQ(reason(good, kUnknown), Failure::none);
  EXPECT_EQ(reason(good, 0.9), Failure::descent);
  EXPECT_EQ(reason(noisy(24, {3, 4}, 20, 3), 0.9), Failure::variance);
  EXPECT_EQ(reason(noisy(200, {0, 0}, 20, 8), kUnknown), Failure::variance);
  EXPECT_EQ(reason(noisy(24, {3, 4}, 3, 4), 0.5), Failure::variance);
  EXPECT_EQ(reason(noisy(24, {-3, 4}, 0.3, 5), 0.1),
            Failure::none);  // off by 74 degrees, but on the right side
  EXPECT_EQ(reason(noisy(24, {-3, 4}, 0.3, 5), 0.6), Failure::bias);
  EXPECT_EQ(reason(noisy(24, {-3, -4}, 0.3, 6), 1.5), Failure::bias);
  EXPECT_EQ(reason(Repeats(24, {0, 0}), 1), Failure::no_signal);
  EXPECT_EQ(failure(direction(good, reference), false, 1), Failure::no_signal);
  EXPECT_EQ(failure(direction(noisy(24, {3, 4}, 20, 3), reference), false, 1), Failure::variance);
  // Twice the gradient on average, but far more noise than that.
  EXPECT_EQ(reason(noisy(2000, {6, 8}, 20, 9), 0.9), Failure::variance);
  // A bias of 4 % leaves no mark.
  EXPECT_EQ(reason(noisy(24, {3.2, 4}, 0.1, 7), 0.9), Failure::descent);
}

TEST(Stability, ReferenceThatIsNoiseIsNotResolved) {
  EXPECT_TRUE(resolved(reference_of({3, 4}, 1)));
  EXPECT_FALSE(resolved(reference_of({0, 0}, 1)));
  EXPECT_FALSE(resolved(reference_of({0, 0}, 0)));
}

TEST(Stability, NothingAtAllIsNoSignal) {
  const Direction d = direction(Repeats(24, {0, 0}), reference_of({0, 0}, 0));
  EXPECT_EQ(d.positive, 0);
  EXPECT_EQ(d.cosine.value, 0);
  EXPECT_EQ(d.zero, 1);
  EXPECT_EQ(failure(d, false, 1), Failure::no_signal);
}

TEST(Stability, RotationsAreSteppedInRadians) {
  // Adam's first steps are its rate each, in units of the parameter's scale, as long as the gradient keeps its sign; noise makes
  // them shorter. In degrees instead, the error would stay at 0.99 of what it was. No seed of nine fails.
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const double before = 20, rate = 0.05;
  const int iterations = 4;
  std::string text =
      replaced(tiny_experiment(),
               "{name: height, type: translation, shape: block, direction: [0, 1, 0], initial: 0.2, target: 0}",
               "{name: tilt, type: rotation, shape: block, axis: [1, 0, 0], pivot: center, initial: 20, target: 0}");
  text = replaced(text, "  - {name: power, type: emission, shape: lamp, initial: 8, target: 10}\n", "");
  text = replaced(text, "learning_rate: 0.02, iterations: 6", "learning_rate: 0.05, iterations: 4");
  text = replaced(text, "seed: 3\n", "seed: " + std::to_string(test_seed(3)) + "\n");
  folder.write("tilt.yaml", text);
  StabilityOptions options;
  options.widths = {0.2};
  options.core_seconds = 2;
  options.iterations = iterations;
  options.progress = [](const std::string&) {};
  const Stability map = map_stability(load_experiment(folder.file("tilt.yaml")), options);
  ASSERT_FALSE(map.cells.empty());
  const double full = 1 - rate * 180 / std::numbers::pi * iterations / before;
  for (const StabilityCell& cell : map.cells) {
    EXPECT_NEAR(cell.error_ratio, full, 0.2) << cell.method;
    EXPECT_GE(cell.direction.positive, kWorksPositive) << cell.method;
    EXPECT_GT(cell.direction.cosine.value, 0.5) << cell.method;
    EXPECT_LT(cell.direction.zero, 0.5) << cell.method;
  }
}

TEST(Stability, GatesOfAnotherWidth) {
  GateSpec gates = gate_spec("{kind: truncated_gaussian, centers: [4, 6], sigma: 0.3, half_width: 0.4}");
  const GateSpec narrow = with_relative_width(gates, 0.001);
  EXPECT_NEAR(make_gates(narrow).relative_width(), 0.001, 1e-12);
  const GateShape before = make_gates(gates).shape(), after = make_gates(narrow).shape();
  EXPECT_NEAR(after.mass(), before.mass(), 1e-12) << "as much is cut off";
  EXPECT_EQ(narrow.centers, gates.centers);
  gates = gate_spec("{kind: tabulated, centers: [5], offsets: [-1, 0, 2], values: [0, 1, 0]}");
  EXPECT_NEAR(make_gates(with_relative_width(gates, 0.02)).relative_width(), 0.02, 1e-12);
  gates = gate_spec("{kind: steady}");
  EXPECT_THROW(with_relative_width(gates, 0.1), InputError);
}

}  // namespace
}  // namespace isochron
