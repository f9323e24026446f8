// Projected L-BFGS whose metric is the diagonal of the Gauss-Newton matrix and the whole matrix of a penalty, so that steps move
// patches where smoothing ties neighbours. That diagonal knows the units of all unknowns, so that metres, degrees, albedos and
// counts need no rates; pairs of steps and changes of the gradient add how the unknowns
// act together. Products with the Jacobian, as conjugate gradients on the Gauss-Newton matrix would take, cost as much as
// gradients of the loss itself, which know more than a linearisation; optim/README.md has a comparison.
#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

#include "optim/problem/metric.h"
#include "optim/problem/vector_math.h"
#include "optim/solvers/optimizer.h"

namespace isochron {
namespace {

constexpr std::size_t kMostPairs = 20;
constexpr int kMostTrials = 6;
/// Probes that count: older ones are forgotten, as the curvature changes along the way.
constexpr double kMostProbes = 16;

using Vector = std::vector<double>;

bool finite(const Evaluation& at) {
  return std::isfinite(at.loss) &&
         std::all_of(at.gradient.begin(), at.gradient.end(), [](double g) { return std::isfinite(g); });
}

/// One iteration makes up to `inner_iterations` steps, all on its random numbers. Diagonal, which random signs estimate, and pairs
/// are carried from one iteration to the next: each pair is a difference on common random numbers, whichever they were.
class QuasiNewton : public Optimizer {
 public:
  explicit QuasiNewton(int inner_iterations) : inner_iterations_(inner_iterations) {}

  Vector step(const Objective& objective, Evaluation now, const Vector& theta, std::uint32_t iteration,
              double rate) override {
    update_diagonal(objective, now, theta, iteration);
    couplings_ = objective.couplings();
    metric_.reset();
    rejected_ = true;
    Vector at = theta;
    const double noise = now.loss_noise;
    Evaluation here = std::move(now);
    for (int i = 0; i < inner_iterations_; ++i) {
      Search search = descend(objective, iteration, at, here);
      if (search == Search::failed && !pairs_.empty()) {  // the pairs may be to blame
        pairs_.clear();
        search = descend(objective, iteration, at, here);
      }
      if (search != Search::moved) break;
      rejected_ = false;
    }
    stuck_ = rejected_ && promised_ > noise;
    if (stuck_) reset();  // what was learnt elsewhere does not hold here
    return part_way(theta, std::move(at), rate);
  }
  bool rejected() const override { return rejected_; }
  bool stuck() const override { return stuck_; }
  bool scatters() const override { return true; }
  void reset() override {
    metric_.reset();
    diagonal_.clear();
    probes_ = 0;
    pairs_.clear();
  }
  OptimizerState state() const override {
    OptimizerState state{{"diagonal", diagonal_}, {"probes", {probes_}}, {"steps", {}}, {"changes", {}}};
    for (const Pair& pair : pairs_) {
      state["steps"].insert(state["steps"].end(), pair.step.begin(), pair.step.end());
      state["changes"].insert(state["changes"].end(), pair.change.begin(), pair.change.end());
    }
    return state;
  }
  void restore(const OptimizerState& state) override {
    reset();
    diagonal_ = state.at("diagonal");
    probes_ = state.at("probes").at(0);
    const Vector &steps = state.at("steps"), &changes = state.at("changes");
    const auto n = static_cast<std::ptrdiff_t>(diagonal_.size());
    for (std::ptrdiff_t i = 0; i < std::ssize(steps); i += n)
      pairs_.push_back({{steps.begin() + i, steps.begin() + i + n}, {changes.begin() + i, changes.begin() + i + n}});
  }

 private:
  /// Of the unknowns and of the gradient, both on the same random numbers.
  struct Pair {
    Vector step, change;
  };

  void update_diagonal(const Objective& objective, const Evaluation& now, const Vector& theta,
                       std::uint32_t iteration) {
    const Probes probes{.count = diagonal_.empty() ? kProbesOfDiagonal : 1};
    diagonal_.resize(theta.size(), 0.0);
    for (const Vector& found : objective.probe_curvature(theta, iteration, now, probes)) {
      if (!std::all_of(found.begin(), found.end(), [](double d) { return std::isfinite(d); })) continue;
      probes_ = std::min(probes_ + 1, kMostProbes);
      for (std::size_t i = 0; i < found.size(); ++i) diagonal_[i] += (found[i] - diagonal_[i]) / probes_;
    }
  }

  /// How a line search ended: at a lower loss, where noise hides whether there is one, or without one.
  enum class Search { moved, noise, failed };

  /// A point along the projected direction.
  struct Trial {
    double slope;  ///< that of the loss at the start times the way there
    Vector theta;
    Evaluation at;
  };

