// Standard errors by the eigenvectors of the whole Gauss-Newton matrix.
#pragma once
#include "optim/problem/standard_errors.h"

namespace isochron {

/// Most unknowns whose matrix is factorised: its eigenvalues take 2 s of a core, its memory is 8 MB.
inline constexpr int kMostTogether = 1000;

/// Noise pushes eigenvalues of the scaled matrix below zero as far as above: those smaller than the most negative one is large
/// may be zero, and count as that. An unknown is undetermined where such directions make more than half of its
/// variance. `gradients`: of the loss, penalty included, each from random numbers of its own. See Determined for `blocks` to `theta`.
ParameterErrors joint_errors(const Curvatures& curvatures, const std::vector<std::vector<double>>& gradients,
                             const NoiseLevel& noise, const std::vector<Parameters::Block>& blocks,
                             const std::vector<std::string>& names, const std::vector<double>& theta);

}  // namespace isochron
