// The techniques that find paths, one by one, and how a pass uses one.
#pragma once
#include <cstdint>
#include <functional>

#include "core/base/random.h"

namespace isochron {

/// Tells their random numbers apart, and the histograms of those that search for boundaries (BoundaryGuide), which come last.
enum class Technique : std::uint32_t {
  standard,        ///< from the pixel, by standard sampling
  walk,            ///< from the pixel, with ellipsoidal connections
  camera_lengths,  ///< connections of the camera itself, lengths drawn from the gates
  camera_pairs,    ///< the same, in pairs from the gates' derivative
  light_subpath,   ///< from the pixel and from an emitter
  primary_edge,    ///< a silhouette edge that the camera sees
  pixel_border,    ///< a point of a pixel's border, where the flow crosses it
  from_edge,       ///< a boundary segment by its edge
  from_light,      ///< one between an edge and a light without an extent
  from_camera      ///< an edge seen from a vertex of a camera path
};

/// A technique as a pass uses it.
struct TechniqueUse {
  Technique technique;
  double rate;  ///< samples per pixel and sample of the pass, on average; 0: none
  bool
      in_pixel;  ///< samples start in a pixel, which gets GatePick::rate times as many; else their points cover the whole image
  /// One sample, which starts in `pixel` or comes with it; contributions are scaled by `scale`.
  std::function<void(int pixel, double scale, Rng& rng)> sample;
};

}  // namespace isochron
