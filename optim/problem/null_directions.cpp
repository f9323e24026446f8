#include "optim/problem/null_directions.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>

namespace isochron {
namespace {

/// Columns: an orthonormal basis of the null space of a matrix of unit diagonal.
Eigen::MatrixXd null_space(const Eigen::MatrixXd& matrix, double tolerance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  const Eigen::Index null = (eigen.eigenvalues().array() <= tolerance * eigen.eigenvalues().tail(1)[0]).count();
  return eigen.eigenvectors().leftCols(null);
}

/// What of a space has no part `row`.
Eigen::MatrixXd without(const Eigen::MatrixXd& space, Eigen::Index row) {
  const Eigen::VectorXd along = space.row(row).transpose();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(along);
  const Eigen::MatrixXd turn = qr.householderQ();
  return space * turn.rightCols(space.cols() - 1);
}

/// A power that is a whole number but for an error of `rounding`.
double tidy(double power, double rounding) {
  return std::round(power) != 0 && std::abs(power - std::round(power)) < rounding ? std::round(power) : power;
}

/// A change as a part of a direction.
struct Part {
  const ParameterChange& change;
  double size;
  double summand() const { return change.product ? size * value : size; }
  double value;  ///< of the parameter, where it is a single one
};

NullDirection::Partner partner(const Part& pivot, const Part& other, bool single, double rounding) {
  if (pivot.change.product && other.change.product) {
    const double power = tidy(-pivot.size / other.size, rounding);
    if (!single || power == std::round(power)) return {other.change.block, power, true};
  }
  return {other.change.block, tidy(-pivot.summand() / other.summand(), rounding), false};
}

}  // namespace

std::vector<ParameterChange> parameter_changes(const std::vector<Parameters::Block>& blocks,
                                               const std::vector<double>& theta) {
  std::vector<ParameterChange> changes;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const auto begin = static_cast<std::size_t>(blocks[b].begin), count = static_cast<std::size_t>(blocks[b].count);
    ParameterChange factor{static_cast<int>(b), true, std::vector<double>(theta.size(), 0.0)}, summand = factor;
    summand.product = false;
    bool zero = true, uniform = true;
    for (std::size_t i = begin; i < begin + count; ++i) {
      factor.values[i] = theta[i];
      summand.values[i] = 1;
      zero &= theta[i] == 0;
      uniform &= theta[i] == theta[begin];
    }
    if (!zero) changes.push_back(std::move(factor));
    if (zero || !uniform) changes.push_back(std::move(summand));
  }
  return changes;
}

std::vector<NullDirection> null_directions(const std::vector<double>& matrix,
                                           const std::vector<ParameterChange>& changes,
                                           const std::vector<Parameters::Block>& blocks,
                                           const std::vector<double>& theta, double tolerance, ChangeKinds kinds) {
  const double least_part = std::sqrt(tolerance);
  const auto all = static_cast<Eigen::Index>(changes.size());
  const Eigen::Map<const Eigen::MatrixXd> h(matrix.data(), all, all);
  const auto wanted = [&](const ParameterChange& change) {
    return kinds == ChangeKinds::all || blocks[change.block].count == 1 ||
           change.product == (kinds == ChangeKinds::factors);
  };
  std::vector<Eigen::Index> seen;  // others no reading depends on
  for (Eigen::Index i = 0; i < all; ++i)
    if (h(i, i) > 0 && wanted(changes[i])) seen.push_back(i);
  if (seen.empty()) return {};
  const Eigen::MatrixXd part = h(seen, seen);
  const Eigen::VectorXd unit = part.diagonal().cwiseSqrt().cwiseInverse();
  const auto single = [&](std::size_t i) { return blocks[changes[seen[i]].block].count == 1; };

  std::vector<NullDirection> found;
  Eigen::MatrixXd space = null_space(unit.asDiagonal() * part * unit.asDiagonal(), tolerance);
  while (space.cols() > 0) {
    Eigen::Index pivot = -1;
    for (std::size_t i = 0; i < seen.size(); ++i)
      if (const auto row = static_cast<Eigen::Index>(i);
          single(i) && (pivot < 0 || space.row(row).squaredNorm() > space.row(pivot).squaredNorm()))
        pivot = row;
    if (pivot < 0 || !(space.row(pivot).norm() > least_part)) break;
    const Eigen::VectorXd sizes = space * space.row(pivot).transpose();
    const auto part_of = [&](Eigen::Index i) {
      const ParameterChange& change = changes[seen[i]];
      return Part{change, unit[i] * sizes[i], theta[blocks[change.block].begin]};
    };
    NullDirection direction;
    direction.pivot = blocks[changes[seen[pivot]].block].begin;
    direction.change.assign(theta.size(), 0.0);
    const double scale = 1 / part_of(pivot).summand();
    for (Eigen::Index i = 0; i < sizes.size(); ++i) {
      if (std::abs(sizes[i]) < least_part * sizes.cwiseAbs().maxCoeff()) continue;
      const Part other = part_of(i);
      for (std::size_t k = 0; k < theta.size(); ++k) direction.change[k] += scale * other.size * other.change.values[k];
      if (i != pivot)
        direction.partners.push_back(partner(part_of(pivot), other, single(static_cast<std::size_t>(i)), least_part));
    }
    found.push_back(std::move(direction));
    space = without(space, pivot);
  }
  return found;
}

std::string combination_name(const std::string& pivot, const std::string& other,
                             const NullDirection::Partner& partner) {
  const double size = std::abs(partner.power);
  if (partner.product && partner.power < 0)
    return size == 1 ? fmt::format("{} / {}", pivot, other) : fmt::format("{} / {}^{:.3g}", pivot, other, size);
  if (partner.product)
    return size == 1 ? fmt::format("{} * {}", pivot, other) : fmt::format("{} * {}^{:.3g}", pivot, other, size);
  const char* sign = partner.power < 0 ? "-" : "+";
  return size == 1 ? fmt::format("{} {} {}", pivot, sign, other)
                   : fmt::format("{} {} {:.3g} {}", pivot, sign, size, other);
}

}  // namespace isochron
