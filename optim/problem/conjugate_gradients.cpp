#include "optim/problem/conjugate_gradients.h"

#include <algorithm>
#include <numeric>

#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

constexpr int kLastSteps = 4;

using Vector = std::vector<double>;

/// Of one right-hand side.
class Solution {
 public:
  Solution(const Vector& right_side, const ApproximateInverse& precondition, const SolutionLimits& limits)
      : precondition_(precondition), limits_(limits), x_(right_side.size(), 0.0), residual_(right_side) {
    direction_ = precondition_(residual_);
    expected_ = square_ = dot(residual_, direction_);
    ended_ = !(square_ > 0);
  }
  const Vector& x() const { return x_; }
  const Vector& direction() const { return direction_; }
  bool ended() const { return ended_; }

  /// `product`: that of the matrix with the direction.
  void step(const Vector& product) {
    const double curvature = dot(direction_, product);
    if (!(curvature > limits_.least_curvature * expected_)) {  // noise is all that is left
      ended_ = true;
      return;
    }
    const double length = square_ / curvature;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      x_[i] += length * direction_[i];
      residual_[i] -= length * product[i];
    }
    gains_.push_back(length * square_);  // they add up to x'b
    const Vector next = precondition_(residual_);
    const double square = dot(residual_, next);
    const double kept = square / square_;
    for (std::size_t i = 0; i < x_.size(); ++i) direction_[i] = next[i] + kept * direction_[i];
    expected_ = square + kept * kept * expected_;  // the residual is at right angles to the former direction
    square_ = square;
    const auto count = static_cast<int>(gains_.size());
    const double last = std::accumulate(gains_.end() - std::min(kLastSteps, count), gains_.end(), 0.0);
    ended_ = !(square_ > 0) || count == limits_.most_steps ||
             (count > kLastSteps && last < limits_.least_gain * std::accumulate(gains_.begin(), gains_.end(), 0.0));
  }

 private:
  const ApproximateInverse& precondition_;
  const SolutionLimits& limits_;
  Vector x_, residual_, direction_, gains_;
  double square_ = 0, expected_ = 0;  ///< expected: curvature along the direction, by the preconditioner
  bool ended_ = false;
};

}  // namespace

VectorList solve(const std::function<VectorList(const VectorList&)>& products, const VectorList& right_sides,
                 const ApproximateInverse& precondition, const SolutionLimits& limits) {
  std::vector<Solution> solutions;
  solutions.reserve(right_sides.size());
  for (const Vector& b : right_sides) solutions.emplace_back(b, precondition, limits);
  for (;;) {
    std::vector<Solution*> going;
    VectorList directions;
    for (Solution& solution : solutions)
      if (!solution.ended()) {
        going.push_back(&solution);
        directions.push_back(solution.direction());
      }
    if (going.empty()) break;
    const VectorList made = products(directions);
    for (std::size_t i = 0; i < going.size(); ++i) going[i]->step(made[i]);
  }
  VectorList found;
  for (const Solution& solution : solutions) found.push_back(solution.x());
  return found;
}

}  // namespace isochron
