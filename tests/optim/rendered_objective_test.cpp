// The objective that the optimisers see, rendered; and each of them on the tiny scene.
#include "optim/problem/rendered_objective.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "optim/problem/estimates.h"
#include "optim/run/loop.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

class Rendered : public testing::Test {
 protected:
  Rendered() {
    write_tiny_scene(folder_);
    file_ = folder_.write("tiny.yaml", tiny_experiment());
  }
  TemporaryFolder folder_;
  std::string file_;
};

TEST_F(Rendered, LinearisationIsMadeOfTheDerivativeImages) {
  for (const char* loss : {"loss={kind: squared}", "loss={kind: cauchy, scale: 0.3}"}) {
    const Problem problem(load_experiment(file_, {loss}));
    const GatedImage target = problem.make_target();
    const RenderedObjective objective(problem, target);
    const std::vector<double> theta = problem.parameters().initial();
    const Evaluation at = objective.linearise(theta, 5), plain = objective.evaluate(theta, 5);
    EXPECT_EQ(at.loss, plain.loss);
    EXPECT_EQ(at.loss, objective.loss(theta, 5));
    EXPECT_EQ(at.mean_squared_error, plain.mean_squared_error);

    // The objective takes its samples in halves.
    const Scene scene = problem.parameters().apply(theta);
    const TangentBasis basis = problem.parameters().tangent(theta);
    const Renderer renderer(scene, problem.gates(), problem.estimator(16), &basis);
    std::vector<GatedImage> jacobian;
    for (Term term : {Term::interior, Term::visibility}) {
      if (jacobian.empty()) jacobian.assign(2, GatedImage(8, 8, 2, 1));
      for (const SampleRange half : {SampleRange{0, 8}, SampleRange{8, 16}}) {
        const auto images = renderer.derive(term, problem.stream(pass_of(term), 5), half);
        for (int i : {0, 1})
          for (std::size_t k = 0; k < images[i].data.size(); ++k) jacobian[i].data[k] += 0.5 * images[i].data[k];
      }
    }
    const ReadingLoss robust = problem.reading_loss(target);
    const SplitImage image = render_halves(renderer, problem.stream(Pass::primal, 5), {0, 16});
    EXPECT_EQ(image.image.data, at.image.data);
    const GatedImage adjoint = loss_adjoint(image, target, robust);
    for (int i : {0, 1}) {
      const double slope = inner_product(adjoint, jacobian[i]);
      EXPECT_NEAR(at.gradient[i], slope, 1e-12 * std::abs(slope));
      for (int j : {0, 1}) {
        double sum = 0;
        for (std::size_t k = 0; k < target.data.size(); ++k)
          sum += robust.weight(at.image.data[k], target.data[k]) * jacobian[i].data[k] * jacobian[j].data[k];
        EXPECT_NEAR(at.curvature_bound[2 * i + j], 2 * sum / 128, 1e-12 * at.curvature_bound[0]);
      }
    }
    EXPECT_EQ(at.curvature[1], at.curvature[2]);
  }
}

// Their samples go to other pixels and gates. 2 components at 4.5 standard errors.
TEST_F(Rendered, GradientsWithAndWithoutTheJacobianAgreeOnAverage) {
  const Problem problem(load_experiment(file_));
  const GatedImage target = problem.make_target();
  const RenderedObjective objective(problem, target);
  const std::vector<double> theta = problem.parameters().initial();
  ReplicateStatistics differences;
  for (int i = 0; i < 200; ++i) {
    const std::vector<double> with = objective.linearise(theta, i).gradient,
                              alone = objective.evaluate(theta, i).gradient;
    differences.add({with[0] - alone[0], with[1] - alone[1], alone[0], alone[1]}, 1);
  }
  const Statistics found = differences.result();
  for (int i : {0, 1}) {
    EXPECT_LT(std::abs(found.mean[i]), 4.5 * found.standard_error[i]) << i;
    EXPECT_LT(found.standard_error[i], 0.1 * std::abs(found.mean[2 + i])) << i;
  }
}

