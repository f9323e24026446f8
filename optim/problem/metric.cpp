#include "optim/problem/metric.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <stdexcept>

namespace isochron {
namespace {

/// Keeps a patch that no reading sees from being singular: only differences within it are known.
constexpr double kMore = 1 + 0x1p-30;

}  // namespace

/// Of the free unknowns, in their order; of the matrix the lower triangle.
struct Metric::Factors {
  Eigen::SparseMatrix<double> matrix;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> cholesky;
};

Metric::~Metric() = default;

Metric::Metric(const std::vector<double>& diagonal, const std::vector<Coupling>& couplings,
               std::vector<std::size_t> free)
    : diagonal_(diagonal), free_(std::move(free)) {
  if (couplings.empty()) return;
  std::vector<int> place(diagonal.size(), -1);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < free_.size(); ++k) {
    place[free_[k]] = static_cast<int>(k);
    entries.emplace_back(static_cast<int>(k), static_cast<int>(k), kMore * diagonal[free_[k]]);
  }
  for (const Coupling& c : couplings) {
    const int a = place[c.a], b = place[c.b];
    if (a < 0 || b < 0) continue;
    entries.emplace_back(std::max(a, b), std::min(a, b), c.curvature);
  }
  const auto n = static_cast<Eigen::Index>(free_.size());
  auto factors = std::make_unique<Factors>();
  factors->matrix.resize(n, n);
  factors->matrix.setFromTriplets(entries.begin(), entries.end());
  factors->cholesky.compute(factors->matrix);
  if (factors->cholesky.info() != Eigen::Success) throw std::logic_error("metric: the matrix is not definite");
  factors_ = std::move(factors);
}

/// What becomes of the free unknowns: one by one without couplings, else all together, in their order.
template <class Single, class Together>
std::vector<double> Metric::of_free(const std::vector<double>& v, Single&& single, Together&& together) const {
  std::vector<double> result(v.size(), 0.0);
  if (!factors_) {
    for (const std::size_t i : free_) result[i] = single(i, v[i]);
    return result;
  }
  Eigen::VectorXd values(factors_->matrix.rows());
  for (std::size_t k = 0; k < free_.size(); ++k) values[static_cast<Eigen::Index>(k)] = v[free_[k]];
  values = together(values);
  for (std::size_t k = 0; k < free_.size(); ++k) result[free_[k]] = values[static_cast<Eigen::Index>(k)];
  return result;
}

double Metric::dot(const std::vector<double>& a, const std::vector<double>& b) const {
  double sum = 0;
  for (const std::size_t i : free_) sum += a[i] * b[i];
  return sum;
}

std::vector<double> Metric::times(const std::vector<double>& v) const {
  return of_free(
      v, [this](std::size_t i, double value) { return diagonal_[i] * value; },
      [this](const Eigen::VectorXd& values) -> Eigen::VectorXd {
        return factors_->matrix.selfadjointView<Eigen::Lower>() * values;
      });
}

std::vector<double> Metric::solve(const std::vector<double>& v) const {
  return of_free(
      v, [this](std::size_t i, double value) { return value / diagonal_[i]; },
      [this](const Eigen::VectorXd& values) -> Eigen::VectorXd { return factors_->cholesky.solve(values); });
}

}  // namespace isochron
