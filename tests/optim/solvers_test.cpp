// Every optimiser through its interface, on problems whose answer is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "optim/experiment/choices.h"
#include "optim/run/loop.h"
#include "optim/solvers/quadratic_model.h"
#include "tests/optim/synthetic_objective.h"

namespace isochron {
namespace {

struct Stopped {};

const Preconditioner kNone;

OptimizerSpec spec_of(OptimizerMethod method) {
  OptimizerSpec spec;
  spec.method = method;
  spec.learning_rate = 0.05;
  return spec;
}

/// Runs `iterations` steps from (1, 0.2) or from `state`; saves the last checkpoint in it.
LoopResult run(const Objective& objective, const OptimizerSpec& spec, int iterations, Checkpoint& state,
               const std::vector<double>& scales = {}) {
  if (state.theta.empty()) state.theta = {1, 0.2};
  const auto optimizer = make_optimizer(spec, kNone, scales);
  LoopOptions options;
  options.iterations = iterations;
  options.row = [](const Evaluation&, const std::vector<double>&, bool) {};
  options.save = [] {};
  return run_loop(objective, *optimizer, std::max(0, spec.stop_window), options, state);
}

class Solvers : public testing::TestWithParam<OptimizerMethod> {
 protected:
  OptimizerSpec spec() const { return spec_of(GetParam()); }
};

INSTANTIATE_TEST_SUITE_P(Methods, Solvers,
                         testing::Values(OptimizerMethod::adam, OptimizerMethod::lbfgs,
                                         OptimizerMethod::levenberg_marquardt, OptimizerMethod::quasi_newton),
                         [](const auto& method) { return std::string(name_of(method.param)); });

TEST_P(Solvers, ReachTheTargetOfAnExactProblem) {
  const ExponentialFit fit;
  Checkpoint state;
  const int iterations = GetParam() == OptimizerMethod::adam ? 600 : 15;
  EXPECT_EQ(run(fit, spec(), iterations, state).status, RunStatus::iterations_reached);
  const double tolerance = GetParam() == OptimizerMethod::adam ? 1e-3 : 1e-6;
  EXPECT_NEAR(state.theta[0], 2, tolerance);
  EXPECT_NEAR(state.theta[1], 0.7, tolerance);
  // Where there is no noise, Adam's own swings about the optimum are rises.
  EXPECT_LE(state.safeguard.rejected, GetParam() == OptimizerMethod::adam ? 3 : 0);
}

// Where noise is all that is left each check of ten rows, then of every five, stops with probability 0.83: after 40 iterations
// one run in 200 000 still goes on.
TEST_P(Solvers, StopByDefaultInTheNoise) {
  OptimizerSpec with_default = spec();
  const bool stops = GetParam() != OptimizerMethod::adam;  // whose windows are longer than this run
  EXPECT_EQ(with_default.window(), stops ? 5 : 50);
  with_default.stop_window = with_default.window();
  ExponentialFit fit;
  fit.residual_noise = 0.05;
  Checkpoint state;
  const LoopResult result = run(fit, with_default, 40, state);
  EXPECT_EQ(result.status, stops ? RunStatus::converged : RunStatus::iterations_reached);
  if (!stops) return;
  EXPECT_GE(state.iteration, 9);
  EXPECT_EQ(result.choice, FinalChoice::average);
  EXPECT_NEAR(state.theta[0], 2, 0.1);
  OptimizerSpec off = spec();
  off.stop_window = 0;
  EXPECT_EQ(off.window(), 0);
}

/// The fit with unknowns in other units: theta' = unit * theta.
class InOtherUnits : public Objective {
 public:
  InOtherUnits(const Objective& fit, const std::vector<double>& unit) : fit_(fit), unit_(unit) {
    for (std::size_t i = 0; i < unit.size(); ++i) {
      lower_.push_back(fit.lower()[i] * unit[i]);
      upper_.push_back(fit.upper()[i] * unit[i]);
    }
  }
  const std::vector<double>& lower() const override { return lower_; }
  const std::vector<double>& upper() const override { return upper_; }
  double loss(const std::vector<double>& theta, std::uint32_t iteration) const override {
    return fit_.loss(own(theta), iteration);
  }
  Evaluation evaluate(const std::vector<double>& theta, std::uint32_t iteration) const override {
    return converted(fit_.evaluate(own(theta), iteration));
  }
  Evaluation linearise(const std::vector<double>& theta, std::uint32_t iteration) const override {
    return converted(fit_.linearise(own(theta), iteration));
  }
  std::vector<std::vector<double>> probe_curvature(const std::vector<double>& theta, std::uint32_t iteration,
                                                   const Evaluation& now, Probes probes) const override {
    auto found = fit_.probe_curvature(own(theta), iteration, now, probes);
    for (std::vector<double>& diagonal : found)
      for (std::size_t i = 0; i < diagonal.size(); ++i) diagonal[i] /= unit_[i] * unit_[i];
    return found;
  }

