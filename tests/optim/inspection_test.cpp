// Inspections of scenes whose answers are known.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "optim/analysis/advice.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

class InspectionTest : public testing::Test {
 protected:
  InspectionTest() {
    write_tiny_scene(folder_);
    file_ = folder_.write("tiny.yaml", tiny_experiment());
  }
  Inspection run(const std::vector<std::string>& overrides, double seconds = 1) const {
    const Problem problem(load_experiment(file_, overrides));
    return inspect(problem, problem.parameters().initial(), seconds);
  }
  TemporaryFolder folder_;
  std::string file_;
};

TEST_F(InspectionTest, OpenSceneNeedsOneBounce) {
  // Floor and lamp alone: light that leaves the floor meets nothing but the lamp, which reflects nothing.
  folder_.write("open.yaml",
                "camera: {position: [0.2, 2.5, 2.5], look_at: [0, 0, 0], up: [0, 1, 0], fov: 40, resolution: [8, 8]}\n"
                "materials: {white: {type: diffuse, albedo: 0.6}, black: {type: diffuse, albedo: 0}}\n"
                "shapes:\n"
                "  - {name: floor, file: floor.obj, material: white}\n"
                "  - {name: lamp, file: lamp.obj, material: black, emission: 10}\n");
  const Inspection inspection = run({"scene=open.yaml", "max_bounces=5",
                                     "parameters=[{name: x, type: translation, shape: lamp, direction: [1, "
                                     "0, 0], initial: 0.3, target: 0}]"});
  const ReductionChoice& choice = inspection.advice.reduction;
  EXPECT_EQ(choice.kept.max_bounces, 1);
  ASSERT_EQ(choice.bias.size(), 3u);
  for (const RelativeBias& bias : choice.bias) EXPECT_EQ(bias.value, 0);
  EXPECT_EQ(inspection.advice.after.max_bounces, 1);
  EXPECT_FALSE(inspection.points[0].can_be[2]);  // a gaussian has no jumps
  EXPECT_EQ(inspection.advice.after.samples[3], 0);
  // All light is of one bounce, off the floor, from the lamp.
  const Shares& shares = inspection.points[0].shares;
  EXPECT_NEAR(shares.light.mean[2] + shares.light.mean[3], 1, 1e-12);
  EXPECT_NEAR(shares.light_by_shape.mean[0], 1, 1e-12);
  EXPECT_NEAR(shares.light_by_shape.mean[1], 1, 1e-12);
  const Experiment after = advised(load_experiment(file_, {"max_bounces=5"}), inspection.advice.after);
  EXPECT_EQ(after.target.max_bounces, 5);
}

TEST_F(InspectionTest, StaticGeometryHasNoVisibility) {
  const Inspection inspection =
      run({"parameters=[{name: grey, type: albedo, material: white, initial: 0.3, target: 0.6}]",
           "gates={kind: boxcar, centers: [4.5, 5.5], width: 0.6}", "samples.path_length=16"});
  EXPECT_EQ(inspection.points[0].can_be, (std::array<bool, 3>{true, false, false}));
  EXPECT_EQ(inspection.advice.reduction.kept.terms, (std::array<bool, 3>{true, false, false}));
  EXPECT_EQ(inspection.advice.after.samples[2], 0);
  EXPECT_EQ(inspection.advice.after.samples[3], 0);
  EXPECT_GE(inspection.advice.after.samples[1], 1);
}

TEST_F(InspectionTest, MissingTermComesBack) {
  // The experiment leaves out what its moving block does to visibility.
  const Inspection inspection = run({"samples.visibility=0"}, 4);
  EXPECT_TRUE(inspection.advice.reduction.kept.terms[1]);
  EXPECT_GE(inspection.advice.after.samples[1 + 1], 1);
  EXPECT_EQ(inspection.advice.before.samples[1 + 1], 0);
}

TEST_F(InspectionTest, SharesAddUp) {
  const Inspection inspection = run({"gates={kind: boxcar, centers: [4.5, 5.5], width: 0.6}"});
  ASSERT_EQ(inspection.points.size(), 3u);
  for (const PointInspection& p : inspection.points) {
    const auto sum = [](const Statistics& s) {
      double total = 0;
      for (double share : s.mean) total += share;
      return total;
    };
    EXPECT_NEAR(sum(p.shares.light), 1, 1e-9);
    EXPECT_NEAR(sum(p.shares.by_bounces), 1, 1e-9);
    EXPECT_NEAR(sum(p.shares.by_gate), 1, 1e-9);
    for (int t = 0; t < 3; ++t) EXPECT_TRUE(p.found[t]);
  }
}

