#include "optim/problem/joint_errors.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

namespace isochron {
namespace {

using Matrix = Eigen::Map<const Eigen::MatrixXd>;  // symmetric: rows are columns
using Vector = Eigen::Map<const Eigen::VectorXd>;

/// The inverse of H + P over the unknowns that are not fixed.
class Inverse {
 public:
  Inverse(const Curvatures& curvatures, const std::vector<std::vector<double>>& gradients,
          const std::vector<bool>& fixed) {
    for (std::size_t i = 0; i < fixed.size(); ++i)
      if (!fixed[i]) free_.push_back(static_cast<int>(i));
    if (free_.empty()) return;
    const auto n = static_cast<Eigen::Index>(fixed.size());
    const Eigen::MatrixXd prior = Matrix(curvatures.prior.data(), n, n)(free_, free_);
    const Eigen::VectorXd bound = Matrix(curvatures.bound.data(), n, n).diagonal()(free_);
    inverse_width_ = (bound + prior.diagonal()).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd sum = Matrix(curvatures.data.data(), n, n)(free_, free_) + prior;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(inverse_width_.asDiagonal() * sum *
                                                               inverse_width_.asDiagonal());
    vectors_ = eigen.eigenvectors();
    values_ = eigen.eigenvalues();  // in rising order
    const double least = std::max(-values_[0], kRoundOff * values_[values_.size() - 1]);
    hidden_ = (values_.array() <= least).count();
    values_ = values_.cwiseMax(least);
    for (const std::vector<double>& gradient : gradients) {
      gradients_.push_back(parts(Vector(gradient.data(), n)));
      gradients_.back().head(hidden_).setZero();
    }
  }

  std::vector<Spread> spreads(const std::vector<std::vector<double>>& weights) const {
    std::vector<Spread> result(weights.size());
    if (free_.empty()) return result;
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const Eigen::VectorXd along = parts(Vector(weights[k].data(), static_cast<Eigen::Index>(weights[k].size())));
      const Eigen::ArrayXd variances = along.array().square() / values_.array();
      result[k].variance = variances.sum();
      for (const Eigen::VectorXd& gradient : gradients_)
        result[k].steps.push_back(-(along.array() * gradient.array() / values_.array()).sum());
      if (2 * variances.head(hidden_).sum() > result[k].variance)
        result[k].variance = std::numeric_limits<double>::infinity();
    }
    return result;
  }

 private:
  /// Of a gradient or of weights, by eigenvectors.
  Eigen::VectorXd parts(const Eigen::VectorXd& gradient) const {
    return vectors_.transpose() * gradient(free_).cwiseProduct(inverse_width_);
  }

  std::vector<int> free_;
  Eigen::VectorXd inverse_width_, values_;
  std::vector<Eigen::VectorXd> gradients_;  ///< without what noise hides
  Eigen::MatrixXd vectors_;
  Eigen::Index hidden_ = 0;  ///< eigenvalues that may be zero
};

}  // namespace

ParameterErrors joint_errors(const Curvatures& curvatures, const std::vector<std::vector<double>>& gradients,
                             const NoiseLevel& noise, const std::vector<Parameters::Block>& blocks,
                             const std::vector<std::string>& names, const std::vector<double>& theta) {
  const auto n = theta.size();
  const Matrix bound(curvatures.bound.data(), static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  const std::vector<ParameterChange> changes = parameter_changes(blocks, theta);
  std::vector<double> matrix;
  for (const ParameterChange& a : changes) {
    const Eigen::VectorXd product = bound * Vector(a.values.data(), bound.rows());
    for (const ParameterChange& b : changes) matrix.push_back(product.dot(Vector(b.values.data(), bound.rows())));
  }
  std::vector<bool> unseen(n), smoothed(n);
  for (std::size_t i = 0; i < n; ++i) {
    unseen[i] = !(curvatures.bound[i * n + i] > 0);
    smoothed[i] = curvatures.prior[i * n + i] > 0;
  }
  const Determined determined(blocks, names, theta, matrix, changes, unseen, smoothed);
  const Inverse inverse(curvatures, gradients, determined.fixed());
  ParameterErrors errors = determined.errors(noise, std::vector<bool>(n, true), {},
                                             [&](const auto& weights) { return inverse.spreads(weights); });
  errors.from = "gauss_newton_matrix";
  return errors;
}

}  // namespace isochron
