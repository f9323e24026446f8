// Images, derivatives and gradients with standard errors from replicates: independent estimates that share the samples.
#pragma once
#include <string>
#include <vector>

#include "core/image/stored_image.h"
#include "optim/problem/problem.h"
#include "optim/problem/statistics.h"

namespace isochron {

/// Replicates at most (see replicate_count) of derivatives and gradients, and of those that are checked: enough degrees of
/// freedom for a sharp test.
inline constexpr int kMostReplicates = 8, kMostCheckReplicates = 16;

struct ImageEstimate {
  StoredImage image;
  Statistics gates;  ///< of the average over pixels and channels, one entry per gate
};

/// The gated images at theta. Throws InputError when samples.primal is below 2.
ImageEstimate estimate_image(const Problem& problem, const std::vector<double>& theta, std::uint32_t iteration = 0);

/// One component of the derivative images of a range of unknowns.
struct DerivativeEstimate {
  std::string component;            ///< total, interior, visibility or path_length
  std::vector<StoredImage> images;  ///< one per unknown
  std::vector<Statistics> gates;    ///< one per unknown, as in ImageEstimate
};

/// Derivative images of the unknowns [first, first + count) at theta: `total` first, then the terms with
/// samples. The finite-difference method gives only `total`, from samples.primal. Throws InputError when a
/// term has one sample.
std::vector<DerivativeEstimate> estimate_derivatives(const Problem& problem, const std::vector<double>& theta,
                                                     int first, int count, int most_replicates = kMostReplicates);

/// The same of one unknown, along which all others move as `tangent` says, with the random numbers of an iteration.
std::vector<DerivativeEstimate> estimate_tangent(const Problem& problem, const std::vector<double>& theta,
                                                 const std::vector<double>& tangent, std::uint32_t iteration = 0);

struct GradientEstimate {
  Statistics gradient;  ///< one entry per unknown; replicates of residual and derivative
};

/// Number of replicates that estimate_gradient makes. Throws InputError when a term has one sample, or images have fewer than
/// four under a Poisson likelihood, each replicate of which needs two halves.
int gradient_repeats(const Problem& problem);

/// The gradient of the loss at theta. All replicates together use the experiment's samples once. Throws as
/// above.
GradientEstimate estimate_gradient(const Problem& problem, const std::vector<double>& theta, const GatedImage& target);

}  // namespace isochron
