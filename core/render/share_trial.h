// What each share of ellipsoidal connections costs, from one trial.
#pragma once
#include <array>
#include <optional>

#include "core/render/passes.h"

namespace isochron {

/// The shares that are compared.
inline constexpr std::array kConnectionShares = {0.0, 0.25, 0.5, 0.75, 1.0};

struct ShareTrial {
  const Scene& scene;
  const GateSet& gates;
  EstimatorOptions options;    ///< those of the estimates that are decided about; light subpaths are given
  const TangentBasis* column;  ///< the interior term of the derivative along it; null: images
  int block;                   ///< variances are those of sums over so many pixels by as many
  int samples, batches;        ///< per pixel and batch
  double most_samples;  ///< whose work it may take at most, of the kind that takes less: else there are fewer batches
};

struct ShareCosts {
  /// Variance x work of one batch, by kConnectionShares; infinite where nothing is seen. Empty: of one batch.
  std::optional<std::array<double, kConnectionShares.size()>> cost;
  double affordable_batches;  ///< that take the work of most_samples
};

/// Half of the samples are connections. Another share gives a contribution another weight and each kind of samples another number. So the
/// images that it would give are known from the same samples, and what shares have in common does not blur by how much
/// they differ. `work` grows by what that took (see Renderer::work).
ShareCosts measure_shares(const ShareTrial& trial, const Stream& stream, double& work);

}  // namespace isochron