// The variance of independent gradients at the experiment's own samples, and what its parts say, at the start. Samples are such
// that image, interior and visibility term each make a quarter or more. Reruns have other seeds for both. 4.5 standard errors,
// by chance 3e-5 (Student's law, 63 degrees of freedom), are less than any of the parts.
TEST_F(InspectionTest, PredictsTheVarianceThatRepeatsHave) {
  constexpr int kReruns = 64, kRepeats = 40;
  ReplicateStatistics reruns;
  for (int rerun = 0; rerun < kReruns; ++rerun) {
    const Problem problem(load_experiment(
        file_, {"samples={primal: 16, interior: 2, visibility: 6}", "seed=" + std::to_string(3 + rerun)}));
    const std::vector<double> theta = problem.parameters().initial();
    const GatedImage target = problem.make_target();
    const GradientVariance parts = measure_cost(problem, theta, target, {true, true, false}, {16, 2, 6, 1}).variance;
    ReplicateStatistics repeats;
    for (int r = 0; r < kRepeats; ++r) {
      std::vector<double> gradient = problem.evaluate(theta, target, r).gradient;
      gradient[0] *= 0.2;  // ways from initial to target
      gradient[1] *= 2;
      repeats.add(gradient, 1);
    }
    double measured = 0;
    for (const double error : repeats.result().standard_error) measured += kRepeats * error * error;
    reruns.add({parts({16, 2, 6, 0}) - measured, measured, parts.image / 16, (parts.term[0] + parts.cross[0] / 16) / 2,
                (parts.term[1] + parts.cross[1] / 16) / 6},
               1);
  }
  const Statistics found = reruns.result();
  const double scale = found.mean[1];
  EXPECT_LT(std::abs(found.mean[0]), 4.5 * found.standard_error[0]) << scale;
  EXPECT_LT(found.standard_error[0], 0.045 * scale);
  for (int part : {2, 3, 4}) EXPECT_GT(found.mean[part], 4.5 * 0.045 * scale) << part;
}

TEST_F(InspectionTest, FragmentReadsBack) {
  const Experiment before = load_experiment(file_, {"max_bounces=6"});
  const Setting setting{3, Sampling::standard, {5, 6, 7, 0}};
  const std::string fragment = advice_yaml(before, setting);
  EXPECT_EQ(fragment,
            "max_bounces: 3\ntarget:\n  max_bounces: 6\nsamples:\n  primal: 5\n  interior: 6\n  visibility: 7\n"
            "  path_length: 0\nestimator:\n  sampling: standard\n");
  const std::string file =
      folder_.write("new.yaml", "name: new\nscene: scene.yaml\ngates: {kind: steady}\n" + fragment);
  const Experiment read = load_experiment(file);
  EXPECT_EQ(read.estimator.max_bounces, 3);
  EXPECT_EQ(read.target.max_bounces, 6);
  EXPECT_EQ(read.samples.interior, 6);
  EXPECT_EQ(read.samples.path_length, 0);
}

TEST_F(InspectionTest, SamplesAndSamplingChangeWhereItPays) {
  // By hand: per sample, interior costs 4 and has nearly all the variance; the present split wastes images.
  Advice advice;
  advice.before = {2, Sampling::standard, {100, 10, 0, 0}};
  advice.reduction.kept = {2, {true, false, false}};
  GradientCost cost;
  cost.variance = {1, {100, 0, 0}, {}};
  cost.seconds = {1, 4, 0, 0};
  advice.costs_before = {cost};
  GradientCost quick = cost;
  quick.seconds = {0.5, 2, 0, 0};
  advice.trials = {{Sampling::standard, {}, 0, 0, {cost}}, {Sampling::automatic, {}, 0, 0, {quick}}};
  choose_samples(advice, 1);
  // Variance 1/100 + 100/10 = 10.01, n proportional to sqrt(1/1) : sqrt(100/4) = 1 : 5.
  EXPECT_EQ(advice.after.samples[1], 11);
  EXPECT_LE(advice.after.samples[0], 3);
  EXPECT_EQ(advice.after.sampling, Sampling::automatic);
  EXPECT_EQ(advice.seconds_before, 140);
  EXPECT_LT(advice.seconds_after, 25);
  // A quick estimator whose variance a few rare samples make is not trusted.
  advice.trials[1].costs[0].effective_count = 1.5;
  choose_samples(advice, 1);
  EXPECT_EQ(advice.after.sampling, Sampling::standard);
  // Near the best split nothing changes.
  advice.before.samples = {3, 11, 0, 0};
  choose_samples(advice, 1);
  EXPECT_EQ(advice.after.samples, advice.before.samples);
}

TEST_F(InspectionTest, OnlyAnalyticGradients) {
  EXPECT_THROW(run({"gradient={method: finite_difference}"}), InputError);
  EXPECT_THROW(run({"parameters=[]"}), InputError);
}

}  // namespace
}  // namespace isochron
