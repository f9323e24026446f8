// What a reconstruction's experiment says that follows from the capture and its start.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/image/capture_file.h"
#include "core/scene/mesh.h"
#include "optim/reconstruct/time_filter.h"

namespace isochron {

/// Optical paths.
struct TimeWindow {
  double first = 0, last = 1;
};

/// Lengths in metres. The defaults make a valid experiment of nothing.
struct FitSettings {
  int samples = 16;  ///< of images, per histogram
  int levels = 1, coarse_levels = 1;
  int more_levels = 0;     ///< while counts are not explained
  double edge_length = 1;  ///< of the first level
  double bending = 1;  ///< and first variation: nats per unit of curvature (a sphere has 50, the border of a disc 1.1)
  int coarse_histograms = 0;  ///< that coarse levels are fitted to; 0: all
  /// Of levels by adam and of the last of them, and the largest step in edge lengths. From a silhouette of 0.85, one level of 150 comes to
  /// 0.90 with steps of 0.022, to 0.91 with 0.044 and 0.088, where more that is not there is left.
  int adam_iterations = 72, adam_last = 72;
  double adam_rate = 0.044;
  double adam_motion = 0;         ///< weight of the offsets' slopes there
  double motion = 0, albedo = 0;  ///< weights of slopes
  double outline_share = 0.35;    ///< of the typical albedo, below which the surface ends (optim/README.md, Outlines)
  double outline_slopes = 0;      ///< weight of the albedos' slopes there
  double gain = 1;
  bool background_per_point = false;
  double bin = 0;  ///< width; 0: not known yet
  TimeWindow window;
};

/// What a fit may take.
struct FitWork {
  int histograms = 1;
  bool confocal = true;  ///< light comes back the way it went, which is to be tested once
  double seconds = 300;  ///< on two cores
};

/// Levels, the coarse ones with edges as long as the resolution (of a surface much larger than that, longer), the last one with half of that and,
/// where the data are not explained, another with a quarter; and samples for a fit of that work.
FitSettings fit_settings(const Mesh& start, double resolution, const FitWork& work);

/// Whether points count backgrounds of their own: whether what they count before any light comes varies among them more than Poisson numbers
/// of one mean. `used`: zero for points that are left out; empty: none is.
bool backgrounds_differ(const CaptureFile& capture, const std::vector<std::uint8_t>& used);

/// Times, as optical paths, at which light of the mesh may be counted at any point, and a quarter as much before and after, for the
/// background.
TimeWindow time_window(const Mesh& mesh, const CaptureGeometry& geometry, const DetectorResponse& response,
                       double depth_resolution);

/// Gain and weights of slopes, by the counts and a rendering of the start under a gain of 1: `experiment` is the file of
/// such a one.
void measure(const std::string& experiment, const Mesh& start, FitSettings& settings,
             const std::function<void(const std::string&)>& warning);

}  // namespace isochron
