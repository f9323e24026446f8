#include "core/techniques/secondary_boundary.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace isochron {
namespace {

constexpr double kOnlyFromCamera = std::numeric_limits<double>::infinity();
constexpr double kTowardsCamera = 32;  // rays within 1 / 32 of a touched surface miss it

}  // namespace

SecondaryBoundary::SecondaryBoundary(Worker& worker, const BoundaryEdges& edges, const BoundaryGuide& guide,
                                     bool narrow_gates)
    : worker_(worker),
      scene_(worker.scene),
      edges_(edges),
      guide_(guide),
      techniques_(worker.options.boundary),
      at_length_(narrow_gates && techniques_.from_camera && techniques_.at_length),
      edge_at_length_(narrow_gates && techniques_.at_length && !scene_.captures() && scene_.emitters.have_extent),
      at_length_alone_(worker.gates.shape().is_dirac()                               ? worker.options.max_bounces
                       : scene_.flows.keep_length() && at_length_ && edge_at_length_ ? 1
                                                                                     : 0),
      camera_over_edge_rate_(guide.rate(Technique::from_camera) / guide.rate(Technique::from_edge)),
      aimed_share_(techniques_.aimed && scene_.emitters.have_extent && !worker.gates.shape().is_dirac() ? 0.5 : 0),
      light_side_(worker, narrow_gates && techniques_.light_arcs),
      any_may_move_(scene_.flows.keep_length() &&
                    (worker.options.max_bounces > 1 || scene_.differentiable.every_path)) {}

bool SecondaryBoundary::Segment::orient() {
  const Vec3 normal = cross(y.tangent, w);
  sine = length(normal);
  if (!(sine > 0)) return false;
  n_b = normal / sine;
  side = BoundaryEdges::occluder_side(*y.edge, n_b);
  return side != 0;
}

Vec3 SecondaryBoundary::Segment::offset_ray_origin(double offset) const {
  return y.y - n_b * (side * offset) - w * (kTowardsCamera * offset);
}

void SecondaryBoundary::sample_from_edge(int pixel, double scale, Rng& rng) {
  if (edge_at_length_ && worker_.options.max_bounces > 0) connect_lamp_at_length(scale, rng);
  if (at_length_alone_ == 0 || worker_.options.max_bounces > 1) search_from_edge(pixel, scale, rng);
}

void SecondaryBoundary::search_from_edge(int pixel, double scale, Rng& rng) {
  Segment g;
  const double x = edge_warp().sample(rng.fine_uniform());
  g.y = edges_.sample_secondary(x);
  const double pick = rng.uniform(), u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
  int aimed_at = -1;
  if (pick < aimed_share_) {
    double pdf;
    const SurfacePoint target = scene_.sample_emitter(u0, u1, u2, pdf);
    if (is_light(target.triangle)) return;  // see sample_from_light
    g.w = normalize(target.p - g.y.y);
    aimed_at = target.triangle;
  } else {
    g.w = direction_in_wedge(g.y, u0, u1);
  }
  if (!g.orient()) return;
  const bool may_end_flowing = any_may_move_ || g.y.edge->moves || may_meet_flowing(g, -g.w);
  if (!(may_end_flowing || may_meet_flowing(g, g.w)) || !find_light_end(g)) return;
  if (aimed_at >= 0 && g.light.triangle != aimed_at) return;
  if (!(may_end_flowing || may_flow(g.light)) || !find_camera_end(g)) return;

  connections_.clear();
  walk_to_camera(g, pixel, scale * g.sine / (g.y.pdf * edge_warp().density(x) * direction_pdf(g)),
                 worker_.options.max_bounces, rng);
  finish(g, Found::from_edge, rng);
  worker_.sink.note_guide(BoundaryGuide::table(Technique::from_edge), x);
}

