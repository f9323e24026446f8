// How much of the model a loss gradient needs: fewer bounces, fewer terms, decided from independent estimates
// of the gradient with and without them.
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/render/renderer.h"

namespace isochron {

/// What is kept of the full model; terms in the order of kTerms.
struct Reduction {
  int max_bounces = 0;
  std::array<bool, 3> terms{true, true, true};
};

/// Independent estimates of the gradient of one loss for every limit of bounces, term by term. With a limit
/// both the images in the residual and their derivatives stop there, while the target does not.
class GradientReplicates {
 public:
  GradientReplicates(int max_bounces, int columns) : max_bounces_(max_bounces), columns_(columns) {}

  /// `values`: [limit][term][column].
  void add(std::vector<double> values) { replicates_.push_back(std::move(values)); }
  static std::size_t index(int limit, int term, int column, int columns) {
    return (static_cast<std::size_t>(limit) * 3 + term) * columns + column;
  }

  int size() const { return static_cast<int>(replicates_.size()); }
  int columns() const { return columns_; }
  Reduction full() const { return {max_bounces_, {true, true, true}}; }
  /// The gradient that one replicate finds with a reduced model, summed over the kept terms.
  std::vector<double> gradient(int replicate, const Reduction& kept) const;

 private:
  int max_bounces_, columns_;
  std::vector<std::vector<double>> replicates_;
};

/// |E d| over |E g|, g the full gradient and d what the reduced one differs by; norms over the columns.
struct RelativeBias {
  double value = 0, standard_error = 0;
  /// Two standard errors to either side, of d and of g. Above: infinite where g is not significantly above zero.
  double lower = 0, upper = 0;
};

/// At least two replicates. Exactly zero where no replicate differs, unless all gradients are zero: then
/// nothing is known.
RelativeBias relative_bias(const GradientReplicates& replicates, const Reduction& kept);

/// What the full model itself lacks, relative to its gradient, if what further bounces bring shrinks like
/// what the last two brought: a geometric series. Zero where there are fewer than two bounces, infinite where
/// the last brought no less.
double expected_beyond(const GradientReplicates& replicates);

struct ReductionChoice {
  Reduction kept;
  std::vector<RelativeBias> bias;      ///< of what is kept, at every point
  std::vector<std::string> undecided;  ///< what was kept for want of statistics, one line each
};

/// The smallest model whose bias, two standard errors added, is at most `tolerance` at every point, and so is
/// that of every model between it and the full one: first fewer bounces, one by one, then fewer terms, the
/// smallest first.
ReductionChoice choose_reduction(std::span<const GradientReplicates> points, double tolerance);

}  // namespace isochron
