// Targets: photon noise against the Poisson law, and what is wrong with a file of measured images.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "optim/problem/photon_noise.h"
#include "optim/problem/problem.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

TEST(PhotonNoise, CountsFollowThePoissonLaw) {
  constexpr int kDraws = 200000;
  for (double mean : {0.02, 0.7, 5.0, 9.99, 10.01, 40.0, 3000.0}) {
    // Cells of about 1/20 of the mass each, from the running sums of exp(-m) m^k / k!.
    const double sigma = std::sqrt(mean);
    const int first = std::max(0, static_cast<int>(mean - 9 * sigma)), last = static_cast<int>(mean + 9 * sigma) + 20;
    std::vector<int> cell_of(last + 1);
    std::vector<double> expected(1, 0.0);
    for (int k = first; k <= last; ++k) {
      if (expected.back() > 0.05) expected.push_back(0);
      expected.back() += std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0));
      cell_of[k] = static_cast<int>(expected.size()) - 1;
    }
    if (expected.back() * kDraws < 10 && expected.size() > 1) {
      expected[expected.size() - 2] += expected.back();
      expected.pop_back();
    }
    std::vector<int> seen(expected.size(), 0);
    for (int i = 0; i < kDraws; ++i) {
      Rng rng({11, 0, 6}, static_cast<std::uint64_t>(i), 0);
      const double count = poisson(mean, rng);
      ASSERT_EQ(count, std::floor(count));
      ASSERT_GE(count, 0);
      ASSERT_LE(count, last);
      ++seen[std::min(cell_of[static_cast<int>(count)], static_cast<int>(seen.size()) - 1)];
    }
    double chi_square = 0;
    for (std::size_t c = 0; c < seen.size(); ++c) {
      const double difference = seen[c] - kDraws * expected[c];
      chi_square += difference * difference / (kDraws * expected[c]);
    }
    // Wilson and Hilferty: normal to good accuracy. Above 4 by chance: 3e-5 each, seed fixed.
    const double n = std::max<double>(1, static_cast<double>(seen.size()) - 1), spread = 2 / (9 * n);
    EXPECT_LT((std::cbrt(chi_square / n) - (1 - spread)) / std::sqrt(spread), 4) << "mean " << mean;
  }
}

TEST(PhotonNoise, CountsThePhotonsOfTheBrightestGate) {
  GatedImage image(40, 50, 2, 1);
  for (int p = 0; p < image.pixels(); ++p) {
    image.at(p, 0) = 1e-7 * (p % 4 + 1);  // mean 2.5e-7
    image.at(p, 1) = 1e-8;
  }
  image.at(0, 1) = 0;
  const GatedImage clean = image;
  GatedImage again = image;
  add_photon_noise(image, 25, {7, 0, 6});
  add_photon_noise(again, 25, {7, 0, 6});
  EXPECT_EQ(image.data, again.data);
  EXPECT_EQ(image.at(0, 1), 0);
  const double unit = 2.5e-7 / 25;
  double sum = 0, squares = 0;
  for (int p = 0; p < image.pixels(); ++p) {
    const double count = image.at(p, 0) / unit, mean = clean.at(p, 0) / unit;
    EXPECT_NEAR(count, std::round(count), 1e-9);
    sum += (count - mean) / std::sqrt(mean);
    squares += (count - mean) * (count - mean) / mean;
  }
  // 2000 entries: standard deviations 1 / sqrt(2000) and about sqrt(2 / 2000). Above 4 of them: 6e-5 each.
  EXPECT_NEAR(sum / 2000, 0, 4 / std::sqrt(2000.0));
  EXPECT_NEAR(squares / 2000, 1, 4 * std::sqrt((2 + 1 / 10.0) / 2000));
  add_photon_noise(again, 25, {8, 0, 6});
  EXPECT_NE(image.data, again.data);
  GatedImage black(2, 2, 1, 3);
  add_photon_noise(black, 1, {7, 0, 6});
  EXPECT_EQ(black.data, std::vector<double>(12, 0.0));
}

TEST(Target, NoiseComesOnTopOfTheRenderedImages) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const std::string file = folder.write("tiny.yaml", tiny_experiment());
  const GatedImage clean = Problem(load_experiment(file)).make_target();
  GatedImage expected = clean;
  add_photon_noise(expected, 50, {7, 0, 6});
  const Problem noisy(load_experiment(file, {"target.noise={photons: 50}"}));
  EXPECT_EQ(noisy.make_target().data, expected.data);
  EXPECT_NE(expected.data, clean.data);
  EXPECT_THROW(load_experiment(file, {"target.noise={photons: 0}"}), InputError);
}

TEST(Target, ErrorNamesTheFirstMismatch) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const Problem problem(load_experiment(folder.write("tiny.yaml", tiny_experiment())));
  const struct {
    GatedImage image;
    const char* message;
  } cases[] = {
      {GatedImage(8, 9, 1, 3), "8 x 9 pixels in the target images (the experiment has 8 x 8)"},
      {GatedImage(8, 8, 3, 3), "3 gates in the target images (the experiment has 2)"},
      {GatedImage(8, 8, 2, 3),
       "three channels (R, G, B) in the target images (the experiment has one grey channel, Y)"},
  };
  const std::string file = folder.file("measured.exr");
  for (const auto& c : cases) {
    write_exr(file, c.image);
    try {
      problem.read_target(file);
      ADD_FAILURE() << "accepted: " << c.message;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()), file + ": " + c.message);
    }
  }
}

}  // namespace
}  // namespace isochron
