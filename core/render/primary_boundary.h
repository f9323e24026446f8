// Primary visibility boundary: a camera ray grazes a moving edge (theory section 5, "Primary").
#pragma once
#include "core/render/boundary_edges.h"
#include "core/render/boundary_guide.h"
#include "core/render/light_side.h"

namespace isochron {

/// The surface point that the camera sees just beside the edge point y, on the side of the unit vector `side` (in the
/// image, across the edge): on the edge's face that is in front on that side, else on whatever lies beyond.
template <class Sink>
std::optional<SurfacePoint> seen_beside(Worker<Sink>& worker, const BoundaryEdge& edge, const Vec3& y, const Vec3& d,
                                        const Vec3& side) {
  const PreparedScene& scene = worker.scene;
  int front = -1;
  double front_slope = 0;
  Vec3 into_front;
  for (int i = 0; i < edge.faces(); ++i) {
    const double across = dot(edge.inward[i], side);
    if (!(across > 0)) continue;
    const double slope = dot(edge.inward[i], d) / across;  // depth gained per distance beside the edge
    if (front < 0 || slope < front_slope) front = edge.face[i], front_slope = slope, into_front = edge.inward[i];
  }
  // The point itself is off the edge, too: where the edge of a standing object lies in a floor, rays from the edge
  // start within a surface, or behind one.
  const double offset = scene.caster.offset();
  if (front >= 0) return scene.point_in_plane(front, y + into_front * offset);
  ++worker.rays;
  const Vec3 beside = normalize(y + side * offset - scene.camera.position);
  const int t = scene.caster.first_triangle(scene.camera.position, beside);
  if (t < 0 || dot(scene.normal[t], beside) == 0) return std::nullopt;
  return scene.point_on_triangle(t, scene.camera.position, beside);
}

template <class Sink>
class PrimaryBoundary {
 public:
  /// `narrow_gates`: use the techniques that draw lengths from the gates.
  PrimaryBoundary(Worker<Sink>& worker, const BoundaryEdges& edges, const BoundaryGuide& guide, bool narrow_gates)
      : worker_(worker),
        scene_(worker.scene),
        edges_(edges),
        guide_(guide),
        light_side_(worker, narrow_gates && worker.options.boundary.light_arcs) {}

  /// One edge point; contributions are scaled by `scale` (one over the number of edge points).
  void sample(double scale, Rng& rng) {
    if (!edges_.has_primary()) return;
    const int table = BoundaryGuide::table(BoundaryGuide::primary);
    const Warp& warp = guide_.warp(table);
    const double x = warp.sample(rng.uniform());
    const BoundaryEdges::Sample point = edges_.sample_primary(x);
    const BoundaryEdge* edge = point.edge;
    const Vec3 y = point.y;
    const int pixel = scene_.camera.project(y);
    if (pixel < 0) return;
    const Vec3 to_y = y - scene_.camera.position;
    const double r = length(to_y);
    const Vec3 d = to_y / r;
    const Vec3 normal = cross(edge->tangent, d);
    const double sine = length(normal);
    if (!(sine > 0)) return;
    const Vec3 n_b = normal / sine;

    // Off the faces, to the camera's side of each, so that the edge does not hide itself.
    Vec3 off = -d;
    for (int i = 0; i < edge->faces(); ++i)
      off += scene_.normal[edge->face[i]] * std::copysign(1.0, -dot(scene_.normal[edge->face[i]], d));
    ++worker_.rays;
    if (scene_.caster.occluded(scene_.camera.position, y + off * scene_.caster.offset())) return;

    LocalDifferential& differential = worker_.differential;
    differential.clear();
    const double share[2] = {1 - point.s, point.s};
    for (int i = 0; i < 2; ++i)
      if (scene_.moving.vertex[edge->vertex[i]]) differential.vertices.push_back({edge->vertex[i], n_b * share[i], {}});
    worker_.sink.bind(differential);

    const double factor = scale * sine * scene_.camera.image_area_per_solid_angle(d) / (r * r * point.pdf * warp.density(x));
    SurfacePoint eye;
    eye.p = scene_.camera.position;
    // The two sides share their random numbers: what they have in common cancels.
    const Rng shared = rng;
    for (const double sign : {-1.0, 1.0}) {
      const auto x1 = seen_beside(worker_, *edge, y, d, n_b * sign);
      if (!x1) continue;
      const double before = length(x1->p - eye.p) * scene_.index_between(eye, *x1);
      Rng walk_rng = shared;
      for (const GatheredLight& light :
           light_side_.gather(eye, *x1, {&before, 1}, worker_.options.max_bounces, walk_rng)) {
        note_boundary(worker_.sink, light.bounces, *edge);
        worker_.sink.add(pixel, light.value * (-sign * factor), before + light.length, kValueOnly);
      }
    }
    note_guide(worker_.sink, table, x);
  }

 private:
  Worker<Sink>& worker_;
  const PreparedScene& scene_;
  const BoundaryEdges& edges_;
  const BoundaryGuide& guide_;
  LightSide<Sink> light_side_;
};

}  // namespace isochron