void SecondaryBoundary::sample_from_light(int pixel, double scale, Rng& rng) {
  Segment g;
  const int table = BoundaryGuide::table(Technique::from_light);
  const double x = guide_.warp(table).sample(rng.fine_uniform());
  g.y = edges_.sample_secondary(x);
  const int count = static_cast<int>(scene_.lights.size());
  const int light = scene_.captures() ? scene_.spot_of(pixel)
                                      : index_of_light(std::min(static_cast<int>(rng.uniform() * count), count - 1));
  g.light = scene_.point_of_light(light);
  const Vec3 d = g.light.p - g.y.y;
  g.r_s = length(d);
  if (!(g.r_s > 0)) return;
  g.w = d / g.r_s;
  const Rgb intensity = scene_.emitted(g.light, -g.w);
  if (intensity.is_black() || !g.orient()) return;
  if (!(g.y.edge->moves || may_flow(g.light) || may_meet_flowing(g, -g.w)) || !find_camera_end(g)) return;
  ++worker_.counts.rays;
  if (scene_.caster.occluded(scene_.offset_ray_origin(g.light, -g.w), g.offset_ray_origin(scene_.caster.offset())))
    return;

  connections_.clear();
  const double lights = scene_.captures() ? 1 : count;
  walk_to_camera(g, pixel, scale * lights * g.sine / (g.r_s * g.r_s * g.y.pdf * guide_.warp(table).density(x)),
                 worker_.options.max_bounces, rng);
  light_of_end_ = {intensity, 0, 0, -1};
  finish(g, Found::from_light, rng);
  worker_.sink.note_guide(table, x);
}

void SecondaryBoundary::sample_from_camera(int pixel, double scale, Rng& rng) {
  double tau = 0;
  if (at_length_) {
    const double gate_pick = rng.uniform(), u = rng.uniform();
    tau = worker_.pick.sample_length(pixel, gate_pick, u).value_or(0);
  }
  walk_from_camera(pixel, scale, tau, rng);
  if (at_length_ && !scene_.captures() && worker_.options.max_bounces > 0)
    for (int axis = 0; axis < 2; ++axis) connect_pixel_at_length(pixel, axis, scale, tau, rng);
}

void SecondaryBoundary::walk_from_camera(int pixel, double scale, double tau, Rng& rng) {
  // Each edge is drawn, and so prefetched, before the ray is traced to the vertex that needs it.
  BoundaryEdges::Pick pick = pick_from_camera(pixel, 1, rng);
  if (scene_.captures()) {
    worker_.start_at_sensor(worker_.path, pixel);
    connect_edge(pixel, Rgb(scale), pick, rng);
    if (worker_.options.max_bounces == 1) return;
    pick = pick_from_camera(pixel, 1, rng);
  }
  const double weight = worker_.start_path(pixel, rng);
  if (weight == 0) return;
  Path& path = worker_.path;
  camera_densities_ = {};
  Rgb throughput(1.0);
  scale *= weight;
  for (int bounce = 1; bounce <= worker_.options.max_bounces; ++bounce) {
    if (path.length.back() + scene_.distance_to_emitters(path.back().p) > worker_.gates.upper()) return;
    if (bounce > at_length_alone_ || bounce < worker_.options.max_bounces)
      connect_edge(pixel, throughput * scale, pick, rng);
    if (at_length_) connect_edge_at_length(pixel, throughput * scale, tau, rng);
    if (bounce == worker_.options.max_bounces || !russian_roulette(throughput, bounce, rng)) return;
    pick = pick_from_camera(pixel, bounce + 1, rng);
    if (!append_vertex(worker_, path, throughput, rng)) return;
    extend_camera_densities(bounce);
  }
}

bool SecondaryBoundary::faces(int triangle, const Vec3& w) const {
  return dot(scene_.normal(triangle), w) > 0 || scene_.two_sided(triangle) || scene_.transparent(triangle);
}

Vec3 SecondaryBoundary::direction_in_wedge(const BoundaryEdges::Sample& y, double u0, double u1) {
  const BoundaryEdge& edge = *y.edge;
  const Vec3& f0 = edge.inward[0];
  Vec3 across = cross(y.tangent, f0);
  if (edge.faces() == 2 && dot(across, edge.inward[1]) < 0) across = -across;
  const double half = u0 < 0.5 ? 0 : 1;
  const double beta = kPi - edge.azimuths + (2 * u0 - half) * edge.azimuths + half * kPi;
  const double cosine = 2 * u1 - 1, sine = std::sqrt(1 - cosine * cosine);
  return y.tangent * cosine + (f0 * std::cos(beta) + across * std::sin(beta)) * sine;
}

