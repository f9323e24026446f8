// How the techniques that may find a complete path share it: the one place of the weights of multiple importance sampling,
// but for those within a technique (next-event estimation against the BSDF, area sampling) and those of boundaries.
//
// All by the balance heuristic: a technique takes the part of a path that it makes among all that may be made. Parts add up
// to one whatever densities they come from, so long as all ask the same functions; contributions are divided by the true ones.
//   standard sampling      from the camera, as densities per area of every vertex; Russian roulette and area sampling are left out
//   light subpaths         the same from the emitter, joined behind each camera vertex, as ratios to standard sampling
//   arcs                   among connections, by the vertex that was put on an arc: per area and length there, over the camera walk
//                          to the last vertex but two. Connections of the camera itself serve every pixel; so that they
//                          compare, walks count as starting at a random point of a random pixel
#pragma once
#include <optional>

#include "core/geometry/ellipsoid.h"
#include "core/paths/options.h"
#include "core/paths/path.h"
#include "core/techniques/gate_pick.h"
#include "core/techniques/target_lengths.h"

namespace isochron {

/// Densities of a path under samples with light subpaths over that under standard sampling, as if there were as many of
/// both.
struct LightRatio {
  double all = 0;       ///< of all joints
  double of_joint = 0;  ///< of the one asked for
};

/// Samples with light subpaths per standard one, where they are this part, below one, of both.
inline double light_rate(double part) {
  return part / (1 - part);
}

class Balance {
 public:
  Balance(const PreparedScene& scene, const GatePick& pick) : scene_(scene), pick_(pick) {}

  double light_rate = 0;           ///< samples with light subpaths per standard one
  bool light_connections = false;  ///< whether connections have light subpaths

  // The part that a technique takes of the complete path x0 .. x(K) of a pixel. Parts of standard sampling and of all joints of light
  // subpaths add up to one, and those of all arcs.

  double standard(const Path& path, int pixel) const;
  /// Of light subpaths joined behind so many camera vertices.
  double light(const Path& path, int pixel, int camera_vertices) const;
  /// Of connections that put vertex number `on_arc` of the path on an arc, where the path is as long as that side of the target:
  /// emitter arcs put the last one, surface arcs one before. `pdf_on_arc`: of the point that was found, per area and length.
  double connection(const Path& path, int pixel, const TargetLength& target, int side, int on_arc,
                    double pdf_on_arc) const;
  /// The same of a path that was gathered for its vertex 0 (EllipsoidalConnections::gather): only arcs find it, and none of light
  /// subpaths.
  double gathered(const Path& path, int on_arc, double pdf_on_arc) const;
  /// Of a path of length tau that ends on a border of an emitter: found by an arc of density `pdf_on_arc` (per area and length), or
  /// without one from its last scattering vertex. `tangent`: unit, of the border; `border_pdf`: of its points, per length.
  double border(const Path& path, int pixel, double tau, const Vec3& tangent, double border_pdf,
                std::optional<double> pdf_on_arc) const;

  /// See LightRatio. `joint`: the number of camera vertices before it; 0: the camera itself is joined.
  LightRatio light_ratio(const Path& path, int pixel, int joint = -1) const;

 private:
  /// Of all techniques of connections that one by `on_arc` is, its part.
  template <class LengthPdf>
  double part_of_arc(const Path& path, int on_arc, double pdf_on_arc, bool gathered, LengthPdf&& length_pdf) const;
  /// Densities per area of walks that step to vertex k: from the camera (by a random point of a random pixel) and from the light.
  double step_pdf(const Path& path, int k) const;
  double step_from_light_pdf(const Path& path, int k) const;
  double surface_arc_pdf(const SurfacePoint& x, const SurfacePoint& q, const SurfacePoint& y) const;
  double emitter_arc_pdf(const SurfacePoint& q, const SurfacePoint& y) const;

  const PreparedScene& scene_;
  const GatePick& pick_;
};

}  // namespace isochron
