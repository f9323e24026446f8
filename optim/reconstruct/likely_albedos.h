// Which albedos of voxels make a capture's counts most likely.
#pragma once
#include <vector>

#include "optim/reconstruct/back_projection.h"

namespace isochron {

/// Of small diffuse patches that face nowhere in particular and hide nothing.
struct LikelyAlbedos {
  WallFrame frame;
  /// Middles of the voxels in the wall's frame, metres, evenly spaced.
  std::vector<double> across, up, depth;
  /// [depth][up][across], up to a factor; zero where back-projection shows nothing nearby.
  std::vector<float> albedo;
  /// Across the lines of sight, as far as the detector's response limits it, not the points' distance.
  double resolution = 0;

  std::size_t index(std::size_t d, std::size_t u, std::size_t a) const {
    return (d * up.size() + u) * across.size() + a;
  }
};

/// Back-projection blurs: in gaps and beyond outlines it shows half as much as at steep parts of the surface. What is sought
/// here explains the counts instead, none of it negative: expectation maximisation for Poisson numbers (Shepp and Vardi 1982), a step from
/// some of the histograms at a time (Hudson and Larkin 1994). It is stopped long before it converges, which keeps noise out of it.
/// Voxels are half as wide as those of the back-projection, no further than a resolution from what that takes for a surface. `histograms` are
/// in the frame of the volume. The same bits for any number of threads.
LikelyAlbedos likely_albedos(const BackProjection& volume, const Histograms& histograms,
                             const DetectorResponse& response);

}  // namespace isochron