bool SecondaryBoundary::find_light_end(Segment& g) {
  ++worker_.counts.rays;
  const Vec3 start = g.offset_ray_origin(scene_.caster.offset());
  const int t = scene_.first_hit(start, g.w);
  if (t < 0 || !faces(t, -g.w)) return false;
  g.light = scene_.point_on_triangle(t, start, g.w);  // beside the occluder even where it touches the surface
  g.r_s = length(g.light.p - g.y.y);
  return true;
}

bool SecondaryBoundary::find_camera_end(Segment& g) {
  ++worker_.counts.rays;
  const int t = scene_.first_hit(g.offset_ray_origin(scene_.caster.offset()), -g.w);
  if (t < 0 || !faces(t, g.w)) return false;
  g.camera_end = scene_.point_on_triangle(t, g.y.y, -g.w);
  g.r_d = length(g.camera_end.p - g.y.y);
  // A surface that holds the edge is S, see offset_ray_origin: rays that graze it too closely end on it both ways.
  if (!(g.r_d > scene_.caster.offset())) return false;
  return differentiate(g) || any_may_move_ || may_flow(g.camera_end) || may_flow(g.light);
}

void SecondaryBoundary::walk_to_camera(const Segment& g, int of_pixel, double scale, int vertices, Rng& rng) {
  const bool captures = scene_.captures();
  const SurfacePoint eye = scene_.sensor_point(of_pixel);
  const double extra = scene_.extra_length(of_pixel);
  Rgb throughput(1.0);
  walk_.assign(1, g.camera_end);
  WalkDensities densities;
  Vec3 from = g.w;  // unit, towards where the light comes from
  double walked = 0;
  for (int bounce = 1; bounce <= vertices; ++bounce) {
    const SurfacePoint x = walk_.back();
    const Vec3 to_camera = eye.p - x.p;
    const double distance = length(to_camera);
    // Light that returns along the segment it is seen through (confocal capture) has one boundary, found from the camera's side.
    const bool is_confocal_return = bounce == 1 && is_light(g.light.triangle) && g.light.p == eye.p;
    if (const int pixel = captures ? of_pixel : scene_.camera.project(x.p); pixel >= 0 && !is_confocal_return) {
      const Vec3 w_o = to_camera / distance;
      const Rgb f = bsdf_value(scene_, x, {x.n, from, w_o, dot(x.n, from), dot(x.n, w_o), dot(from, w_o)});
      // Zero for a face seen edge-on, which has no flow along the pixel's ray either.
      const double importance = scene_.importance(pixel, -w_o) * solid_angle_to_area(eye.p, x);
      if (!f.is_black() && importance > 0 && worker_.visible(eye, x)) {
        WalkDensities all = densities;
        if (bounce > 1) all.towards_light *= towards(eye, x, walk_[bounce - 2]);
        connections_.push_back({pixel, bounce, throughput * f * (importance * scale),
                                extra + walked + distance * scene_.index_between(x, eye),
                                camera_over_edge(g, x, bounce, pixel, all), bounce > 1 ? walk_[1] : SurfacePoint{}});
      }
    }
    if (bounce == vertices || !russian_roulette(throughput, bounce, rng)) return;
    const auto next = trace_next_vertex(worker_, x, from, throughput, rng, TransportMode::importance);
    if (!next) return;
    from = -next->direction;
    walked += length(next->point.p - x.p) * scene_.index_between(x, next->point);
    const double others = g.r_d + g.r_s + length(next->point.p - eye.p);
    if (extra + walked + others * scene_.least_index() > worker_.gates.upper()) return;
    densities.towards_camera *= next->pdf * solid_angle_to_area(x.p, next->point);
    if (bounce > 1) densities.towards_light *= towards(next->point, x, walk_[bounce - 2]);
    walk_.push_back(next->point);
  }
}

BoundaryEdges::Pick SecondaryBoundary::pick_from_camera(int pixel, int bounces, Rng& rng) const {
  return edges_.pick_secondary(camera_warp(pixel, bounces).sample(rng.fine_uniform()));
}

void SecondaryBoundary::connect_edge(int pixel, const Rgb& throughput, const BoundaryEdges::Pick& pick, Rng& rng) {
  Segment g;
  g.y = BoundaryEdges::Sample(pick);
  if (join_camera_path(g, pixel, throughput)) finish(g, Found::from_camera, rng);
  worker_.sink.note_guide(camera_table(pixel, worker_.path.size() - 1), pick.x());
}

