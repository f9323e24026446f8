// Walks from the emitters (light subpaths).
#pragma once
#include <cmath>
#include <vector>

#include "core/techniques/worker.h"

namespace isochron {

/// A scattering vertex of a light subpath.
struct LightVertex {
  SurfacePoint point;
  Vec3 towards_light;  ///< unit, to the vertex before
  double distance;     ///< geometric, to the vertex before
  double length;       ///< optical, from the emitter
  Rgb throughput;      ///< contribution over density from the emitter to here, without the BSDF
  StepDensities step;  ///< to here; `from_camera` by the two vertices that follow

  /// What it sends in the unit direction w, with the cosine there.
  Rgb leaving(const PreparedScene& scene, const Vec3& w) const {
    const Directions d = Directions::between(point.n, towards_light, w);
    return throughput * bsdf_value(scene, point, d) * std::abs(d.cos_o);
  }
};

/// A walk from an emitter; not in captures.
class LightWalk {
 public:
  /// A new one, as far as paths to the camera can be no longer than the last gate.
  void trace(Worker& worker, Rng& rng);

  const std::vector<LightVertex>& vertices() const { return vertices_; }
  /// For connections: vertex i with probability 2^-(i + 1), whatever the walk's length, as weights must not depend on that; -1 where
  /// the walk has ended before. Most of the light in a case has been reflected once or twice.
  int pick(double u) const {
    const double i = -std::log2(u);
    return i < static_cast<double>(vertices_.size()) ? static_cast<int>(i) : -1;
  }
  static double pick_probability(int i) { return std::ldexp(1, -(i + 1)); }
  /// Completes a path that ends next to vertex i: by that and those before. `remove` undoes it.
  void append(const PreparedScene& scene, int i, Path& path) const;
  void remove(int i, Path& path);
  /// Whether paths that begin with `path` and end with vertex i contribute, whatever they have between (Worker::contributes).
  bool contributes(const Worker& worker, const Path& path, int i) const;

 private:
  SurfacePoint emitter_;
  double step_to_emitter_ = -1;  ///< StepDensities::from_camera of the emitter, by the first two vertices
  std::vector<LightVertex> vertices_;
};

}  // namespace isochron
