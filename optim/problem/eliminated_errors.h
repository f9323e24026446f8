// Standard errors of few unknowns among many, whose matrix is not written out.
#pragma once
#include <vector>

#include "optim/problem/conjugate_gradients.h"
#include "optim/problem/standard_errors.h"

namespace isochron {

/// A Gauss-Newton matrix H + P of which products can be had; see RenderedCurvature.
class CurvatureProducts {
 public:
  virtual ~CurvatureProducts() = default;
  /// (H + P) v of each vector, with an H that is always the same, without bias.
  virtual std::vector<std::vector<double>> products(const std::vector<std::vector<double>>& vectors) const = 0;
  /// Over the combinations of unknowns that `columns` hold, from other random numbers than the products.
  virtual Curvatures within(const std::vector<std::vector<double>>& columns) const = 0;
  /// For the products, of these unknowns; 0 for others.
  virtual ApproximateInverse preconditioner(std::vector<std::size_t> free) const = 0;
};

/// For each function w of the unknowns that is asked for, (H + P) x = w is solved by conjugate gradients: what all other unknowns can take over
/// is eliminated. The variance is then (w'x)^2 / x'(H + P)x, with H from
/// other random numbers, which is right to second order in the error of x, and where x is not the solution too small. They end
/// once their last four steps added less than 5 % to the variance, after 24 at most; the variance is then a lower bound.
/// A solution that has followed the noise of the products is found again within what stands out of that (kAboveNoise).
/// `diagonal`: of H + P, `smoothed`: of P. Asked for are parameters of few components; fields have the errors of the diagonal, as
/// if all else were known.
ParameterErrors eliminated_errors(const CurvatureProducts& curvature, const std::vector<double>& diagonal,
                                  const std::vector<double>& smoothed,
                                  const std::vector<std::vector<double>>& gradients, const NoiseLevel& noise,
                                  const std::vector<Parameters::Block>& blocks, const std::vector<std::string>& names,
                                  const std::vector<double>& theta);

}  // namespace isochron
