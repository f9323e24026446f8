#include "optim/problem/eliminated_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

using Vector = std::vector<double>;

constexpr int kMostSteps = 24, kLastSteps = 4;
constexpr double kLeastGain = 0.05;

/// Conjugate gradients for one right-hand side. Unknowns whose `inverse_diagonal` is 0 stay 0.
class Solution {
 public:
  Solution(Vector weights, const Vector& inverse_diagonal)
      : inverse_diagonal_(inverse_diagonal), x_(weights.size(), 0.0), residual_(std::move(weights)) {
    for (std::size_t i = 0; i < x_.size(); ++i)
      if (inverse_diagonal_[i] == 0) residual_[i] = 0;
    direction_ = preconditioned();
    square_ = dot(residual_, direction_);
    ended_ = !(square_ > 0);
  }
  const Vector& x() const { return x_; }
  const Vector& direction() const { return direction_; }
  bool ended() const { return ended_; }

  /// `product`: that of the matrix with the direction.
  void step(const Vector& product) {
    const double curvature = dot(direction_, product);
    if (!(curvature > 0)) {  // noise is all that is left
      ended_ = true;
      return;
    }
    const double length = square_ / curvature;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      x_[i] += length * direction_[i];
      if (inverse_diagonal_[i] != 0) residual_[i] -= length * product[i];
    }
    gains_.push_back(length * square_);  // they add up to the variance
    const Vector next = preconditioned();
    const double square = dot(residual_, next);
    for (std::size_t i = 0; i < x_.size(); ++i) direction_[i] = next[i] + square / square_ * direction_[i];
    square_ = square;
    const auto count = std::ssize(gains_);
    const double last = std::accumulate(gains_.end() - std::min<std::ptrdiff_t>(kLastSteps, count), gains_.end(), 0.0);
    ended_ = !(square_ > 0) || count == kMostSteps ||
             (count > kLastSteps && last < kLeastGain * std::accumulate(gains_.begin(), gains_.end(), 0.0));
  }

 private:
  Vector preconditioned() const {
    Vector result = residual_;
    for (std::size_t i = 0; i < result.size(); ++i) result[i] *= inverse_diagonal_[i];
    return result;
  }

  const Vector& inverse_diagonal_;
  Vector x_, residual_, direction_, gains_;
  double square_ = 0;
  bool ended_ = false;
};

std::vector<Vector> solve(const CurvatureProducts& curvature, const std::vector<Vector>& weights,
                          const Vector& inverse_diagonal) {
  std::vector<Solution> solutions;
  for (const Vector& w : weights) solutions.emplace_back(w, inverse_diagonal);
  for (;;) {
    std::vector<Solution*> going;
    std::vector<Vector> directions;
    for (Solution& solution : solutions)
      if (!solution.ended()) {
        going.push_back(&solution);
        directions.push_back(solution.direction());
      }
    if (going.empty()) break;
    const std::vector<Vector> products = curvature.products(directions);
    for (std::size_t i = 0; i < going.size(); ++i) going[i]->step(products[i]);
  }
  std::vector<Vector> found;
  for (const Solution& solution : solutions) found.push_back(solution.x());
  return found;
}

}  // namespace

ParameterErrors eliminated_errors(const CurvatureProducts& curvature, const std::vector<double>& diagonal,
                                  const std::vector<double>& smoothed,
                                  const std::vector<std::vector<double>>& gradients, const NoiseLevel& noise,
                                  const std::vector<Parameters::Block>& blocks, const std::vector<std::string>& names,
                                  const std::vector<double>& theta) {
  const std::size_t n = theta.size();
  const std::vector<ParameterChange> changes = parameter_changes(blocks, theta);
  std::vector<Vector> columns;
  for (const ParameterChange& change : changes) columns.push_back(change.values);
  std::vector<bool> unseen(n), kept(n), asked(n);
  Vector least(n);
  for (std::size_t i = 0; i < n; ++i) {
    unseen[i] = !(diagonal[i] - smoothed[i] > kRoundOff * diagonal[i]);
    kept[i] = smoothed[i] > 0;
    least[i] = std::sqrt(noise.scale / diagonal[i]);
  }
  for (const Parameters::Block& block : blocks)
    std::fill_n(asked.begin() + block.begin, block.count, block.count <= kFewComponents);
  const Determined determined(blocks, names, theta, curvature.within(columns).bound, changes, unseen, kept);

  const auto spreads = [&](const std::vector<Vector>& weights) {
    Vector inverse_diagonal(n);
    for (std::size_t i = 0; i < n; ++i)
      if (!determined.fixed()[i]) inverse_diagonal[i] = 1 / diagonal[i];
    std::vector<Spread> result;
    if (weights.empty()) return result;
    const std::vector<Vector> solutions = solve(curvature, weights, inverse_diagonal);
    const Curvatures within = curvature.within(solutions);
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const std::size_t entry = k * weights.size() + k;
      const double curved = within.data[entry] + within.prior[entry], along = dot(weights[k], solutions[k]);
      result.push_back({curved > 0 ? along * along / curved : std::numeric_limits<double>::infinity(), {}});
      for (const Vector& gradient : gradients) result.back().steps.push_back(-dot(gradient, solutions[k]));
    }
    return result;
  };
  ParameterErrors errors = determined.errors(noise, asked, least, spreads);
  errors.from = "gauss_newton_products";
  return errors;
}

}  // namespace isochron
