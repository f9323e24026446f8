// Light transport paths x0 (camera), x1, ..., xn (scattering), x(n+1) (on an emitter).
#pragma once
#include <stdexcept>
#include <vector>

#include "core/paths/prepared_scene.h"

namespace isochron {

/// Stack of fixed capacity, beyond which it throws std::logic_error. Pushing moves nothing: references to entries below stay
/// valid.
template <class T>
class FixedStack {
 public:
  explicit FixedStack(std::size_t capacity) : items_(capacity) {}
  void start(const T& first) {
    items_[0] = first;
    size_ = 1;
  }
  void push_back(const T& item) {
    if (size_ == items_.size()) [[unlikely]]
      throw std::logic_error("a path has more vertices than there is room for");
    items_[size_++] = item;
  }
  void pop_back() { --size_; }
  const T& back() const { return items_[size_ - 1]; }
  const T& operator[](std::size_t i) const { return items_[i]; }
  T& operator[](std::size_t i) { return items_[i]; }
  const T* data() const { return items_.data(); }
  std::size_t size() const { return size_; }

 private:
  std::vector<T> items_;
  std::size_t size_ = 0;
};

/// Densities, per area, with which walks step to a vertex from its neighbours; negative: not computed since a vertex that they
/// depend on has changed.
struct StepDensities {
  double from_camera = -1;  ///< depends on the vertex and the two before
  double from_light = -1;   ///< depends on the vertex and the two behind
};

/// A path under construction: vertices from the camera on. `vertex[0]` is the camera or sensor point (or, for the light side of a
/// boundary segment, the point that the walk looks from); its triangle is -1 for the former.
struct Path {
  FixedStack<SurfacePoint> vertex;
  FixedStack<double> length;      ///< length[k]: optical, from vertex 0 to vertex k, plus what length[0] starts with
  FixedStack<char> has_gradient;  ///< has_gradient[k]: some vertex up to k can have a derivative
  mutable FixedStack<StepDensities> steps;  ///< as far as weights were asked for (Balance)

  explicit Path(int max_bounces)
      : vertex(max_bounces + 3), length(max_bounces + 3), has_gradient(max_bounces + 3), steps(max_bounces + 3) {}
  void start(const SurfacePoint& origin, double length_so_far) {
    vertex.start(origin);
    length.start(length_so_far);
    has_gradient.start(0);
    steps.start({});
  }
  void push(const PreparedScene& scene, const SurfacePoint& x) {
    push(scene, x, isochron::length(x.p - vertex.back().p));
  }
  /// `distance`: of x from the last vertex, geometric.
  void push(const PreparedScene& scene, const SurfacePoint& x, double distance) {
    length.push_back(length.back() + distance * scene.index_between(back(), x));
    has_gradient.push_back(has_gradient.back() || scene.has_gradient(x.triangle));
    vertex.push_back(x);
    forget_steps_from_behind();
    steps.push_back({});
  }
  void pop() {
    vertex.pop_back();
    length.pop_back();
    has_gradient.pop_back();
    steps.pop_back();
    forget_steps_from_behind();
  }
  const SurfacePoint& back() const { return vertex.back(); }
  int size() const { return static_cast<int>(vertex.size()); }
  /// Whether light from y to the last vertex, which vertex 0 sees, comes along the segment that it is seen through (confocal
  /// capture, flash at the camera): the two are visible together.
  bool is_confocal_return(const SurfacePoint& y) const {
    return vertex.size() == 2 && vertex[0].triangle == -1 && is_light(y.triangle) && y.p == vertex[0].p;
  }

 private:
  /// Those of the last two vertices, whose neighbours behind change.
  void forget_steps_from_behind() {
    const std::size_t size = steps.size();
    if (size > 0) steps[size - 1].from_light = -1;
    if (size > 1) steps[size - 2].from_light = -1;
  }
};

/// Whether a point on an emitter's triangle, or the light in its place, gives paths that end there a derivative.
inline bool emitter_has_gradient(const PreparedScene& scene, int triangle) {
  return scene.has_moving_vertex(triangle) ||
         (!is_light(triangle) && scene.differentiable.emission[scene.shape_index(triangle)]);
}

/// Whether the path x0 ... x(last) of `path`, followed by a point on an emitter's triangle, can have a gradient.
inline bool path_has_gradient(const PreparedScene& scene, const Path& path, int last, int emitter_triangle) {
  return path.has_gradient[last] || emitter_has_gradient(scene, emitter_triangle);
}

/// Directions at a scattering vertex x towards its neighbours `before` (camera side) and `after` (light side).
struct Scattering : Directions {
  double distance_o, distance_i;
  Scattering(const Vec3& before, const SurfacePoint& x, const Vec3& after)
      : Scattering(x, (before - x.p) * (1 / length(before - x.p)), length(before - x.p), after) {}
  /// `towards_camera`: unit direction to the neighbour on the camera side, which is `distance` away.
  Scattering(const SurfacePoint& x, const Vec3& towards_camera, double distance, const Vec3& after)
      : distance_o(distance) {
    n = x.n;
    w_o = towards_camera;
    w_i = after - x.p;
    distance_i = length(w_i);
    w_i *= 1 / distance_i;
    cos_o = dot(x.n, w_o);
    cos_i = dot(x.n, w_i);
    cos_io = dot(w_o, w_i);
  }
};

/// Converts a density per solid angle at x into one per area at y.
inline double solid_angle_to_area(const Vec3& x, const SurfacePoint& y) {
  const Vec3 d = y.p - x;
  const double squared = length_squared(d);
  return std::abs(dot(y.n, d)) / (squared * std::sqrt(squared));
}

}  // namespace isochron