 private:
  std::vector<double> own(std::vector<double> theta) const {
    for (std::size_t i = 0; i < theta.size(); ++i) {
      EXPECT_GE(theta[i], lower_[i]);
      EXPECT_LE(theta[i], upper_[i]);
      theta[i] /= unit_[i];
    }
    return theta;
  }
  Evaluation converted(Evaluation e) const {
    for (std::size_t i = 0; i < e.gradient.size(); ++i) e.gradient[i] /= unit_[i];
    for (std::size_t k = 0; k < e.curvature.size(); ++k) {
      e.curvature[k] /= unit_[k / 2] * unit_[k % 2];
      e.curvature_bound[k] /= unit_[k / 2] * unit_[k % 2];
    }
    return e;
  }

  const Objective& fit_;
  std::vector<double> unit_, lower_, upper_;
};

TEST_P(Solvers, TakeTheSameStepsInAnyUnitsThatTheScalesKnow) {
  ExponentialFit fit;
  fit.high = {1.9, 10};  // a bound that is met
  Checkpoint own, other;
  const std::vector<double> unit = {1e3, 0.03};
  other.theta = {1 * unit[0], 0.2 * unit[1]};
  const InOtherUnits converted(fit, unit);
  run(fit, spec(), 8, own);
  run(converted, spec(), 8, other, unit);
  // Optimisers work on the same numbers but for rounding, which line searches carry on.
  for (int i : {0, 1}) EXPECT_NEAR(other.theta[i] / unit[i], own.theta[i], 1e-9) << i;
  if (own.theta[0] == fit.high[0]) {
    EXPECT_EQ(other.theta[0], converted.upper()[0]);
  }
}

TEST_P(Solvers, ReachTheTargetThroughNoise) {
  // 60 residuals of noise 0.1; a Jacobian of which each half is as much noise as signal (entries 0.1 to 1).
  ExponentialFit fit;
  fit.residual_noise = 0.1;
  fit.jacobian_noise = 0.5;
  Checkpoint state;
  run(fit, spec(), GetParam() == OptimizerMethod::adam ? 300 : 40, state);
  // One fit to one draw of the noise has standard deviations 0.04 and 0.035. Five of them, 6e-7 by chance.
  EXPECT_NEAR(state.theta[0], 2, 0.2);
  EXPECT_NEAR(state.theta[1], 0.7, 0.17);
}

TEST_P(Solvers, DoNotDependOnTheUnits) {
  // Loss in other units, by a power of two: the same bits.
  class Scaled : public ExponentialFit {
   public:
    Evaluation linearise(const std::vector<double>& theta, std::uint32_t iteration) const override {
      Evaluation result = ExponentialFit::linearise(theta, iteration);
      for (auto* v : {&result.gradient, &result.curvature, &result.curvature_bound})
        for (double& x : *v) x *= 0x1p-100;
      return result;
    }
    std::vector<std::vector<double>> probe_curvature(const std::vector<double>& theta, std::uint32_t iteration,
                                                     const Evaluation& now, Probes probes) const override {
      auto found = ExponentialFit::probe_curvature(theta, iteration, now, probes);
      for (std::vector<double>& diagonal : found)
        for (double& d : diagonal) d *= 0x1p-100;
      return found;
    }
  } scaled;
  scaled.inject = [](auto&, double loss) { return 0x1p-100 * loss; };
  const ExponentialFit fit;
  Checkpoint a, b;
  run(fit, spec(), 6, a);
  run(scaled, spec(), 6, b);
  EXPECT_EQ(a.theta, b.theta);
}

TEST_P(Solvers, StayWithinBounds) {
  ExponentialFit fit;
  fit.low = {0.5, 0.1};
  fit.high = {1.5, 10};  // a = 2 is out of reach; the best b for a = 1.5 is 0.4514 (bisection of the derivative)
  fit.inject = [&](const std::vector<double>& theta, double loss) {
    EXPECT_TRUE(theta[0] >= 0.5 && theta[0] <= 1.5 && theta[1] >= 0.1 && theta[1] <= 10);
    return loss;
  };
  Checkpoint state;
  run(fit, spec(), GetParam() == OptimizerMethod::adam ? 600 : 25, state);
  EXPECT_NEAR(state.theta[0], 1.5, 1e-12);
  const auto slope = [&](double b) { return fit.linearise({1.5, b}, 0).gradient[1]; };
  double low = 0.1, high = 2;
  while (high - low > 1e-12) (slope((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
  EXPECT_NEAR(state.theta[1], low, GetParam() == OptimizerMethod::adam ? 2e-3 : 1e-4);
}

TEST_P(Solvers, ResumeFromAnyIterationBitForBit) {
  ExponentialFit fit;
  fit.residual_noise = 0.1;
  fit.jacobian_noise = 0.3;
  Checkpoint whole;
  run(fit, spec(), 9, whole);
  for (int cut : {1, 4, 8}) {
    // Stopped in the midst of a step, or, where that asks for nothing, right after it.
    Checkpoint state;
    state.theta = {1, 0.2};
    bool stepping = false;
    ExponentialFit stopping = fit;
    stopping.inject = [&](const std::vector<double>&, double loss) {
      if (stepping && state.iteration == cut) throw Stopped{};
      return loss;
    };
    const auto optimizer = make_optimizer(spec(), kNone);
    LoopOptions options;
    options.iterations = 9;
    options.row = [&](const Evaluation&, const std::vector<double>&, bool) { stepping = true; };
    options.save = [&] {
      stepping = false;
      if (GetParam() == OptimizerMethod::adam && state.iteration == cut) throw Stopped{};
    };
    EXPECT_THROW(run_loop(stopping, *optimizer, 0, options, state), Stopped);
    EXPECT_EQ(state.iteration, cut);
    run(fit, spec(), 9, state);
    EXPECT_EQ(state.theta, whole.theta) << "cut at " << cut;
    EXPECT_EQ(state.optimizer, whole.optimizer);
    EXPECT_EQ(state.safeguard.recent, whole.safeguard.recent);
  }
}

TEST_P(Solvers, SurviveALossThatIsNotFinite) {
  ExponentialFit fit;
  fit.inject = [](const std::vector<double>& theta, double loss) {
    return theta[0] > 1.9 ? std::numeric_limits<double>::quiet_NaN() : loss;  // the target lies behind the wall
  };
  Checkpoint state;
  run(fit, spec(), GetParam() == OptimizerMethod::adam ? 200 : 20, state);
  EXPECT_TRUE(std::isfinite(state.theta[0]) && std::isfinite(state.theta[1]));
  EXPECT_LE(state.theta[0], 1.9);
  EXPECT_GT(state.theta[0], 1.3);
}

TEST_P(Solvers, TellOfRejectedSteps) {
  // No point but the start is any good.
  ExponentialFit fit;
  fit.inject = [](const std::vector<double>& theta, double loss) { return theta[0] == 1 ? loss : 1e6; };
  Checkpoint state;
  state.theta = {1, 0.2};
  const auto optimizer = make_optimizer(spec(), kNone, {1, 2});
  EXPECT_EQ(optimizer->scatters(), GetParam() != OptimizerMethod::adam);
  std::vector<std::string> warnings;
  LoopOptions options;
  options.iterations = 7;
  options.row = [](const Evaluation&, const std::vector<double>&, bool) {};
  options.save = [] {};
  options.warning = [&](const std::string& text) { warnings.push_back(text); };
  run_loop(fit, *optimizer, 0, options, state);
  if (GetParam() == OptimizerMethod::adam) {  // steps without a look at the loss
    EXPECT_EQ(state.steps_rejected, 0);
    return;
  }
  EXPECT_EQ(state.theta, (std::vector<double>{1, 0.2}));
  EXPECT_EQ(state.steps_rejected, 7);
  ASSERT_EQ(warnings.size(), 1u);  // after five, once
  EXPECT_NE(warnings[0].find("iteration 4: 5 iterations in a row found no lower loss"), std::string::npos);
}

TEST_P(Solvers, GoOnWhereTheLossIsBelowZero) {
  // An unbiased estimate near the optimum; the constant is beside the point.
  ExponentialFit fit;
  // Noise that hides the fall ends a search of quasi_newton: QuasiNewton.EndsSearchesThatNoiseHides.
  fit.loss_noise = GetParam() == OptimizerMethod::quasi_newton ? 1e-6 : 0.01;
  fit.inject = [](auto&, double loss) { return loss - 0.01; };
  Checkpoint state;
  state.theta = {1.95, 0.68};  // a loss of 6e-4 less the constant
  run(fit, spec(), GetParam() == OptimizerMethod::adam ? 600 : 15, state);
  EXPECT_NEAR(state.theta[0], 2, 1e-3);
  EXPECT_NEAR(state.theta[1], 0.7, 1e-3);
}

TEST(Lbfgs, NeedsFarFewerGradientsThanAdam) {
  const ExponentialFit lbfgs_fit, lm_fit;
  Checkpoint a, b;
  run(lbfgs_fit, spec_of(OptimizerMethod::lbfgs), 6, a);
  run(lm_fit, spec_of(OptimizerMethod::levenberg_marquardt), 8, b);
  EXPECT_NEAR(a.theta[1], 0.7, 1e-3);
  EXPECT_NEAR(b.theta[1], 0.7, 1e-3);
  EXPECT_LT(lbfgs_fit.gradients, 80);
  EXPECT_EQ(lm_fit.gradients, 9);  // one linearisation per row: none is thrown away
}

TEST(QuadraticModel, HasTheGradientAndTheCurvature) {
  const ExponentialFit fit;
  const Evaluation at = fit.linearise({1.9, 0.65}, 0);
  const QuadraticModel model = quadratic_model(at);
  const Eigen::MatrixXd j = model.jacobian * model.scale.asDiagonal() * std::sqrt(2 * at.loss);
  const Eigen::VectorXd g = j.transpose() * model.residual * std::sqrt(2 * at.loss);
  for (int i : {0, 1}) EXPECT_NEAR(g[i], at.gradient[i], 1e-12 * std::abs(at.gradient[i]));
  const Eigen::MatrixXd curvature = j.transpose() * j;
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(curvature(i / 2, i % 2), at.curvature[i], 1e-10 * at.curvature[0]);
  EXPECT_NEAR((model.jacobian.transpose() * model.jacobian)(1, 1), 1, 1e-12);
}

TEST(QuadraticModel, RaisesWhatNoiseMadeNegative) {
  Evaluation at;
  at.loss = 1e-6;
  at.gradient = {0, 0, 0};
  at.curvature_bound = {4, 0, 0, 0, 1, 0, 0, 0, 0};
  at.curvature = {2, 0, 0, 0, -0.25, 0, 0, 0, 0};  // relative to the bound: 0.5, -0.25 and an unknown without effect
  const QuadraticModel model = quadratic_model(at);
  const Eigen::MatrixXd j = model.jacobian * model.scale.asDiagonal() * std::sqrt(2 * at.loss);
  const Eigen::MatrixXd curvature = j.transpose() * j;
  EXPECT_NEAR(curvature(0, 0), 2, 1e-12);
  EXPECT_NEAR(curvature(1, 1), 0.25, 1e-12);
  EXPECT_GT(curvature(2, 2), 0);
  // A gradient too steep for the loss: the model must not fall below zero, |residual|^2 <= 1.
  at.gradient = {1e-2, 0, 0};  // would fall by 1e-4 / 4
  const QuadraticModel steep = quadratic_model(at);
  EXPECT_NEAR(steep.residual.squaredNorm(), 1, 1e-12);
  const Eigen::VectorXd slope = steep.jacobian.transpose() * steep.residual;
  EXPECT_NEAR(slope[0] * steep.scale[0] * 2 * at.loss, 1e-2, 1e-14);
}

}  // namespace
}  // namespace isochron
