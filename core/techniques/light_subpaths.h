// Light subpaths: walks from an emitter, each vertex of which is joined with the camera and with every vertex of a camera
// path (bidirectional path tracing: Lafortune and Willems 1993, Veach and Guibas 1995). They find light that walks from the
// camera rarely lead to, of a lamp in a case for instance. All joints of a path and standard sampling share it by the
// balance heuristic, see Balance::light.
#pragma once
#include "core/techniques/light_walk.h"
#include "core/techniques/standard_walk.h"

namespace isochron {

/// Not of captures.
class LightSubpaths {
 public:
  explicit LightSubpaths(Worker& worker)
      : worker_(worker),
        scene_(worker.scene),
        reach_{worker.gates.lower(), worker.gates.upper()},
        path_(worker.options.max_bounces) {}

  /// One camera path from `pixel` and one light subpath, with all their joints. Contributions to the pixel are scaled by `scale`. Those of
  /// the camera's own joints may land on any pixel: they are scaled as if all pixels had as many samples.
  void sample(int pixel, double scale, Rng& rng);

 private:
  /// Joins the camera path, so far as it goes, with every vertex of the light subpath. `pixel`: -1 where the camera itself is joined.
  void join(int pixel, const Rgb& throughput);

  Worker& worker_;
  const PreparedScene& scene_;
  const LengthRange reach_;
  Path path_;
  LightWalk light_;
};

}  // namespace isochron
