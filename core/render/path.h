// Light transport paths x0 (camera), x1, ..., xn (scattering), x(n+1) (on an emitter).
#pragma once
#include <vector>

#include "core/render/prepared_scene.h"

namespace isochron {

/// A path under construction: vertices from the camera on. `vertex[0]` is the camera (or, for the light side of a
/// boundary segment, the point that the walk looks from); its triangle is -1 for the camera.
struct Path {
  std::vector<SurfacePoint> vertex;
  std::vector<double> length;  ///< length[k]: from vertex 0 to vertex k, plus what length[0] starts with
  std::vector<char> moves;     ///< moves[k]: some vertex up to k can have a derivative

  explicit Path(int max_bounces) {
    vertex.reserve(max_bounces + 3);
    length.reserve(max_bounces + 3);
    moves.reserve(max_bounces + 3);
  }
  void start(const SurfacePoint& origin, double length_so_far) {
    vertex.assign(1, origin);
    length.assign(1, length_so_far);
    moves.assign(1, 0);
  }
  void push(const PreparedScene& scene, const SurfacePoint& x) {
    length.push_back(length.back() + isochron::length(x.p - vertex.back().p));
    moves.push_back(moves.back() || scene.moving.triangle[x.triangle] || scene.moving.scatters[x.triangle]);
    vertex.push_back(x);
  }
  void pop() {
    vertex.pop_back();
    length.pop_back();
    moves.pop_back();
  }
  const SurfacePoint& back() const { return vertex.back(); }
  int size() const { return static_cast<int>(vertex.size()); }
};

/// Whether a path that ends at emitter point y after `path` can have a derivative.
inline bool can_move(const PreparedScene& scene, const Path& path, int last, int emitter_triangle) {
  return path.moves[last] || scene.moving.triangle[emitter_triangle] ||
         scene.moving.emission[scene.scene.triangles[emitter_triangle].shape];
}

/// Cosines at a scattering vertex x between the neighbours `before` (camera side) and `after` (light side).
struct Scattering {
  Vec3 w_o, w_i;
  double distance_o, distance_i;
  double cos_o, cos_i, cos_io;
  Scattering(const Vec3& before, const SurfacePoint& x, const Vec3& after) {
    w_o = before - x.p;
    w_i = after - x.p;
    distance_o = length(w_o);
    distance_i = length(w_i);
    w_o = w_o / distance_o;
    w_i = w_i / distance_i;
    cos_o = dot(x.n, w_o);
    cos_i = dot(x.n, w_i);
    cos_io = dot(w_o, w_i);
  }
  double lobe(const Material& m) const { return isochron::lobe(m, cos_i, cos_o, cos_io); }
  /// Density per solid angle of drawing w_i from w_o.
  double pdf_towards_light(const Material& m) const { return direction_pdf(m, cos_i, cos_o, cos_io); }
  /// Density per solid angle of drawing w_o from w_i.
  double pdf_towards_camera(const Material& m) const { return direction_pdf(m, cos_o, cos_i, cos_io); }
};

/// Converts a density per solid angle at x into one per area at y.
inline double solid_angle_to_area(const Vec3& x, const SurfacePoint& y) {
  const Vec3 d = y.p - x;
  const double squared = length_squared(d);
  return std::abs(dot(y.n, d)) / (squared * std::sqrt(squared));
}

}  // namespace isochron