TEST_F(Rendered, CurvatureIsUnbiased) {
  const Problem few(load_experiment(file_, {"samples={primal: 1, interior: 2, visibility: 2, path_length: 0}"}));
  const Problem many(load_experiment(file_, {"samples={primal: 1, interior: 8192, visibility: 8192, path_length: 0}"}));
  const GatedImage target = few.make_target();
  const std::vector<double> theta = few.parameters().initial();
  const Evaluation exact = RenderedObjective(many, target).linearise(theta, 0);
  ReplicateStatistics statistics;
  const RenderedObjective objective(few, target);
  for (std::uint32_t i = 1; i <= 200; ++i) {
    const Evaluation at = objective.linearise(theta, i);
    statistics.add({at.curvature[0], at.curvature[1], at.curvature[3], at.curvature_bound[0]}, 1);
  }
  const Statistics mean = statistics.result();
  const double expected[] = {exact.curvature[0], exact.curvature[1], exact.curvature[3]};
  for (int i : {0, 1, 2})  // 5 standard errors: by chance 6e-7 each, seed fixed
    EXPECT_LT(std::abs(mean.mean[i] - expected[i]), 5 * mean.standard_error[i]) << i;
  EXPECT_GT(expected[0], 10 * mean.standard_error[0]);
  EXPECT_GT(mean.mean[3] - expected[0], 10 * mean.standard_error[3]);  // what the halves are for
}

/// Sums over readings of (sqrt(weight) * derivative)^2, of the samples that an adjoint pass of these weights takes: a pixel's share of
/// them follows its weights, whatever their signs, so that turning the sign of one reading shows its derivative.
std::vector<double> diagonal_by_readings(const Problem& problem, const std::vector<double>& theta,
                                         const std::vector<double>& weights) {
  GatedImage adjoint = problem.blank();
  for (std::size_t k = 0; k < weights.size(); ++k) adjoint.data[k] = std::sqrt(weights[k]);
  const std::vector<double> all = problem.transpose_apply(theta, adjoint, 3);
  std::vector<double> diagonal(all.size(), 0.0);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (weights[k] == 0) continue;
    adjoint.data[k] *= -1;
    const std::vector<double> turned = problem.transpose_apply(theta, adjoint, 3);
    adjoint.data[k] *= -1;
    for (std::size_t i = 0; i < all.size(); ++i) diagonal[i] += std::pow((all[i] - turned[i]) / 2, 2);
  }
  return diagonal;
}

// By adjoint passes with random signs, against the readings one by one. Of a single reading every probe is exact.
// Of many, probes are so on average: within 5 standard errors, by chance 1e-5 (chi-squares are skew), as their signs have nothing
// in common. Where all readings move alike a probe is a chi-square of one degree: the error of 600 is sqrt(2 / 600) = 0.058 of
// the mean, itself known to 8 % (a kurtosis of 15), so that the limit of 0.1 is nine of these deviations away.
TEST_F(Rendered, ProbesAreTheDiagonalOfTheCurvature) {
  for (const bool single : {false, true}) {
    if (single) folder_.write("scene.yaml", replaced(folder_.read("scene.yaml"), "[8, 8]", "[1, 1]"));
    for (const std::string loss : {"squared", "poisson"}) {
      SCOPED_TRACE(loss + (single ? ", one reading" : ""));
      const Problem problem(load_experiment(
          file_, {"loss={kind: " + loss + "}", "estimator={sampling: standard, guiding: false, numbers: independent}",
                  "target.window=[5, 6]"}));
      const GatedImage target = problem.make_target();
      const RenderedObjective objective(problem, target);
      const std::vector<double> theta = problem.parameters().initial();
      const Evaluation now = objective.evaluate(theta, 3);
      const std::vector<double> weights = curvature_weights(now.image, target, problem.reading_loss(target));
      const std::vector<double> exact = diagonal_by_readings(problem, theta, weights);
      if (loss == "squared") {  // weights that are all alike: samples as those of images
        const TangentBasis basis = problem.parameters().tangent(theta);
        const Scene scene = problem.parameters().apply(theta);
        const Renderer renderer(scene, problem.gates(), problem.estimator(16), &basis);
        const auto interior = renderer.derive(Term::interior, problem.stream(Pass::interior, 3), {0, 16});
        const auto visibility = renderer.derive(Term::visibility, problem.stream(Pass::visibility, 3), {0, 16});
        for (int i : {0, 1}) {
          double sum = 0;
          for (std::size_t k = 0; k < weights.size(); ++k)
            sum += weights[k] * std::pow(interior[i].data[k] + visibility[i].data[k], 2);
          EXPECT_NEAR(exact[i], sum, 1e-9 * sum) << i;
        }
      }
      ReplicateStatistics statistics;
      for (const std::vector<double>& each : objective.probe_curvature(theta, 3, now, {.count = single ? 4 : 600}))
        statistics.add(each, 1);
      const Statistics found = statistics.result();
      for (int i : {0, 1}) {
        const double error = found.standard_error[i];
        EXPECT_GT(exact[i], 0) << i;
        EXPECT_NEAR(found.mean[i], exact[i], single ? 1e-9 * exact[i] : 5 * error) << i;
        EXPECT_LT(error, (single ? 1e-9 : 0.1) * exact[i]) << i;
      }
    }
  }
}

