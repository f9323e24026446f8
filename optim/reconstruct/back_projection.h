// Filtered back-projection of a capture: where surfaces would have to be to explain when light came back.
#pragma once
#include <cstdint>
#include <vector>

#include "optim/reconstruct/time_filter.h"
#include "optim/reconstruct/wall_frame.h"

namespace isochron {

/// Advice where a capture takes more memory than there is.
inline constexpr const char* kLessOfCapture = "leave points or bins out";

struct BackProjectionOptions {
  /// Probability that background light alone makes any voxel of the whole volume significant; in (0, 1).
  double false_alarms = 0.01;
};

/// A box of the space in front of the wall that holds all that is significant, some voxels of margin around it.
struct BackProjection {
  WallFrame frame;
  /// Middles of the voxels in the wall's frame, metres, evenly spaced. Empty, all of them, where nothing is significant.
  std::vector<double> across, up, depth;
  /// [depth][up][across]. The sum of filtered counts over what a small diffuse patch of albedo 1 would send back, times a factor
  /// that is the same everywhere: proportional to an albedo. Zero where the search, coarse to fine, has not come to.
  std::vector<float> albedo;
  /// The sum in standard deviations by the counts' own Poisson variance; zero as above, and where light that comes in time for some
  /// points by chance explains it.
  std::vector<float> significance;

  /// A voxel is a surface's where its significance and its albedo reach these. The first keeps the false alarms of noise at what was
  /// asked for. The second keeps out what light of
  /// surfaces elsewhere adds up to: see surface_threshold.
  double least_significance = 0, least_albedo = 0;
  TimeFilter filter;
  /// Resolution along the depth, and across it at the distance of the light. Metres. Twice the voxels' sides.
  double depth_resolution = 0, lateral_resolution = 0;
  /// Across it, as far as the detector's response alone limits it, where the ways from the spots and to the sensor points
  /// both change.
  double finest_resolution = 0;

  std::size_t index(std::size_t d, std::size_t u, std::size_t a) const {
    return (d * up.size() + u) * across.size() + a;
  }
  bool is_surface(std::size_t i) const { return significance[i] >= least_significance && albedo[i] >= least_albedo; }
};

/// Throws InputError where no point can be used, or bins are too few for the filter. `used`: one number per sensor point, zero
/// for dead ones; empty: all.
///
/// The filter is a gaussian as wide as the response at half of its height (a bin's width taken in), and no narrower than
/// - a bin;
/// - what makes one surface of neighbouring points' ellipsoids: the filtered response is positive over two standard deviations,
///   which is no less than by how much the ways to two neighbours differ at the wall's edge for light from its middle's front.
/// Coarse to fine by factors of two in filter and voxels, with points in groups that the coarser filter does not tell apart; finer
/// where the sum, of either sign, is significant.
BackProjection back_project(const CaptureFile& capture, const DetectorResponse& response = {},
                            const std::vector<std::uint8_t>& used = {}, const BackProjectionOptions& options = {});

}  // namespace isochron
