// For many unknowns of one kind: a penalty on uneven ones, a prior about their first values, and diffusion of gradients over
// the mesh.
#pragma once
#include <memory>
#include <vector>

#include "core/base/random.h"
#include "core/scene/scene.h"
#include "optim/problem/bending.h"
#include "optim/problem/objective.h"
#include "optim/problem/parameters.h"

namespace isochron {

/// A symmetric positive definite matrix applied to some blocks of the unknowns; the others are left alone.
class Preconditioner {
 public:
  Preconditioner();
  ~Preconditioner();
  Preconditioner(Preconditioner&&) noexcept;
  /// Diffusion over the mesh, (I + lambda L)^-1, for one parameter; L is the graph Laplacian of its vertices:
  /// the degree on the diagonal, -1 for each edge of the mesh between two of them. Constants stay as they
  /// are, and so do the offsets of a vertex without neighbours. Each axis of free vertices diffuses by
  /// itself. lambda > 0, dimensionless: details of up to about sqrt(lambda) edges are smoothed.
  void add_diffusion(const Scene& scene, const Parameters::VertexField& field, double lambda);
  bool empty() const;
  /// In place, theta's size.
  void apply(std::vector<double>& values) const;
  /// Blocks [begin, begin + count) of unknowns that it acts on.
  const std::vector<Parameters::Block>& blocks() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What the two sums of a QuadraticPenalty are multiplied with, in units of the loss.
struct PenaltyScale {
  double slopes = 0, priors = 0;
};

/// Sums of squares of linear forms of the unknowns: of slopes, and negative logarithms of priors.
class QuadraticPenalty {
 public:
  /// Adds `weight` times the mean, over the mesh's edges between selected vertices, of (change of offset /
  /// length)^2, with the lengths of the loaded mesh: the squared slope of the offsets, dimensionless. Albedos likewise, per
  /// squared scene unit.
  void add_slopes(const Scene& scene, const Parameters::VertexField& field, double weight);
  /// A prior: `weight` times the sum of the squared forms.
  void add_forms(const std::vector<LinearForm>& forms, double weight);
  /// A normal prior of each unknown of the block, about its value in `means`; width > 0, in the unknowns' unit.
  void add_prior(const Parameters::Block& block, const std::vector<double>& means, double width);
  bool empty() const { return squares_.empty(); }
  double value(const std::vector<double>& theta, PenaltyScale scale) const;
  void add_gradient(const std::vector<double>& theta, PenaltyScale scale, std::vector<double>& gradient) const;
  /// Adds the second derivative times `vector`.
  void add_product(PenaltyScale scale, const std::vector<double>& vector, std::vector<double>& product) const;
  /// Whether it depends on unknowns of the block.
  bool holds(const Parameters::Block& block) const;
  /// Adds the second derivative, n x n row after row.
  void add_curvature(int unknowns, PenaltyScale scale, std::vector<double>& curvature) const;
  /// The diagonal of that.
  void add_diagonal(PenaltyScale scale, std::vector<double>& diagonal) const;
  /// Adds random signs times the forms, so that the covariance of what is added is the second derivative.
  void add_noise(PenaltyScale scale, const Stream& stream, std::uint32_t draw, std::vector<double>& gradient) const;
  /// Entries of the second derivative beside the diagonal.
  std::vector<Coupling> couplings(PenaltyScale scale) const;

 private:
  struct Square {
    LinearForm form;
    double weight;
    bool prior;  ///< or of slopes
    double scaled(PenaltyScale scale) const { return weight * (prior ? scale.priors : scale.slopes); }
    bool of(const Parameters::Block& block) const {
      const int i = form.entries.empty() ? -1 : form.entries[0].first;
      return i >= block.begin && i < block.begin + block.count;
    }
  };
  std::vector<Square> squares_;
};

}  // namespace isochron