bool SecondaryBoundary::join_camera_path(Segment& g, int pixel, const Rgb& throughput) {
  const Path& path = worker_.path;
  g.camera_end = path.back();
  const Vec3 d = g.y.y - g.camera_end.p;
  g.r_d = length(d);
  if (!(g.r_d > 0)) return false;
  g.w = d / g.r_d;
  const int k = path.size() - 1;
  Rgb f;  // with the cosine
  if (k == 0) {
    f = Rgb(scene_.importance(pixel, g.w));
  } else {
    const Scattering s(path.vertex[k - 1].p, g.camera_end, g.y.y);
    f = bsdf_value(scene_, g.camera_end, s) * std::abs(s.cos_i);
  }
  if (f.is_black() || !g.orient()) return false;
  if (!(any_may_move_ || g.y.edge->moves || may_flow(g.camera_end) || may_meet_flowing(g, g.w))) return false;
  if (!find_light_end(g)) return false;
  if (!differentiate(g) && !any_may_move_ && !may_flow(g.camera_end) && !may_flow(g.light)) return false;
  ++worker_.counts.rays;
  if (scene_.caster.occluded(scene_.offset_ray_origin(g.camera_end, g.w), g.offset_ray_origin(scene_.caster.offset())))
    return false;
  WalkDensities densities = camera_densities_;
  if (k > 1) densities.towards_camera *= back(path.vertex[k - 1], g.camera_end, g.y.y);
  const double factor = g.sine / (g.r_d * g.r_d * g.y.pdf * camera_warp(pixel, k).density(g.y.x()));
  const double over_edge = k == 0 ? kOnlyFromCamera : camera_over_edge(g, path.vertex[1], k, pixel, densities);
  connections_.assign(1, {pixel, k, throughput * f * factor, path.length.back(), over_edge,
                          k > 1 ? path.vertex[k - 1] : SurfacePoint{}});
  return true;
}

void SecondaryBoundary::finish(const Segment& g, Found found, Rng& rng) {
  if (connections_.empty()) return;
  int fewest = connections_[0].bounces;
  before_.clear();
  const double length = (g.r_d + g.r_s) * scene_.index_between(g.camera_end, g.light);
  for (const Connection& c : connections_) {
    fewest = std::min(fewest, c.bounces);
    before_.push_back({c.pixel, c.length + length});
  }
  const std::span<const GatheredLight> lights =
      found == Found::from_light
          ? std::span(&light_of_end_, 1)
          : std::span(light_side_.gather(g.camera_end, g.light, before_, worker_.options.max_bounces - fewest, rng));
  const bool may_follow = scene_.flows.possible_at(g.camera_end.p) || scene_.flows.possible_at(g.light.p) ||
                          scene_.flows.camera_possible_at(g.camera_end.p);
  const bool keeps = scene_.flows.keep_length();
  const LocalDifferential* bound = nullptr;
  for (std::size_t i = 0; i < connections_.size(); ++i) {
    const Connection& c = connections_[i];
    if (!may_follow && !keeps && flow_of(c).empty()) continue;
    for (const GatheredLight& e : lights) {
      if (c.bounces + e.bounces > worker_.options.max_bounces) continue;
      if (e.target >= 0 && e.target != static_cast<int>(i)) continue;
      if (e.bounces == 0 && c.bounces <= at_length_alone_) continue;
      const bool ends = keeps && e.bounces == 0;
      const LocalDifferential* differential = ends         ? &with_kept_length(g, c, found)
                                              : may_follow ? &with_following(g, c, e.next)
                                                           : &flow_of(c);
      if (differential->empty()) continue;
      if (ends || may_follow || differential != bound) worker_.sink.bind(*(bound = differential));
      const bool straight = e.bounces == 0;
      const BoundaryDensities pdf =
          densities(g, c, straight ? before_[i].length : 0, straight ? draw_in_line(g, c, before_[i].length, rng) : 0);
      const double weight = found == Found::from_light  ? 1
                            : found == Found::from_edge ? pdf.of_edge()
                                                        : pdf.of_camera();
      worker_.sink.note_boundary(c.bounces + e.bounces, g.y.edge->face[0], pdf.camera_part());
      worker_.sink.add(c.pixel, c.value * e.value * weight, e.whole_length(before_[i].length), GateUse::value_only);
    }
  }
}

}  // namespace isochron