TEST_F(Rendered, LossNeedsTwoSamples) {
  EXPECT_NO_THROW(require_two_samples(Problem(load_experiment(file_, {"samples.primal=2"}))));
  EXPECT_THROW(require_two_samples(Problem(load_experiment(file_, {"samples.primal=1"}))), InputError);
}

TEST_F(Rendered, SizeOfTheJacobianIsLimited) {
  const std::string experiment = replaced(tiny_experiment(), "[4.5, 5.5]", "{start: 3, stop: 6, count: 40}");
  folder_.write("scene.yaml", replaced(folder_.read("scene.yaml"), "[8, 8]", "[2000, 1000]"));
  const std::string file = folder_.write("large.yaml", experiment);
  EXPECT_NO_THROW(require_optimisable(Problem(load_experiment(file))));
  try {
    require_optimisable(Problem(load_experiment(file, {"optimizer.method=levenberg_marquardt"})));
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("needs 2.56 GB for the Jacobian of 80000000 residuals by 2 unknowns (allowed: 2 GB"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(Rendered, PenaltyIsPartOfLossGradientAndCurvature) {
  // Offsets and albedos by vertex with the same differences.
  folder_.write("scene.yaml",
                replaced(folder_.read("scene.yaml"), "block.obj, material: metal", "block.obj, material: white"));
  for (const std::string parameter :
       {"type: vertices, shape: block, direction: normal, initial: [0.1, 0.2, 0.3, 0], target: 0, ",
        "type: albedo, shape: block, per: vertex, initial: [0.3, 0.4, 0.5, 0.2], target: 0.6, "}) {
    SCOPED_TRACE(parameter);
    const std::string file = folder_.write(
        "uneven.yaml",
        replaced(tiny_experiment(), "type: translation, shape: block, direction: [0, 1, 0], initial: 0.2, target: 0}",
                 parameter + "smoothing: {slopes: 3}}"));
    // Standard sampling: connections would pick their gates otherwise for a gradient than for a Jacobian. Independent
    // numbers: a Jacobian's samples come in halves.
    const std::string standard = "estimator={sampling: standard, numbers: independent}";
    const Problem with(load_experiment(file, {standard})),
        without(load_experiment(file, {standard, "parameters[0].smoothing={slopes: 0}"}));
    const GatedImage target = with.make_target();
    const std::vector<double> theta = with.parameters().initial();
    const Evaluation a = RenderedObjective(with, target).linearise(theta, 0),
                     b = RenderedObjective(without, target).linearise(theta, 0);
    // Edges of the block's two triangles: four sides of length 1 and one diagonal of sqrt(2), from vertex 0
    // to 2.
    const double unit = 3 * mean_square(target) / 5;
    const double squares = 0.01 + 0.01 + 0.09 + 0.01 + 0.04 / 2;
    EXPECT_NEAR(a.loss - b.loss, unit * squares, 1e-12 * a.loss);
    EXPECT_NEAR(a.gradient[0] - b.gradient[0], unit * 2 * (-0.1 + 0.1 - 0.2 / 2), 1e-12 * a.loss);
    EXPECT_NEAR(a.curvature[2] - b.curvature[2], -unit * 2 / 2, 1e-12 * a.loss);
    EXPECT_EQ(a.mean_squared_error, b.mean_squared_error);
    const auto gradient = [&](const Problem& p) { return RenderedObjective(p, target).evaluate(theta, 0).gradient[0]; };
    EXPECT_NEAR(gradient(with) - gradient(without), unit * 2 * (-0.1 + 0.1 - 0.2 / 2), 1e-12 * a.loss);
  }
}

TEST_F(Rendered, EveryMethodFindsTheTinyScenesParameters) {
  for (const char* optimizer : {"{method: adam, learning_rate: 0.05, iterations: 120}",
                                "{method: lbfgs, learning_rate: 0.05, iterations: 12, inner_iterations: 5}",
                                "{method: levenberg_marquardt, iterations: 12}",
                                "{method: quasi_newton, iterations: 12, inner_iterations: 5}"}) {
    const Problem problem(load_experiment(file_, {std::string("optimizer=") + optimizer, "target.samples=4096"}));
    const GatedImage target = problem.make_target();
    const RenderedObjective objective(problem, target);
    const OptimizerSpec& spec = problem.experiment().optimizer;
    const auto method = make_optimizer(spec, problem.preconditioner(), problem.parameters().scales());
    Checkpoint state;
    state.theta = problem.parameters().initial();
    LoopOptions options;
    options.iterations = spec.iterations;
    options.row = [](const Evaluation&, const std::vector<double>&, bool) {};
    options.save = [] {};
    EXPECT_EQ(run_loop(objective, *method, 0, options, state).status, RunStatus::iterations_reached) << optimizer;
    EXPECT_NEAR(state.theta[0], 0, 0.04) << optimizer;
    EXPECT_NEAR(state.theta[1], 10, 0.5) << optimizer;
  }
}

TEST_F(Rendered, OneRateFindsMetresDegreesAlbedosAndWatts) {
  const std::string parameters =
      "parameters=[{name: height, type: translation, shape: block, direction: [0, 1, 0], initial: 0.2, target: 0},"
      " {name: tilt, type: rotation, shape: block, axis: [0, 0, 1], pivot: center, initial: 12, target: 0},"
      " {name: grey, type: albedo, material: white, initial: 0.4, target: 0.6},"
      " {name: power, type: emission, shape: lamp, initial: 800, target: 1000}]";
  const auto distances = [&](bool scaled) {
    const Problem problem(load_experiment(
        file_, {parameters, "optimizer={method: adam, learning_rate: 0.02, iterations: 150}", "target.samples=4096"}));
    const GatedImage target = problem.make_target();
    const RenderedObjective objective(problem, target);
    const OptimizerSpec& spec = problem.experiment().optimizer;
    const Parameters& all = problem.parameters();
    const auto method = make_optimizer(spec, problem.preconditioner(), scaled ? all.scales() : std::vector<double>{});
    Checkpoint state;
    state.theta = all.initial();
    LoopOptions options;
    options.iterations = spec.iterations;
    options.row = [](const Evaluation&, const std::vector<double>&, bool) {};
    options.save = [] {};
    run_loop(objective, *method, 0, options, state);
    std::vector<double> relative;
    for (const Parameters::Block& block : all.blocks())
      relative.push_back(all.distance_to_target(state.theta, block) / all.distance_to_target(all.initial(), block));
    return relative;
  };
  for (double remains : distances(true)) EXPECT_LT(remains, 0.25);
  // Without scales the same rate moves degrees and watts by 3 at most.
  EXPECT_GT(distances(false)[3], 0.9);
}

}  // namespace
}  // namespace isochron
