#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "optim/problem/vector_math.h"
#include "optim/solvers/ceres_calls.h"
#include "optim/solvers/optimizer.h"
#include "optim/solvers/quadratic_model.h"

namespace isochron {
namespace {

/// The loss of one iteration as n + 1 residuals of the n unknowns of a QuadraticModel. Ceres sees J'J and J'r
/// through the model and half the sum of squares through the loss (its last residual makes up the
/// difference), which are all that Levenberg-Marquardt uses: the residuals of all pixels and gates never
/// reach it. To the loss a constant is added, which changes no difference, so that estimates below 0 have roots, too. At any other point than
/// the first the Jacobian is zero, which ends the solver after its first accepted step: the next linearisation has the random numbers of the
/// next iteration.
class CondensedLoss : public ceres::CostFunction {
 public:
  CondensedLoss(const Objective& objective, const Evaluation& now, const QuadraticModel& model,
                const std::vector<double>& start, std::uint32_t iteration)
      : objective_(objective),
        model_(model),
        start_(start),
        iteration_(iteration),
        loss_at_start_(now.loss),
        unit_(max_expected_decrease(now)) {
    set_num_residuals(static_cast<int>(start.size()) + 1);
    mutable_parameter_block_sizes()->push_back(static_cast<int>(start.size()));
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    return guarded_([&] {
      const auto n = static_cast<Eigen::Index>(start_.size());
      const std::vector<double> theta = point(parameters[0]);
      const bool first = theta == start_;
      Eigen::Map<Eigen::VectorXd> residual(residuals, n + 1);
      residual.setZero();
      if (first) residual.head(n) = model_.residual;
      // At the start twice what the model can take away; losses that fall further are taken to fall as far.
      const double squares = 2 + (loss_at(theta) - loss_at_start_) / unit_;
      if (!std::isfinite(squares)) return false;
      residual[n] = std::sqrt(std::max(0.0, squares - residual.squaredNorm()));
      if (jacobians && jacobians[0]) {
        using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
        Eigen::Map<Matrix> jacobian(jacobians[0], n + 1, n);
        jacobian.setZero();
        if (first) jacobian.topRows(n) = model_.jacobian;
      }
      return true;
    });
  }

  std::vector<double> point(const double* u) const {
    std::vector<double> theta = start_;
    for (std::size_t i = 0; i < theta.size(); ++i)
      theta[i] = std::clamp(theta[i] + u[i] / model_.scale[static_cast<Eigen::Index>(i)], objective_.lower()[i],
                            objective_.upper()[i]);
    return theta;
  }
  void rethrow() const { guarded_.rethrow(); }

 private:
  /// The accepted point is asked for twice, once with its Jacobian.
  double loss_at(const std::vector<double>& theta) const {
    if (theta == start_) return loss_at_start_;
    if (theta != last_theta_) {
      last_loss_ = objective_.loss(theta, iteration_);
      last_theta_ = theta;
    }
    return last_loss_;
  }

  const Objective& objective_;
  const QuadraticModel& model_;
  std::vector<double> start_;
  std::uint32_t iteration_;
  double loss_at_start_, unit_;
  GuardedCalls guarded_;
  mutable std::vector<double> last_theta_;
  mutable double last_loss_ = 0;
};

/// Levenberg-Marquardt of Ceres on the linearised objective. One iteration is one accepted step; trial points that Ceres rejects
/// cost an image each. The radius of the trust region is carried from one iteration to the next.
class LevenbergMarquardt : public Optimizer {
 public:
  Evaluation evaluate(const Objective& objective, const std::vector<double>& theta,
                      std::uint32_t iteration) const override {
    return objective.linearise(theta, iteration);
  }

  std::vector<double> step(const Objective& objective, Evaluation now, const std::vector<double>& theta,
                           std::uint32_t iteration, double rate) override {
    // Unknowns on a bound and drawn outwards stay there; else their part of the step would spoil that of the
    // others.
    std::vector<int> fixed;
    for (std::size_t i = 0; i < theta.size(); ++i)
      if ((theta[i] == objective.lower()[i] && now.gradient[i] >= 0) ||
          (theta[i] == objective.upper()[i] && now.gradient[i] <= 0))
        fixed.push_back(static_cast<int>(i));
    rejected_ = false;
    if (!(max_expected_decrease(now) > 0) || fixed.size() == theta.size()) return theta;
    const QuadraticModel model = quadratic_model(now);
    auto* loss = new CondensedLoss(objective, now, model, theta, iteration);
    ceres::Problem problem;
    const int n = static_cast<int>(theta.size());
    std::vector<double> u(theta.size(), 0.0);
    problem.AddResidualBlock(loss, nullptr, u.data());  // owns it
    for (int i = 0; i < n; ++i) {
      problem.SetParameterLowerBound(u.data(), i, (objective.lower()[i] - theta[i]) * model.scale[i]);
      problem.SetParameterUpperBound(u.data(), i, (objective.upper()[i] - theta[i]) * model.scale[i]);
    }
    if (!fixed.empty()) problem.SetManifold(u.data(), new ceres::SubsetManifold(n, fixed));
    ceres::Solver::Options options;
    options.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
    options.linear_solver_type = ceres::DENSE_QR;
    options.jacobi_scaling = false;  // the model is scaled already, and without any absolute term
    options.initial_trust_region_radius = radius_;
    options.max_num_iterations = kMostTrials;
    options.min_relative_decrease = kLeastOfPredictedFall;
    options.max_num_line_search_step_size_iterations = 0;  // steps over a bound end on it
    options.function_tolerance = options.parameter_tolerance = options.gradient_tolerance = 0;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    silence_ceres();
    ceres::Solve(options, &problem, &summary);
    loss->rethrow();
    if (!summary.iterations.empty())
      radius_ = std::clamp(summary.iterations.back().trust_region_radius, kLeastRadius, kFirstRadius);
    std::vector<double> next = loss->point(u.data());
    rejected_ = next == theta;
    return part_way(theta, std::move(next), rate);
  }
  bool rejected() const override { return rejected_; }
  bool scatters() const override { return true; }
  void reset() override { radius_ = kFirstRadius; }
  OptimizerState state() const override { return {{"radius", {radius_}}}; }
  void restore(const OptimizerState& state) override { radius_ = state.at("radius").at(0); }

 private:
  static constexpr int kMostTrials = 5;
  /// Of the trust region, relative to the model's unit diagonal: damping is 1 / radius. The first hardly damps,
  /// the least halves a step: noise can make all trials of an iteration fail, which must not stop the next.
  static constexpr double kFirstRadius = 1e4, kLeastRadius = 1;
  /// A step is taken where the loss falls by more than this part of what the model says. Where it falls by less the model does
  /// not hold that far: a step that loses sight of all light, say, may lower the loss of a wrong start.
  static constexpr double kLeastOfPredictedFall = 0.25;
  double radius_ = kFirstRadius;
  bool rejected_ = false;
};

}  // namespace

std::unique_ptr<Optimizer> make_levenberg_marquardt() {
  return std::make_unique<LevenbergMarquardt>();
}

}  // namespace isochron
