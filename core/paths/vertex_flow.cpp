#include "core/paths/vertex_flow.h"

#include <algorithm>
#include <utility>

#include "core/base/disjoint_sets.h"
#include "core/paths/path_differential.h"

namespace isochron {
namespace {

Bounds bounds_of(const Scene& scene, const Triangle& triangle) {
  Bounds bounds;
  for (const int v : triangle.vertex) bounds.add(scene.positions[v]);
  return bounds;
}

/// Whether none of the moving triangles can see another one: they are a single closed convex surface or flat
/// piece whose dark side is inside.
bool sees_nothing_of_itself(const PreparedScene& prepared, const std::vector<int>& body_of_vertex) {
  const Scene& scene = prepared.scene;
  const Differentiable& differentiable = prepared.differentiable;
  if (differentiable.corners.empty()) return true;
  const int first = differentiable.corners.front();
  for (const int v : differentiable.corners)
    if (body_of_vertex[v] != body_of_vertex[first]) return false;
  const Shape& shape = *std::find_if(scene.shapes.begin(), scene.shapes.end(),
                                     [first](const Shape& s) { return first < s.first_vertex + s.vertex_count; });
  if (prepared.two_sided(shape.first_triangle) || prepared.transparent(shape.first_triangle)) return false;
  bool open = false, flat = true;
  for (int e = shape.first_edge; e < shape.first_edge + shape.edge_count; ++e) {
    const Edge& edge = scene.edges[e];
    const bool moves[2] = {differentiable.triangle[edge.face[0]] != 0,
                           edge.face[1] >= 0 && differentiable.triangle[edge.face[1]]};
    if (!moves[0] && !moves[1]) continue;
    if (edge.sector) return false;  // it opens to both sides of a face
    if (!moves[0] || !moves[1]) {
      open = true;
      continue;
    }
    const Vec3& n = prepared.normal(edge.face[0]);
    for (const int v : scene.triangles[edge.face[1]].vertex) {
      const Vec3 d = scene.positions[v] - scene.positions[edge.vertex[0]];
      const double height = dot(n, d), scale = kCoplanarAngle * length(d);
      if (height > scale) return false;
      flat &= height >= -scale;
    }
  }
  return flat || !open;
}

}  // namespace

VertexFlows::VertexFlows(const Scene& scene) {
  DisjointSets sets(scene.positions.size());
  for (const Triangle& t : scene.triangles)
    for (const int v : t.vertex) sets.join(v, t.vertex[0]);
  int bodies = 0;
  body_of_vertex_ = sets.numbered(bodies);
  shape_of_body_.resize(static_cast<std::size_t>(bodies));
  for (std::size_t s = 0; s < scene.shapes.size(); ++s)
    for (int v = scene.shapes[s].first_vertex; v < scene.shapes[s].first_vertex + scene.shapes[s].vertex_count; ++v)
      shape_of_body_[body_of_vertex_[v]] = static_cast<int>(s);
}

void VertexFlows::update(const PreparedScene& prepared, const FollowOptions& options) {
  const Scene& scene = prepared.scene;
  const CameraModel& camera = prepared.camera;
  const Differentiable& differentiable = prepared.differentiable;
  position_ = camera.position;
  forward_ = camera.forward;
  radius_ = options.radius_in_pixels * camera.pixel_size();
  camera_possible_ = follows_bodies_ = false;
  keep_length_ = options.keep_length;
  near_ = differentiable.bounds;
  if (!differentiable.geometry) return;
  update_bodies(prepared);
  if (options.radius_in_pixels > 0 && !prepared.captures()) {  // whose x1 no pixel holds
    // x1 is within s of the box, and its own depth enters s.
    constexpr double kLargest = 0.5;
    const Vec3 farthest{camera.forward.x > 0 ? differentiable.bounds.high.x : differentiable.bounds.low.x,
                        camera.forward.y > 0 ? differentiable.bounds.high.y : differentiable.bounds.low.y,
                        camera.forward.z > 0 ? differentiable.bounds.high.z : differentiable.bounds.low.z};
    const double depth = std::max(0.0, dot(camera.forward, farthest - camera.position));
    const double margin =
        radius_ < kLargest ? radius_ * depth / (1 - radius_) : std::numeric_limits<double>::infinity();
    camera_near_ = differentiable.bounds.grown(margin);
    camera_possible_ = !sees_nothing_of_itself(prepared, body_of_vertex_);
    for (std::size_t s = 0; s < scene.shapes.size(); ++s)
      camera_possible_ = camera_possible_ || has_still_triangle_in_reach(prepared, s);
  }
  if (options.bodies > 0) find_near_bodies(prepared, options.bodies);
}

bool VertexFlows::has_still_triangle_in_reach(const PreparedScene& prepared, std::size_t s) const {
  if (!shape_bounds_[s].overlaps(camera_near_)) return false;
  const Scene& scene = prepared.scene;
  const auto begin = scene.triangles.begin() + scene.shapes[s].first_triangle;
  return std::any_of(begin, begin + scene.shapes[s].triangle_count, [&](const Triangle& triangle) {
    return !prepared.differentiable.triangle[&triangle - scene.triangles.data()] &&
           bounds_of(scene, triangle).overlaps(camera_near_);
  });
}

void VertexFlows::update_bodies(const PreparedScene& prepared) {
  const Scene& scene = prepared.scene;
  shape_bounds_.resize(scene.shapes.size());
  body_bounds_.resize(shape_of_body_.size());
  body_moves_.resize(body_bounds_.size());
  for (std::size_t s = 0; s < scene.shapes.size(); ++s) {
    if (prepared.shape_changed(static_cast<int>(s)) <= bodies_revision_) continue;
    const int begin = scene.shapes[s].first_vertex, end = begin + scene.shapes[s].vertex_count;
    for (int v = begin; v < end; ++v) {
      body_bounds_[body_of_vertex_[v]] = {};
      body_moves_[body_of_vertex_[v]] = 0;
    }
    for (int v = begin; v < end; ++v) {
      body_bounds_[body_of_vertex_[v]].add(scene.positions[v]);
      body_moves_[body_of_vertex_[v]] |= prepared.differentiable.vertex[v] != 0;
    }
  }
  for (Bounds& bounds : shape_bounds_) bounds = {};
  for (std::size_t body = 0; body < body_bounds_.size(); ++body)
    shape_bounds_[shape_of_body_[body]].add(body_bounds_[body]);
  bodies_revision_ = prepared.revision();
}

void VertexFlows::find_near_bodies(const PreparedScene& prepared, double bodies) {
  const std::size_t count = body_bounds_.size();
  body_radius_.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    body_radius_[i] = bodies * 0.5 * length(body_bounds_[i].high - body_bounds_[i].low);
  double largest = 0;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < count && body_moves_[i]; ++j) {
      const double radius = std::min(body_radius_[i], body_radius_[j]);
      if (j != i && largest < radius && body_bounds_[j].grown(radius).overlaps(body_bounds_[i])) largest = radius;
    }
  if (!(largest > 0)) return;  // no two bodies are close enough
  follows_bodies_ = true;
  near_ = prepared.differentiable.bounds.grown(largest);
  // Of a pair within `largest` of each other one is in near_.
  std::vector<char> near(count);
  for (std::size_t i = 0; i < count; ++i) near[i] = body_bounds_[i].overlaps(near_.grown(largest));
  patches_.update(prepared, body_of_vertex_, std::move(near));
}