  /// One line search. Trials take the gradient with the loss, since the first is nearly always the one. Noise of the Jacobian
  /// makes the diagonal too large and steps too short; so they also become longer. The gradient, whose derivatives have random
  /// numbers of their own, is not that of the loss on this iteration's: where less of a fall is left to be promised by it than the
  /// loss's standard error, its slope says little of the loss, and shorter trials would follow the noise.
  Search descend(const Objective& objective, std::uint32_t iteration, Vector& at, Evaluation& here) {
    constexpr double kLonger = 2;  // by how much, where the loss still falls there
    const Vector direction = find_direction(at, here.gradient, objective.lower(), objective.upper());
    std::optional<Trial> best;
    double length = 1;
    for (int i = 0; i < kMostTrials; ++i) {
      const double least = i > 0 && here.loss_noise > 0 ? here.loss_noise : 0;
      Trial trial = try_length(objective, iteration, at, here, direction, length, least);
      if (i == 0) promised_ = -trial.slope;
      if (!(-trial.slope > least)) {
        if (!best && trial.slope < 0) return Search::noise;
        break;
      }
      constexpr double kLeastFall = 1e-4;  // Armijo's condition
      const bool falls = finite(trial.at) && trial.at.loss <= here.loss + kLeastFall * trial.slope;
      if (best && (!falls || trial.at.loss >= best->at.loss)) break;
      // To the minimum of the parabola through both losses and the slope.
      const double excess = trial.at.loss - here.loss - trial.slope;
      const double factor = excess > 0 ? -trial.slope / (2 * excess) : std::isfinite(excess) ? kLonger : 0;
      if (falls) {
        best = std::move(trial);
        if (factor < kLonger) break;
        length *= kLonger;
      } else {
        length *= std::clamp(factor, 0.1, 0.5);
      }
    }
    if (!best) return Search::failed;
    remember(at, here.gradient, best->theta, best->at.gradient);
    at = std::move(best->theta);
    here = std::move(best->at);
    return Search::moved;
  }

  /// Evaluates the loss where the slope promises a fall of more than `least`.
  static Trial try_length(const Objective& objective, std::uint32_t iteration, const Vector& at, const Evaluation& here,
                          const Vector& direction, double length, double least) {
    Trial trial{0, at, {}};
    for (std::size_t i = 0; i < at.size(); ++i) {
      trial.theta[i] = std::clamp(at[i] + length * direction[i], objective.lower()[i], objective.upper()[i]);
      trial.slope += here.gradient[i] * (trial.theta[i] - at[i]);
    }
    if (-trial.slope > least) trial.at = objective.evaluate(trial.theta, iteration);
    return trial;
  }

  void remember(const Vector& from, const Vector& gradient_from, const Vector& to, const Vector& gradient_to) {
    Pair pair{to, gradient_to};
    double curvature = 0;
    for (std::size_t i = 0; i < to.size(); ++i) {
      pair.step[i] -= from[i];
      pair.change[i] -= gradient_from[i];
      curvature += pair.step[i] * pair.change[i];
    }
    if (!(curvature > 0)) return;
    pairs_.push_back(std::move(pair));
    if (pairs_.size() > kMostPairs) pairs_.pop_front();
  }

  /// The two loops of L-BFGS over the unknowns that may move: those at a bound and drawn outwards stay there, else their part
  /// of the step would spoil that of the others. An unknown that nothing depends on has no curvature and does not move.
  Vector find_direction(const Vector& at, const Vector& gradient, const Vector& low, const Vector& high) {
    std::vector<std::size_t> free;
    for (std::size_t i = 0; i < at.size(); ++i)
      if (diagonal_[i] > 0 && !(at[i] <= low[i] && gradient[i] >= 0) && !(at[i] >= high[i] && gradient[i] <= 0))
        free.push_back(i);
    // The inner iterations share it, but for unknowns that reach a bound or leave one.
    if (!metric_ || metric_->free() != free) metric_.emplace(diagonal_, couplings_, std::move(free));
    const Metric& metric = *metric_;
    Vector direction(at.size(), 0.0);
    for (const std::size_t i : metric.free()) direction[i] = -gradient[i];
    struct Used {
      const Pair* pair;
      double curvature, factor;
    };
    std::vector<Used> used;
    double scale = 1;
    for (auto pair = pairs_.rbegin(); pair != pairs_.rend(); ++pair) {
      // Among the free unknowns a pair can have lost its positive curvature.
      constexpr double kLeastCosine = 1e-5;
      const double curvature = metric.dot(pair->step, pair->change);
      const double change = metric.dot(pair->change, metric.solve(pair->change));
      if (!(curvature > kLeastCosine * std::sqrt(change * metric.dot(pair->step, metric.times(pair->step))))) continue;
      if (used.empty()) scale = curvature / change;
      used.push_back({&*pair, curvature, metric.dot(pair->step, direction) / curvature});
      for (const std::size_t i : metric.free()) direction[i] -= used.back().factor * pair->change[i];
    }
    direction = metric.solve(direction);
    for (const std::size_t i : metric.free()) direction[i] *= scale;
    for (auto each = used.rbegin(); each != used.rend(); ++each) {
      const double factor = each->factor - metric.dot(each->pair->change, direction) / each->curvature;
      for (const std::size_t i : metric.free()) direction[i] += factor * each->pair->step[i];
    }
    return direction;
  }

  int inner_iterations_;
  Vector diagonal_;
  double probes_ = 0;
  std::deque<Pair> pairs_;           ///< the newest last
  std::vector<Coupling> couplings_;  ///< of this iteration's objective
  std::optional<Metric> metric_;     ///< of this iteration, once it is asked for
  double promised_ = 0;              ///< fall of the loss by the slope of the last search's full step
  bool rejected_ = false, stuck_ = false;
};

}  // namespace

std::unique_ptr<Optimizer> make_quasi_newton(const OptimizerSpec& spec) {
  return std::make_unique<QuasiNewton>(spec.inner_iterations);
}

}  // namespace isochron
