// What `render` and `derive` report: that few replicates keep the gain of low-discrepancy numbers, that the reported errors
// are those that repeats with other seeds have, and that tables say where gates are. Seeds are fixed; statistical limits
// are at 4.5 standard deviations.
#include "optim/problem/estimates.h"

#include <gtest/gtest.h>

#include <cmath>

#include "optim/problem/gate_columns.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

class Estimates : public testing::Test {
 protected:
  Estimates() {
    write_tiny_scene(folder_);
    file_ = folder_.write("tiny.yaml", tiny_experiment());
  }
  Problem problem(int seed, const std::string& more = "name=tiny") const {
    return Problem(load_experiment(file_, {"seed=" + std::to_string(seed), more}));
  }
  TemporaryFolder folder_;
  std::string file_;
};

/// Sum over pixels of the variance between images.
double pixel_variance(const std::vector<GatedImage>& images) {
  double sum = 0;
  const double n = static_cast<double>(images.size());
  for (std::size_t i = 0; i < images[0].data.size(); ++i) {
    double mean = 0;
    for (const GatedImage& image : images) mean += image.data[i] / n;
    for (const GatedImage& image : images) sum += (image.data[i] - mean) * (image.data[i] - mean) / (n - 1);
  }
  return sum;
}

TEST_F(Estimates, FewReplicatesKeepTheGainOfLowDiscrepancy) {
  std::vector<GatedImage> ours, batches;
  for (int seed = 1; seed <= 24; ++seed) {
    const Problem tiny = problem(seed, "samples.primal=64");
    const std::vector<double> theta = tiny.parameters().initial();
    ours.push_back(estimate_image(tiny, theta).image.to_gated());
    ImageStatistics of_pairs(true);  // 32 pairs of samples, as it was
    for (int b = 0; b < 32; ++b) of_pairs.add(tiny.render(theta, tiny.stream(Pass::primal), {2 * b, 2 * b + 2}), 2);
    batches.push_back(of_pairs.mean());
  }
  // Seen: 0.47.
  EXPECT_LT(pixel_variance(ours), 0.75 * pixel_variance(batches));
}

// An image that is rendered to be another run's target has noise of its own: with that of the run's first iteration the loss
// there would be minus the variance of the noise; else it is plus that of the target, half of what is summed here.
TEST_F(Estimates, ImagesAreTargetsOfRunsWithTheSameSeed) {
  const Problem tiny = problem(1);
  const std::vector<double> theta = tiny.parameters().initial();
  const GatedImage target = estimate_image(tiny, theta).image.to_gated();
  const Evaluation at = tiny.evaluate(theta, target, 0);
  double variance = 0;
  for (std::size_t i = 0; i < target.data.size(); ++i)
    variance += (at.image.data[i] - target.data[i]) * (at.image.data[i] - target.data[i]) / target.data.size();
  EXPECT_GT(at.loss, 0.1 * variance);
}

TEST_F(Estimates, ReportedErrorsAreThoseOfRepeats) {
  constexpr int kSeeds = 200;
  const double limit = 4.5 * std::sqrt(2.0 / kSeeds);
  for (const char* sampling : {"estimator.sampling=standard", "estimator.sampling=ellipsoidal"}) {
    // [image, interior][gate]
    double mean[2][2] = {}, square[2][2] = {}, reported[2][2] = {};
    for (int seed = 1; seed <= kSeeds; ++seed) {
      const Problem tiny = problem(seed, sampling);
      const std::vector<double> theta = tiny.parameters().initial();
      const Statistics image = estimate_image(tiny, theta).gates;
      const auto derivatives = estimate_derivatives(tiny, theta, 1, 1);  // by the lamp's power
      ASSERT_EQ(derivatives[1].component, "interior");
      int i = 0;
      for (const Statistics* s : {&image, &derivatives[1].gates[0]}) {
        for (int g = 0; g < 2; ++g) {
          mean[i][g] += s->mean[g] / kSeeds;
          square[i][g] += s->mean[g] * s->mean[g] / kSeeds;
          reported[i][g] += s->standard_error[g] * s->standard_error[g] / kSeeds;
        }
        ++i;
      }
    }
    for (int i = 0; i < 2; ++i)
      for (int g = 0; g < 2; ++g) {
        const double variance = (square[i][g] - mean[i][g] * mean[i][g]) * kSeeds / (kSeeds - 1);
        EXPECT_NEAR(reported[i][g] / variance, 1, limit * reported[i][g] / variance + 0.05)
            << sampling << (i ? " interior" : " image") << ", gate " << g;
      }
  }
}

TEST_F(Estimates, TablesSayWhereGatesAre) {
  const Problem lengths = problem(1), steady = problem(1, "gates={kind: steady}"),
                times = problem(1, "gates={kind: gaussian, centers: [10, 12.5], sigma: 1, unit: ns, scene_unit_m: 2}");
  EXPECT_EQ(gate_column_names(lengths.experiment().gates), ",gate_center");
  EXPECT_EQ(gate_column_values(lengths, 1), ",5.5");
  EXPECT_EQ(gate_label(lengths, 1), "5.5");
  EXPECT_EQ(gate_column_values(steady, 0), ",nan");
  EXPECT_EQ(gate_column_names(times.experiment().gates), ",gate_center,gate_center_ns");
  // 12.5 ns of light are 3.7474 m.
  EXPECT_EQ(gate_column_values(times, 1).substr(0, 6), ",1.873");
  EXPECT_EQ(gate_column_values(times, 1).substr(gate_column_values(times, 1).rfind(',')), ",12.5");
  EXPECT_EQ(gate_label(times, 1), "12.5 ns");
}

}  // namespace
}  // namespace isochron
