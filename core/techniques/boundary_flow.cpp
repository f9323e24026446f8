// Part of SecondaryBoundary: how fast a boundary moves across a segment, as a linear form in vertex velocities.
#include <cmath>

#include "core/paths/length_flow.h"
#include "core/techniques/secondary_boundary.h"

namespace isochron {

bool SecondaryBoundary::differentiate(const Segment& g) {
  const Vec3 b = g.n_b * g.side;
  LocalDifferential& common = camera_flow_;
  common.clear();
  BoundaryEdges::add_velocity(scene_, g.y, b, common);
  const double whole = g.r_s + g.r_d;
  add_material_flow(scene_, g.light, b * (-g.r_d / whole), common);
  material_flow_ = common;
  if (g.camera_end.triangle >= 0) add_pixel_flow(scene_, g.camera_end, b * (-g.r_s / whole), camera_flow_);
  add_material_flow(scene_, g.camera_end, b * (-g.r_s / whole), material_flow_);
  return !camera_flow_.empty() || !material_flow_.empty();
}

const LocalDifferential& SecondaryBoundary::with_following(const Segment& g, const Connection& c,
                                                           const SurfacePoint& next) {
  const int k = scene_.flow_rank(c.bounces);
  const bool has_before = c.before.triangle >= 0, has_next = next.triangle >= 0;
  const VertexFlows& flows = scene_.flows;
  const LocalDifferential& base = flow_of(c);
  const bool both = g.camera_end.triangle >= 0 && g.light.triangle >= 0;
  const auto along = both ? flows.pair(scene_, g.camera_end, g.light, k) : VertexFlows::Pair{};
  const auto before = has_before ? flows.pair(scene_, c.before, g.camera_end, k - 1) : VertexFlows::Pair{};
  const auto after = has_next ? flows.pair(scene_, g.light, next, k + 1) : VertexFlows::Pair{};
  const VertexFlow of_d = VertexFlows::at(before, along, k), of_s = VertexFlows::at(along, after, k + 1);
  if (!of_d.follows() && !of_s.follows()) return base;
  following_ = base;
  const Vec3 b = g.n_b * (g.side / (g.r_s + g.r_d));
  add_following_flow(scene_, of_d, &c.before, g.camera_end, &g.light, k, b * -g.r_s, following_);
  add_following_flow(scene_, of_s, &g.camera_end, g.light, &next, k + 1, b * -g.r_d, following_);
  return following_;
}

const LocalDifferential& SecondaryBoundary::with_kept_length(const Segment& g, const Connection& c, Found found) {
  const LocalDifferential& plain = with_following(g, c, {});
  if (!scene_.flows.keep_length()) return plain;
  if (&plain != &following_) following_ = plain;
  whole_.assign(1, scene_.sensor_point(c.pixel));
  for (int k = 1; k <= c.bounces; ++k)
    whole_.push_back(found == Found::from_camera ? worker_.path.vertex[k] : walk_[c.bounces - k]);
  whole_.push_back(g.light);
  differentiate_path(scene_, c.pixel, whole_.data(), static_cast<int>(whole_.size()), true, of_length_);
  worker_.counts.segments += static_cast<long long>(whole_.size()) - 1;
  const double across = g.side * dot(g.n_b, LengthFlow(g.camera_end, g.light).x);
  if (std::isfinite(across)) following_.add_length(of_length_, across * g.r_d / (g.r_s + g.r_d));
  return following_;
}

}  // namespace isochron
