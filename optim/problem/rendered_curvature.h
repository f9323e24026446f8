// The Gauss-Newton matrix of an experiment's readings at one point, whole or by its products.
#pragma once
#include <vector>

#include "core/films/sinks.h"
#include "optim/problem/eliminated_errors.h"
#include "optim/problem/problem.h"

namespace isochron {

/// Of a posterior. An error is known from n of them to a factor of about 1 +- 1 / sqrt(2 n), g of evidence.h from one to a standard error of
/// sqrt(3 g), and what the noise of the Jacobian adds. They share their passes, as many as share them at little cost.
inline constexpr int kPosteriorSamples = kAdjointsTogether;

/// Samples of a posterior, and with which gradients the readings pull at each.
struct PosteriorSamples {
  std::vector<std::vector<double>> unknowns;
  /// The part of the readings in what a sample solves for, from other random numbers of the images: so the products with the samples are, on
  /// average, tr((H + P)^-1 H), the number of unknowns that the readings determine, of each group of unknowns that P does not couple with others.
  std::vector<std::vector<double>> pulls;
  int count() const { return static_cast<int>(unknowns.size()); }
};

/// H of the readings and P of Problem::prior(), from random numbers that no iteration of a run has. Weights of the readings are those of an
/// image of its own.
class RenderedCurvature : public CurvatureProducts {
 public:
  /// Problem, target and theta must outlive this; theta is one that can be rendered.
  RenderedCurvature(const Problem& problem, const GatedImage& target, const std::vector<double>& theta);

  /// Over all unknowns.
  Curvatures all() const;
  /// Over the combinations of unknowns that `columns` hold, from other random numbers than the products. Not for finite
  /// differences.
  Curvatures within(const std::vector<std::vector<double>>& columns) const override;
  /// (H + P) v of each vector, with an H that is always the same: symmetric, without bias. Costs a gradient and
  /// another for every kAdjointsTogether vectors. Not for finite differences.
  std::vector<std::vector<double>> products(const std::vector<std::vector<double>>& vectors) const override;
  /// By the diagonal, and what the prior knows beside it. Must not outlive this.
  ApproximateInverse preconditioner(std::vector<std::size_t> free) const override;
  /// Some of the loss, penalty included, each from random numbers of its own (the first from those of the weights); 0 for unknowns that a
  /// bound keeps from following it.
  std::vector<std::vector<double>> gradients() const;
  /// How the unknowns scatter about the optimum, `count` times: by the noise of the readings, and by what the prior leaves
  /// open. Their covariance is (H + P)^-1, which is that of the unknowns but for variance_scale(). The Jacobian's
  /// own noise adds to it. Unknowns that lie at a bound, or that nothing depends on, stay. Not for finite differences.
  PosteriorSamples samples(int count = kPosteriorSamples) const;
  /// Diagonals of H + P, estimated and on average too large by the noise of the Jacobian (see Objective::probe_curvature), and of
  /// P, that of smoothing. The former is rendered when it is first asked for.
  const std::vector<double>& diagonal() const;
  std::vector<double> prior_diagonal() const;

 private:
  Curvatures readings(const TangentBasis& basis, std::uint32_t iteration) const;
  /// The part of the readings in the gradients that samples solve for, the mean over renderings from iteration `first` on.
  std::vector<std::vector<double>> pulls(int count, std::uint32_t first) const;

  const Problem& problem_;
  const GatedImage& target_;
  const std::vector<double>& theta_;
  const QuadraticPenalty prior_;
  PenaltyScale smoothing_, priors_, both_;  ///< of each part of the penalty, and of the whole
  Scene scene_;
  TangentBasis basis_;
  std::vector<double> weights_, first_gradient_;  ///< at theta
  mutable std::vector<double> diagonal_;          ///< empty until it is asked for
};

}  // namespace isochron
