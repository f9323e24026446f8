#include "core/render/camera_flow.h"

#include <numeric>

#include "core/render/path_differential.h"

namespace isochron {
namespace {

Bounds bounds_of(const Scene& scene, const Triangle& triangle) {
  Bounds bounds;
  for (const int v : triangle.vertex) bounds.add(scene.positions[v]);
  return bounds;
}

/// Whether none of the moving triangles can see another one: they are a single closed convex surface or flat
/// piece whose dark side is inside.
bool sees_nothing_of_itself(const Scene& scene, const MovingParts& moving) {
  std::vector<int> parent(scene.positions.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  int any_vertex = -1;
  for (std::size_t t = 0; t < scene.triangles.size(); ++t) {
    if (!moving.triangle[t]) continue;
    const Triangle& triangle = scene.triangles[t];
    const Material& material = scene.materials[scene.shapes[triangle.shape].material];
    if (material.two_sided || material.type == MaterialType::rough_dielectric) return false;
    any_vertex = triangle.vertex[0];
    for (const int v : triangle.vertex) parent[root(v)] = root(any_vertex);
  }
  for (std::size_t t = 0; t < scene.triangles.size(); ++t)
    if (moving.triangle[t] && root(scene.triangles[t].vertex[0]) != root(any_vertex)) return false;
  const auto normal = [&](int t) {
    const auto& v = scene.triangles[t].vertex;
    const Vec3& p = scene.positions[v[0]];
    return cross(scene.positions[v[1]] - p, scene.positions[v[2]] - p);
  };
  bool open = false, flat = true;
  for (const Edge& edge : scene.edges) {
    const bool moves[2] = {moving.triangle[edge.face[0]] != 0, edge.face[1] >= 0 && moving.triangle[edge.face[1]]};
    if (!moves[0] && !moves[1]) continue;
    if (!moves[0] || !moves[1]) {
      open = true;
      continue;
    }
    const Vec3 n = normal(edge.face[0]);
    for (const int v : scene.triangles[edge.face[1]].vertex) {
      const Vec3 d = scene.positions[v] - scene.positions[edge.vertex[0]];
      const double height = dot(n, d), scale = kCoplanarAngle * length(n) * length(d);
      if (height > scale) return false;
      flat &= height >= -scale;
    }
  }
  return flat || !open;
}

}  // namespace

CameraFlow::CameraFlow(const Scene& scene, const CameraModel& camera, const MovingParts& moving, double radius)
    : position_(camera.position), forward_(camera.forward), radius_(radius * camera.pixel_size()) {
  if (!(radius > 0) || !moving.geometry) return;
  // x1 is within s of the box, and its own depth enters s.
  constexpr double kLargest = 0.5;
  const Vec3 farthest{camera.forward.x > 0 ? moving.bounds.high.x : moving.bounds.low.x,
                      camera.forward.y > 0 ? moving.bounds.high.y : moving.bounds.low.y,
                      camera.forward.z > 0 ? moving.bounds.high.z : moving.bounds.low.z};
  const double depth = std::max(0.0, dot(camera.forward, farthest - camera.position));
  const double margin = radius_ < kLargest ? radius_ * depth / (1 - radius_) : std::numeric_limits<double>::infinity();
  near_ = moving.bounds.grown(margin);
  possible_ = !sees_nothing_of_itself(scene, moving);
  for (std::size_t t = 0; t < scene.triangles.size() && !possible_; ++t)
    possible_ = !moving.triangle[t] && bounds_of(scene, scene.triangles[t]).overlaps(near_);
}

CameraFlow::Follow CameraFlow::follow(const Vec3& x1, const Vec3& x2) const {
  if (!possible_) return {};
  const double s = radius_at(x1);
  const Vec3 d = x1 - x2;
  const double inverse = 1 / (s * s), ratio = length_squared(d) * inverse;
  if (!(ratio < 1)) return {};
  const Vec3 gradient = d * (2 * inverse) - forward_ * (2 * ratio * radius_ / s);
  return {(1 - ratio) * (1 - ratio), gradient * (-2 * (1 - ratio))};
}

void add_pixel_flow(const PreparedScene& scene, const SurfacePoint& x1, const Vec3& g, LocalDifferential& out) {
  const Vec3 ray = x1.p - scene.camera.position;
  add_material_flow(scene, x1, x1.n * (dot(ray, g) / dot(x1.n, ray)), out);
}

void add_following_flow(const PreparedScene& scene, const SurfacePoint& x1, const SurfacePoint& x2, const Vec3& g,
                        LocalDifferential& out) {
  const double weight = scene.camera_flow.follow(x1.p, x2.p).weight;
  if (weight == 0) return;
  const Vec3 along = (g - x1.n * dot(g, x1.n)) * weight;
  add_material_flow(scene, x2, along, out);
  const Vec3 ray = x1.p - scene.camera.position;
  add_material_flow(scene, x1, x1.n * (-dot(ray, along) / dot(x1.n, ray)), out);
}

}  // namespace isochron
