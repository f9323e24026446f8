#include "core/techniques/primary_boundary.h"

#include <cmath>
#include <cstdint>
#include <optional>

namespace isochron {
namespace {

/// The surface point that the camera sees just beside the edge point y, on the side of the unit vector `side`
/// (in the image, across the edge): on the edge's face that is in front on that side, else on whatever lies
/// beyond.
std::optional<SurfacePoint> seen_beside(Worker& worker, const BoundaryEdge& edge, const Vec3& y, const Vec3& d,
                                        const Vec3& side) {
  const PreparedScene& scene = worker.scene;
  int front = -1;
  double front_slope = 0;
  Vec3 into_front;
  for (int i = 0; i < edge.faces(); ++i) {
    const double sign = edge.is_mesh_intersection() && dot(edge.inward[i], side) < 0 ? -1 : 1;
    const Vec3 inward = edge.inward[i] * sign;
    const double across = dot(inward, side);
    // A face seen edge-on takes no part of the image: what lies behind it is seen beside the edge.
    if (!(across > 0) || std::abs(dot(scene.normal(edge.face[i]), d)) <= kCoplanarAngle) continue;
    const double slope = dot(inward, d) / across;  // depth gained per distance beside the edge
    if (front < 0 || slope < front_slope) front = edge.face[i], front_slope = slope, into_front = inward;
  }
  // The point itself is off the edge, too: where the edge of a standing object lies in a floor, rays from the
  // edge start within a surface, or behind one.
  const double offset = scene.caster.offset();
  if (front >= 0) {
    const Vec3 p = y + into_front * offset;
    if (scene.stacked.may_cover(front, scene.normal(front), d)) front = scene.top_face(front, p, d);
    return SurfacePoint{p, scene.normal(front), front};
  }
  return worker.trace_camera(normalize(y + side * offset - scene.camera.position));
}

}  // namespace

PrimaryBoundary::PrimaryBoundary(Worker& worker, const BoundaryEdges& edges, const BoundaryGuide& guide,
                                 bool narrow_gates)
    : worker_(worker),
      scene_(worker.scene),
      edges_(edges),
      guide_(guide),
      light_side_(worker, narrow_gates && worker.options.boundary.light_arcs) {
  eye_.p = scene_.camera.position;
}

void PrimaryBoundary::sample(double scale, Rng& rng) {
  const int table = BoundaryGuide::table(Technique::primary_edge);
  const Warp& warp = guide_.warp(table);
  const double x = warp.sample(rng.fine_uniform());
  const BoundaryEdges::Sample point = edges_.sample_primary(x);
  const BoundaryEdge* edge = point.edge;
  const Vec3 y = point.y;
  const int pixel = scene_.camera.project(y);
  if (pixel < 0) return;
  const Vec3 to_y = y - scene_.camera.position;
  const double r = length(to_y);
  const Vec3 d = to_y / r;
  const Vec3 normal = cross(point.tangent, d);
  const double sine = length(normal);
  if (!(sine > 0)) return;
  const Vec3 n_b = normal / sine;

  LocalDifferential& differential = worker_.differential;
  differential.clear();
  BoundaryEdges::add_velocity(scene_, point, n_b, differential);
  const bool moves = !differential.empty();
  if (!moves && !scene_.flows.camera_possible_along(d)) return;

  // Off the faces, to the camera's side of each, so that the edge does not hide itself.
  Vec3 off = -d;
  for (int i = 0; i < edge->faces(); ++i)
    off += scene_.normal(edge->face[i]) * std::copysign(1.0, -dot(scene_.normal(edge->face[i]), d));
  ++worker_.counts.rays;
  if (scene_.caster.occluded(scene_.camera.position, y + off * scene_.caster.offset())) return;

  worker_.sink.bind(differential);

  const double factor =
      scale * sine * scene_.camera.image_area_per_solid_angle(d) / (r * r * point.pdf * warp.density(x));
  // The two sides share their random numbers: what they have in common cancels.
  const Rng shared = rng;
  for (const double sign : {-1.0, 1.0}) {
    const auto x1 = seen_beside(worker_, *edge, y, d, n_b * sign);
    if (!x1) continue;
    Rng walk_rng = shared;
    if (moves) {
      const CameraSide before{pixel, length(x1->p - eye_.p) * scene_.index_between(eye_, *x1)};
      for (const GatheredLight& light :
           light_side_.gather(eye_, *x1, {&before, 1}, worker_.options.max_bounces, walk_rng)) {
        worker_.sink.note_boundary(light.bounces, edge->face[0], 0);
        worker_.sink.add(pixel, light.value * (-sign * factor), light.whole_length(before.length), GateUse::value_only);
      }
    }
    follow(*x1, pixel, edge->face[0], n_b * (r / length(x1->p - eye_.p)), walk_rng,
           [&](const Rgb& value, double length) {
             worker_.sink.add(pixel, value * (sign * factor), length, GateUse::value_only);
           });
    if (moves) worker_.sink.bind(differential);
  }
  worker_.sink.note_guide(table, x);
}

void PrimaryBoundary::sample_pixel_border(double scale, Rng& rng) {
  const CameraModel& camera = scene_.camera;
  const int table = BoundaryGuide::table(Technique::pixel_border);
  const double x = guide_.warp(table).sample(rng.fine_uniform());
  // Pixels in rows, with one column and one row more than the image has, for the borders at its end.
  const std::int64_t borders = std::int64_t{2} * (camera.width + 1) * (camera.height + 1);
  const double place = x * static_cast<double>(borders);
  const std::int64_t border = std::min(static_cast<std::int64_t>(place), borders - 1);
  const int axis = static_cast<int>(border % 2), column = static_cast<int>(border / 2 % (camera.width + 1)),
            row = static_cast<int>(border / 2 / (camera.width + 1));
  const double along = place - static_cast<double>(border);
  const Vec3 d = camera.direction(column + (axis == 1 ? along : 0), row + (axis == 0 ? along : 0));
  const bool in_columns = column < camera.width, in_rows = row < camera.height;
  if (!(axis == 0 ? in_rows : in_columns) || !scene_.flows.camera_possible_along(d)) return;
  const auto x1 = worker_.trace_camera(d);
  if (!x1) return;
  const int pixel = row * camera.width + column;
  const bool has_after = in_columns && in_rows, has_before = (axis == 0 ? column : row) > 0;
  const int before = pixel - (axis == 0 ? 1 : camera.width);
  const double factor = scale * static_cast<double>(borders) / guide_.warp(table).density(x);
  follow(*x1, GatePick::kImage, x1->triangle, camera.image_gradient(x1->p - eye_.p, axis), rng,
         [&](const Rgb& value, double length) {
           if (has_after) worker_.sink.add(pixel, value * factor, length, GateUse::value_only);
           if (has_before) worker_.sink.add(before, value * -factor, length, GateUse::value_only);
         });
  worker_.sink.note_guide(table, x);
}

template <class Add>
void PrimaryBoundary::follow(const SurfacePoint& x1, int pixel, int triangle, const Vec3& g, Rng& rng, Add&& add) {
  if (!scene_.flows.camera_possible_at(x1.p) || worker_.options.max_bounces < 1) return;
  Rgb throughput(1.0);
  const auto next = sample_bsdf(scene_, x1, normalize(eye_.p - x1.p), throughput, rng);
  if (!next) return;
  if (!scene_.has_moving_vertex(x1.triangle) && !scene_.moving_bounds.meets_ray(x1.p, next->direction)) return;
  const int met = worker_.closest_hit_within(x1, next->direction, scene_.flows.camera_radius_at(x1.p));
  const auto x2 = scene_.end_point(met, x1.p, next->direction);
  if (!x2) return;
  following_.clear();
  const VertexFlow flow = VertexFlows::at({}, scene_.flows.pair(scene_, x1, *x2, 1), 1);
  if (!flow.follows()) return;
  add_following_flow(scene_, flow, nullptr, x1, &*x2, 1, g, following_);
  if (following_.empty()) return;
  worker_.sink.bind(following_);
  const CameraSide before{pixel, length(x1.p - eye_.p) * scene_.index_between(eye_, x1) +
                                     length(x2->p - x1.p) * scene_.index_between(x1, *x2)};
  for (const GatheredLight& light : light_side_.gather(x1, *x2, {&before, 1}, worker_.options.max_bounces - 1, rng)) {
    worker_.sink.note_boundary(light.bounces + 1, triangle, 0);
    add(throughput * light.value, light.whole_length(before.length));
  }
}

}  // namespace isochron