VertexFlows::Pair::Weight VertexFlows::weight(const PreparedScene& prepared, const Vec3& x, int patch, const Vec3& y,
                                              double largest, Vec3& gradient_other) const {
  const Vec3 d = x - y;
  const double squared = length_squared(d);
  double s2 = largest * largest;
  Vec3 to_nearest;  // from the nearest crease to x, where that is what limits s
  for (const int crease : patches_.creases(patch)) {
    const auto& end = prepared.scene.edges[crease].vertex;
    const Vec3 &origin = prepared.scene.positions[end[0]], a = x - origin,
               along = prepared.scene.positions[end[1]] - origin;
    const double squared_length = length_squared(along);
    const Vec3 off = a - along * (squared_length > 0 ? std::clamp(dot(a, along) / squared_length, 0.0, 1.0) : 0.0);
    const double distance = length_squared(off);
    if (distance >= s2) continue;
    if (distance <= squared) return {};
    s2 = distance;
    to_nearest = off;
  }
  if (!(squared < s2)) return {};
  const double q = squared / s2, slope = -2 * (1 - q);
  gradient_other = d * (slope * -2 / s2);
  Pair::Weight w;
  w.value = (1 - q) * (1 - q);
  w.missing = q * (2 - q);
  // grad s = to_nearest / s, grad q = 2 d / s^2 - 2 q grad s / s
  w.gradient = (d - to_nearest * q) * (slope * 2 / s2);
  return w;
}

