#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "optim/problem/vector_math.h"
#include "optim/solvers/ceres_calls.h"
#include "optim/solvers/optimizer.h"

namespace isochron {
namespace {

/// The loss of one iteration as a function of u, theta_i = start_i + unit_i u_i, times a factor that makes
/// the gradient's largest component 1 at u = 0, so that Ceres's first trial step is minus the gradient. The
/// units are such that this step moves the unknown that moves most by `step`, and that unknowns of other
/// units of measurement come near each other: in proportion to 1 / sqrt(size_i), `size` the usual size of the
/// gradient's component, the step moves each by about as much in its own unit.
class ScaledLoss : public ceres::FirstOrderFunction {
 public:
  ScaledLoss(const Objective& objective, const Evaluation& now, const std::vector<double>& start,
             std::uint32_t iteration, double step, const std::vector<double>& size)
      : objective_(objective),
        start_(start),
        iteration_(iteration),
        unit_(start.size(), 0.0),
        first_(&now),
        best_(start),
        best_loss_(now.loss) {
    for (std::size_t i = 0; i < start.size(); ++i) {
      lower_.push_back(std::max(objective.lower()[i], start[i] - kReach * step));
      upper_.push_back(std::min(objective.upper()[i], start[i] + kReach * step));
    }
    double largest = 0, largest_move = 0;
    for (std::size_t i = 0; i < start.size(); ++i) {
      if (size[i] > 0) unit_[i] = 1 / std::sqrt(size[i]);
      if (blocked(i, start[i], now.gradient[i])) continue;
      largest = std::max(largest, unit_[i] * std::abs(now.gradient[i]));
      largest_move = std::max(largest_move, unit_[i] * unit_[i] * std::abs(now.gradient[i]));
    }
    const double factor = step * largest / largest_move;
    for (double& unit : unit_) unit *= factor;
    scale_ = 1 / (factor * largest);
  }

  /// Whether the bounds leave the loss anywhere to fall to.
  bool can_move() const { return std::isfinite(scale_); }
  const std::vector<double>& best() const { return best_; }
  void rethrow() const { guarded_.rethrow(); }

  int NumParameters() const override { return static_cast<int>(start_.size()); }

  bool Evaluate(const double* u, double* cost, double* gradient) const override {
    return guarded_([&] {
      const std::size_t n = start_.size();
      std::vector<double> free(n), theta(n);
      for (std::size_t i = 0; i < n; ++i) {
        free[i] = start_[i] + unit_[i] * u[i];
        theta[i] = std::clamp(free[i], lower_[i], upper_[i]);
      }
      Evaluation fresh;
      const Evaluation* e = &fresh;
      if (theta == start_)
        e = first_;
      else if (gradient)
        fresh = objective_.evaluate(theta, iteration_);
      else
        fresh.loss = objective_.loss(theta, iteration_);
      if (!std::isfinite(e->loss)) return false;
      if (e->loss < best_loss_) {
        best_loss_ = e->loss;
        best_ = theta;
      }
      *cost = scale_ * e->loss;
      if (gradient)
        for (std::size_t i = 0; i < n; ++i) {
          if (!std::isfinite(e->gradient[i])) return false;
          gradient[i] = blocked(i, free[i], e->gradient[i]) ? 0 : scale_ * unit_[i] * e->gradient[i];
        }
      return true;
    });
  }

 private:
  /// Whether unknown i cannot follow its descent: on a bound and drawn outwards, or beyond it.
  bool blocked(std::size_t i, double value, double slope) const {
    const double lower = lower_[i], upper = upper_[i];
    return value < lower || value > upper || (value == lower && slope > 0) || (value == upper && slope < 0);
  }

  static constexpr double kReach = 10;  ///< of an iteration, in first steps: a curvature made of noise leads anywhere
  const Objective& objective_;
  std::vector<double> lower_, upper_;
  std::vector<double> start_;
  std::uint32_t iteration_;
  double scale_;
  std::vector<double> unit_;
  const Evaluation* first_;
  GuardedCalls guarded_;
  mutable std::vector<double> best_;
  mutable double best_loss_;
};

/// L-BFGS of Ceres. One iteration makes up to `inner_iterations` steps, each with a line search (strong Wolfe conditions), all on
/// the random numbers of that iteration; the pairs that approximate the curvature are gathered again, since they hold only
/// for one and the same function. The point of least loss among all that were tried is kept. Bounds: the loss is evaluated at
/// the nearest point within them and is constant beyond. The first trial step of each iteration has the length `first_step`
/// (largest component, > 0); no unknown moves further than 10 times that in one iteration.
class Lbfgs : public Optimizer {
 public:
  Lbfgs(double first_step, int inner_iterations) : first_step_(first_step), inner_iterations_(inner_iterations) {}

  std::vector<double> step(const Objective& objective, Evaluation now, const std::vector<double>& theta,
                           std::uint32_t iteration, double rate) override {
    auto* loss = new ScaledLoss(objective, now, theta, iteration, first_step_, gradient_size(now.gradient));
    const ceres::GradientProblem problem(loss);  // owns it
    rejected_ = false;
    if (!loss->can_move()) return theta;
    ceres::GradientProblemSolver::Options options;
    options.line_search_direction_type = ceres::LBFGS;
    options.line_search_type = ceres::WOLFE;
    options.max_num_iterations = inner_iterations_;
    options.max_num_line_search_step_size_iterations = kMostTrials;
    options.max_num_line_search_direction_restarts = 0;  // what no line search finds here, the next iteration may
    options.function_tolerance = options.parameter_tolerance = options.gradient_tolerance = 0;
    options.logging_type = ceres::SILENT;
    std::vector<double> u(theta.size(), 0.0);
    ceres::GradientProblemSolver::Summary summary;
    silence_ceres();
    ceres::Solve(options, problem, u.data(), &summary);
    // A line search that noise keeps from success is no failure: what counts is the least loss that was
    // found.
    loss->rethrow();
    std::vector<double> next = loss->best();
    rejected_ = next == theta;
    return part_way(theta, std::move(next), rate);
  }
  bool rejected() const override { return rejected_; }
  bool scatters() const override { return true; }
  void reset() override { squares_.clear(); }
  OptimizerState state() const override { return {{"squares", squares_}}; }
  void restore(const OptimizerState& state) override { squares_ = state.at("squares"); }

 private:
  /// Root of the running mean of the square of each component, a factor common to all left out.
  std::vector<double> gradient_size(const std::vector<double>& gradient) {
    squares_.resize(gradient.size(), 0.0);
    std::vector<double> size;
    for (std::size_t i = 0; i < gradient.size(); ++i) {
      squares_[i] = 0.9 * squares_[i] + 0.1 * gradient[i] * gradient[i];
      size.push_back(std::sqrt(squares_[i]));
    }
    return size;
  }

  static constexpr int kMostTrials = 8;  ///< of one line search
  double first_step_;
  int inner_iterations_;
  std::vector<double> squares_;
  bool rejected_ = false;
};

}  // namespace

std::unique_ptr<Optimizer> make_lbfgs(const OptimizerSpec& spec) {
  return std::make_unique<Lbfgs>(spec.learning_rate, spec.inner_iterations);
}

}  // namespace isochron
