// How many samples steps of adam take.
#include "optim/solvers/sample_share.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/seed.h"

namespace isochron {
namespace {

/// A signal that stays, of 1 for each unknown, and normal noise of that variance where all samples are taken.
class Gradients {
 public:
  Gradients(int unknowns, double variance, unsigned seed) : gradient_(unknowns), variance_(variance), random_(seed) {}
  const std::vector<double>& of(int parts, double signal = 1) {
    std::normal_distribution<double> noise(0, std::sqrt(parts * variance_));
    for (double& g : gradient_) g = signal + noise(random_);
    return gradient_;
  }

 private:
  std::vector<double> gradient_;
  double variance_;
  std::mt19937 random_;
};

TEST(SampleShare, LeavesOutPartsWhileGradientsAgree) {
  SampleShare share(8);
  Gradients exact(3, 0, 1);
  for (int i = 0; i < 9; ++i) share.observe(exact.of(1));
  EXPECT_EQ(share.parts(), 1) << "of too few";
  share.observe(exact.of(1));
  EXPECT_EQ(share.parts(), 8);
  for (int i = 0; i < 40; ++i) share.observe(exact.of(8, i % 2 == 0 ? 1 : -1));
  EXPECT_EQ(share.parts(), 1) << "they turn";
}

/// A variance of 1/12 stays below a quarter with two parts, and not with four. 300 unknowns know that to some percent over ten gradients: of 300 seeds
/// all choose two.
TEST(SampleShare, KeepsNoiseBelowAQuarter) {
  SampleShare share(8);
  Gradients noisy(300, 1 / 12.0, test_seed(7));
  for (int i = 0; i < 100; ++i) share.observe(noisy.of(share.parts()));
  EXPECT_EQ(share.parts(), 2);
}

/// Of 2000 runs of one unknown without a signal, each of 100 gradients, none left out samples: a rate of more than 0.0015 is excluded with 95 %,
/// and then 5 of 1000 are exceeded with probability 0.004.
TEST(SampleShare, TakesAllSamplesOfNoise) {
  int fooled = 0;
  for (unsigned run = 0; run < 1000; ++run) {
    SampleShare share(8);
    Gradients noise(1, 1, test_seed(11) + run);
    bool left_out = false;
    for (int i = 0; i < 100; ++i) {
      share.observe(noise.of(1, 0));
      left_out = left_out || share.parts() > 1;
    }
    fooled += left_out;
  }
  EXPECT_LE(fooled, 5);
}

TEST(SampleShare, GoesOnFromItsState) {
  Gradients noisy(2, 0.1, test_seed(3));
  SampleShare first(8);
  for (int i = 0; i < 13; ++i) first.observe(noisy.of(first.parts()));
  SampleShare second(8);
  second.restore(first.state());
  for (int i = 0; i < 30; ++i) {
    const std::vector<double> gradient = noisy.of(first.parts());
    first.observe(gradient);
    second.observe(gradient);
    EXPECT_EQ(first.parts(), second.parts());
  }
}

}  // namespace
}  // namespace isochron