VertexFlows::Pair VertexFlows::pair(const PreparedScene& scene, const SurfacePoint& x, const SurfacePoint& y,
                                    int k) const {
  Pair result;
  if (keep_length_ && (scene.emits(x.triangle) || scene.emits(y.triangle))) return result;
  Vec3 gradient_near;  // of the weight of y with respect to x, and the other way round
  if (follows_bodies_) {
    const int patch_x = patches_.of(x.triangle), patch_y = patches_.of(y.triangle);
    const bool near = patch_x >= 0 && patch_y >= 0;
    const int body_x = near ? patches_.body(patch_x) : -1, body_y = near ? patches_.body(patch_y) : -1;
    if (body_x != body_y) {
      const double largest = std::min(body_radius_[body_x], body_radius_[body_y]);
      if (length_squared(x.p - y.p) < largest * largest && (near_.holds(x.p) || near_.holds(y.p))) {
        result.far = weight(scene, y.p, patch_y, x.p, largest, gradient_near);
        if (k > 1) {
          Vec3 gradient_far;
          result.near = weight(scene, x.p, patch_x, y.p, largest, gradient_far);
          // The one on the larger patch comes first.
          const auto second = [](Pair::Weight& w, const Pair::Weight& first, const Vec3& gradient_first) {
            w.gradient = w.gradient * first.missing - gradient_first * w.value;
            w.missing += w.value * first.value;
            w.value *= first.missing;
          };
          if (patches_.area(scene, x.triangle) >= patches_.area(scene, y.triangle))
            second(result.far, result.near, gradient_far);
          else
            second(result.near, result.far, gradient_near);
        }
      }
    }
  }
  if (k == 1 && camera_possible_ && (scene.has_moving_vertex(x.triangle) || scene.has_moving_vertex(y.triangle))) {
    const double s = camera_radius_at(x.p), inverse = 1 / (s * s);
    const Vec3 d = x.p - y.p;
    const double q = length_squared(d) * inverse;
    if (q < 1) {
      const double w = (1 - q) * (1 - q);
      const Vec3 gradient = (d * (2 * inverse) - forward_ * (2 * q * radius_ / s)) * (-2 * (1 - q));
      const Pair::Weight& far = result.far;
      result.near.value = w * far.missing;
      result.near.gradient = gradient * far.missing - gradient_near * w;
      result.own = {w * far.value, gradient * far.value + gradient_near * w};
    }
  }
  return result;
}

VertexFlow VertexFlows::at(const Pair& before, const Pair& after, int k) {
  VertexFlow flow;
  if (k == 1) {
    flow.after = {after.near.value, after.near.gradient};
    flow.own = after.own;
    return flow;
  }
  const Pair::Weight &w1 = before.far, &w2 = after.near;
  if (w2.value == 0) {
    flow.before = {w1.value, w1.gradient};
  } else if (w1.value == 0) {
    flow.after = {w2.value, w2.gradient};
  } else if (const double d = w1.missing + w2.missing - w1.missing * w2.missing; d > 0) {
    const auto share = [d](const Pair::Weight& w, const Pair::Weight& other) {
      return Following{w.value * other.missing / d,
                       (w.gradient * other.missing - other.gradient * (w.value * w.missing)) / (d * d)};
    };
    flow.before = share(w1, w2);
    flow.after = share(w2, w1);
  }
  return flow;
}

void add_pixel_flow(const PreparedScene& scene, const SurfacePoint& x1, const Vec3& g, LocalDifferential& out) {
  const Vec3 ray = x1.p - scene.camera.position;
  const double across = dot(x1.n, ray);
  if (across == 0) return;  // edge-on: no light of it reaches the pixel
  add_material_flow(scene, x1, x1.n * (dot(ray, g) / across), out);
}

void add_following_flow(const PreparedScene& scene, const VertexFlow& flow, const SurfacePoint* before,
                        const SurfacePoint& x, const SurfacePoint* after, int k, const Vec3& g,
                        LocalDifferential& out) {
  const Vec3 along = in_plane(x, g);
  if (flow.before.weight > 0) add_material_flow(scene, *before, along * flow.before.weight, out);
  if (flow.after.weight > 0) add_material_flow(scene, *after, along * flow.after.weight, out);
  if (flow.own.weight > 0) add_material_flow(scene, x, along * flow.own.weight, out);
  const Vec3 of_base = along * -(flow.before.weight + flow.after.weight + flow.own.weight);
  if (k == 1)
    add_pixel_flow(scene, x, of_base, out);
  else
    add_material_flow(scene, x, of_base, out);
}

}  // namespace isochron
