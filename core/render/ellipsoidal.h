// Ellipsoidal connections (theory sections 3 and 4, paper Section 5): paths of prescribed length. Two techniques,
// combined by multiple importance sampling:
//   surface arcs   q is put between a camera-side vertex x_k (the camera included) and a point y on an emitter, on an
//                  ellipse of total length tau;
//   emitter arcs   the emitter's point itself is put on a circle at the distance that is left.
// Both need all their segments outside of dielectrics: only there is the locus an ellipsoid of the optical length. A path
// that ends outside is found by emitter arcs, whatever it went through before.
// Every crossing arc is sampled once; only which of them gets its visibility tested is a random pick, so the density
// of a technique is one over the arc's span.
#pragma once
#include <span>

#include "core/geometry/ellipsoid.h"
#include "core/render/worker.h"

namespace isochron {

/// What the gate's derivative asks of a pass.
struct GatePass {
  bool value = false;        ///< lengths drawn from W
  GateUse use = GateUse::value;
  bool pairs = false;        ///< lengths drawn in pairs from dW
  PairPart part = PairPart::smooth;
  bool coupled = true;
};

/// Complete paths go to the worker's sink.
struct ToSink {};

/// `Receiver`: ToSink, or what takes the light that `gather` finds.
template <class Sink, class Receiver = ToSink>
class EllipsoidalConnections {
 public:
  EllipsoidalConnections(Worker<Sink>& worker, const GatePass& pass, Receiver receiver = {})
      : worker_(worker), scene_(worker.scene), pass_(pass), receiver_(receiver) {}

  /// One camera path through `pixel` with connections at every vertex. Contributions to the pixel itself are scaled by
  /// `scale`; those of the camera's own connections, which land on any pixel, by `scale` / number of pixels.
  void sample(int pixel, double scale, Rng& rng) {
    draw_targets(rng);
    if (targets_.empty()) return;
    const double splat_scale = scale / scene_.camera.pixels();
    const int max_bounces = worker_.options.max_bounces;
    worker_.start_path_at_camera();
    for (const Target& target : targets_) {
      connect_emitter(target, pixel, Rgb(splat_scale), rng);
      if (max_bounces >= 1) connect_surface(target, pixel, Rgb(splat_scale), rng);
    }
    if (max_bounces < 1 || !worker_.start_camera_path(pixel, rng)) return;
    connect_along(pixel, scale, max_bounces, rng);
  }

  /// Walks on from vertex 1 of the worker's path, which vertex 0 looks at, by up to `max_bounces` scattering vertices.
  /// Hands complete paths of the given lengths to receiver.take(i, bounces, value): i counts the lengths, value is
  /// contribution over density from vertex 1 on, per unit of length and without the gate. Leaves the path grown.
  void gather(std::span<const double> lengths, int max_bounces, Rng& rng) {
    targets_.clear();
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      if (!(lengths[i] > 0)) continue;
      Target t;
      t.tau[0] = lengths[i];
      t.present[0] = true;
      t.index = static_cast<int>(i);
      targets_.push_back(t);
    }
    connect_along(-1, 1, max_bounces, rng);
  }

 private:
  static constexpr bool kGathers = !std::is_same_v<Receiver, ToSink>;

  /// Connections at the path's last vertex and at those of a walk from there.
  void connect_along(int pixel, double scale, int max_bounces, Rng& rng) {
    Path& path = worker_.path;
    Rgb throughput(1.0);
    for (int bounce = 1; bounce <= max_bounces; ++bounce) {
      const double needed = path.length.back() + scene_.distance_to_emitters(path.back().p);
      bool reachable = false;
      for (const Target& target : targets_) {
        if (!(needed < target.longest())) continue;
        reachable = true;
        connect_emitter(target, pixel, throughput * scale, rng);
        if (bounce < max_bounces) connect_surface(target, pixel, throughput * scale, rng);
      }
      if (!reachable || bounce == max_bounces || !survives(throughput, bounce, rng)) return;
      if (!extend(worker_, path, throughput, rng)) return;
    }
  }

  /// One length drawn from W, or the two sides of a pair drawn from dW (first plus, then minus).
  struct Target {
    double tau[2] = {0, 0};
    bool present[2] = {false, false};
    bool pair = false;
    int gate = 0;   ///< of a pair
    int index = 0;  ///< among the lengths gathered for
    double scale = 0;
    double longest() const { return std::max(present[0] ? tau[0] : 0, present[1] ? tau[1] : 0); }
    double shortest() const { return present[0] && present[1] ? std::min(tau[0], tau[1]) : longest(); }
  };

  /// One sampled point on an arc, before its visibility is known.
  struct ArcPoint {
    SurfacePoint point;
    double span = 0, area_rate = 0;  ///< density of the point: 1 / (span * area_rate) per area and length
    Rgb value;                       ///< contribution over density, unshadowed, without MIS weight
    int pixel = -1;
  };
  struct ArcPair {
    ArcPoint side[2];
    double weight() const { return side[0].value.max() + side[1].value.max(); }
  };

  void draw_targets(Rng& rng) {
    const GateSet& gates = worker_.gates;
    const GateShape& shape = gates.shape();
    targets_.clear();
    if (pass_.value) {
      const double pick = rng.uniform(), u = rng.uniform();
      Target t;
      t.tau[0] = gates.sample_mixture(pick, u);
      t.present[0] = t.tau[0] > 0;
      if (t.present[0]) {
        t.scale = 1 / gates.mixture_pdf(t.tau[0]);
        targets_.push_back(t);
      }
    }
    if (pass_.pairs) {
      const double pick = rng.uniform(), u = rng.uniform();
      Target t;
      t.pair = true;
      t.gate = std::min(static_cast<int>(pick * gates.size()), gates.size() - 1);
      t.scale = shape.pair_mass(pass_.part) * gates.size();
      if (!(t.scale > 0)) return;
      const CoupledPair pair = shape.sample_pair(pass_.part, u);
      t.tau[0] = gates.center(t.gate) + pair.plus;
      t.tau[1] = gates.center(t.gate) + pair.minus;
      t.present[0] = pair.has_plus && t.tau[0] > 0;
      t.present[1] = pair.has_minus && t.tau[1] > 0;
      if (pass_.coupled) {
        targets_.push_back(t);
      } else {
        for (int i = 0; i < 2; ++i) {
          Target alone = t;
          alone.present[1 - i] = false;
          targets_.push_back(alone);
        }
      }
    }
  }

  /// Whether connecting to emitter point y can only matter through the connecting vertex itself.
  bool ends_are_static(int emitter_triangle) const {
    if constexpr (!Sink::kDifferential || kGathers) return false;
    return !can_move(scene_, worker_.path, worker_.path.size() - 1, emitter_triangle);
  }

  void connect_surface(const Target& target, int pixel, const Rgb& throughput, Rng& rng) {
    const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
    const double along = rng.uniform();
    double pick = rng.uniform();
    double pdf_y;
    const SurfacePoint y = scene_.sample_emitter(u0, u1, u2, pdf_y);
    const Path& path = worker_.path;
    const SurfacePoint& x = path.back();
    const double before = path.length.back();
    const double high = target.longest() - before, low = target.shortest() - before;
    if (!(high > length(x.p - y.p))) return;

    const Ellipsoid ellipsoids[2] = {{x.p, y.p, target.tau[0] - before}, {x.p, y.p, target.tau[1] - before}};
    const EllipsoidBvh& bvh = ends_are_static(y.triangle) ? scene_.moving_triangles : scene_.all_triangles;
    worker_.candidates.clear();
    bvh.query_surfaces(x.p, y.p, low, high, worker_.candidates);
    worker_.arcs += static_cast<long long>(worker_.candidates.size());

    const Rgb factor = throughput * scene_.shape_of(y.triangle).emission * (1 / pdf_y);
    ArcPair chosen;
    double total = 0, chosen_weight = 0;
    for (const int t : worker_.candidates) {
      const double side_x = scene_.height_over(t, x.p), side_y = scene_.height_over(t, y.p);
      const bool two_sided = scene_.material_of(t).two_sided;
      if (!((side_x > 0 && side_y > 0) || (two_sided && side_x < 0 && side_y < 0))) continue;
      ArcPair arcs;
      for (int i = 0; i < 2; ++i)
        if (target.present[i] && ellipsoids[i].valid())
          surface_arc_point(ellipsoids[i], t, y, along, pixel, factor, arcs.side[i]);
      choose(arcs, pick, total, chosen, chosen_weight);
    }
    if (!(total > 0)) return;
    const double inverse_probability = total / chosen_weight;
    for (int i = 0; i < 2; ++i) {
      const ArcPoint& q = chosen.side[i];
      if (q.value.is_black()) continue;
      const bool seen = path.size() == 1 ? worker_.visible_from_camera(q.point) : worker_.visible(x, q.point);
      if (!seen || !worker_.visible(q.point, y)) continue;
      const double by_surface = pdf_y / (q.span * q.area_rate);
      const double by_emitter = walk_pdf(q.point) * emitter_arc_pdf(q.point, y);
      worker_.path.push(scene_, q.point);
      worker_.path.push(scene_, y);
      deliver(target, i, q.pixel, q.value * (inverse_probability * by_surface / (by_surface + by_emitter)));
      worker_.path.pop();
      worker_.path.pop();
    }
  }

  void connect_emitter(const Target& target, int pixel, const Rgb& throughput, Rng& rng) {
    const double along = rng.uniform();
    double pick = rng.uniform();
    const Path& path = worker_.path;
    const SurfacePoint& x = path.back();
    const double before = path.length.back();
    const double high = 2 * (target.longest() - before), low = 2 * (target.shortest() - before);
    if (!(high > 0)) return;
    worker_.candidates.clear();
    scene_.emitter_triangles.query(x.p, x.p, low, high, worker_.candidates);
    if (worker_.candidates.empty()) return;

    const Ellipsoid spheres[2] = {{x.p, x.p, 2 * (target.tau[0] - before)}, {x.p, x.p, 2 * (target.tau[1] - before)}};
    ArcPair chosen;
    double total = 0, chosen_weight = 0;
    for (const int t : worker_.candidates) {
      if (!(dot(scene_.normal[t], x.p - scene_.corner(t, 0)) > 0) || ends_are_static(t)) continue;
      ArcPair arcs;
      for (int i = 0; i < 2; ++i)
        if (target.present[i] && spheres[i].valid())
          emitter_arc_point(spheres[i], t, along, pixel, throughput, arcs.side[i]);
      choose(arcs, pick, total, chosen, chosen_weight);
    }
    if (!(total > 0)) return;
    const double inverse_probability = total / chosen_weight;
    for (int i = 0; i < 2; ++i) {
      const ArcPoint& y = chosen.side[i];
      if (y.value.is_black()) continue;
      if (!(path.size() == 1 ? worker_.visible_from_camera(y.point) : worker_.visible(x, y.point))) continue;
      double weight = 1;
      if (path.size() > (kGathers ? 2 : 1)) {
        const SurfacePoint& previous = path.vertex[path.size() - 2];
        const double by_emitter = vertex_pdf() / (y.span * y.area_rate);
        const double by_surface =
            scene_.outside(previous, x) ? scene_.emitter_pdf(y.point.triangle) * surface_arc_pdf(previous, x, y.point)
                                        : 0;
        weight = by_emitter / (by_emitter + by_surface);
      }
      worker_.path.push(scene_, y.point);
      deliver(target, i, y.pixel, y.value * (inverse_probability * weight));
      worker_.path.pop();
    }
  }

  /// Weighted reservoir over arcs: keeps one in proportion to its unshadowed contribution, re-using one number.
  static void choose(const ArcPair& arcs, double& pick, double& total, ArcPair& chosen, double& chosen_weight) {
    const double weight = arcs.weight();
    if (!(weight > 0)) return;
    total += weight;
    const double share = weight / total;
    if (pick < share) {
      chosen = arcs;
      chosen_weight = weight;
      pick /= share;
    } else {
      pick = (pick - share) / (1 - share);
    }
  }

  /// Samples the arc of `ellipsoid` on triangle t; leaves `out` black when there is none or nothing is carried.
  void surface_arc_point(const Ellipsoid& ellipsoid, int t, const SurfacePoint& y, double along, int pixel,
                         const Rgb& factor, ArcPoint& out) const {
    EllipseArcs arcs;
    if (!clip_ellipse(ellipsoid, scene_.corner(t, 0), scene_.corner(t, 1), scene_.corner(t, 2), arcs)) return;
    const double phi = arcs.angle(along);
    const SurfacePoint q = scene_.point_in_plane(t, arcs.point(phi));
    const Path& path = worker_.path;
    const SurfacePoint& x = path.back();
    if (!scene_.outside(x, q)) return;
    const Scattering s(x.p, q, y.p);
    const double cos_y = -dot(y.n, s.w_i);
    if (!(cos_y > 0)) return;
    const Material& material = scene_.material_of(t);
    double carried = s.lobe(material) * std::abs(s.cos_i * s.cos_o) * cos_y /
                     (s.distance_i * s.distance_i * s.distance_o * s.distance_o);
    Rgb albedo = material.albedo;
    out.pixel = pixel;
    if (path.size() == 1) {
      out.pixel = scene_.camera.project(q.p);
      if (out.pixel < 0) return;
      carried *= scene_.camera.image_area_per_solid_angle(-s.w_o);
    } else {
      const Scattering at_x(path.vertex[path.size() - 2].p, x, q.p);
      const Material& material_x = scene_.material_of(x.triangle);
      carried *= at_x.lobe(material_x) * std::abs(at_x.cos_i);
      albedo *= material_x.albedo;
    }
    if (!(carried > 0)) return;
    out.span = arcs.total_span;
    out.area_rate = area_per_angle_and_length(ellipsoid, arcs, phi, q.n);
    out.value = factor * albedo * (carried * out.span * out.area_rate);
    out.point = q;
  }

  void emitter_arc_point(const Ellipsoid& sphere, int t, double along, int pixel, const Rgb& throughput,
                         ArcPoint& out) const {
    EllipseArcs arcs;
    if (!clip_ellipse(sphere, scene_.corner(t, 0), scene_.corner(t, 1), scene_.corner(t, 2), arcs)) return;
    const SurfacePoint y = scene_.point_in_plane(t, arcs.point(arcs.angle(along)));
    const Path& path = worker_.path;
    const SurfacePoint& x = path.back();
    if (!scene_.outside(x, y)) return;
    const double distance = 0.5 * sphere.tau;
    const Vec3 w = (y.p - x.p) / distance;
    const double cos_y = -dot(y.n, w);
    if (!(cos_y > 0)) return;
    double carried = cos_y / (distance * distance);
    Rgb albedo(1.0);
    out.pixel = pixel;
    if (path.size() == 1) {
      out.pixel = scene_.camera.project(y.p);
      if (out.pixel < 0) return;
      carried *= scene_.camera.image_area_per_solid_angle(w);
    } else {
      const Scattering at_x(path.vertex[path.size() - 2].p, x, y.p);
      const Material& material = scene_.material_of(x.triangle);
      carried *= at_x.lobe(material) * std::abs(at_x.cos_i);
      albedo = material.albedo;
    }
    if (!(carried > 0)) return;
    out.span = arcs.total_span;
    out.area_rate = distance;  // on a circle about the foot of x in the plane, dA = r dr dphi with r the distance
    out.value = throughput * albedo * scene_.shape_of(t).emission * (carried * out.span * out.area_rate);
    out.point = y;
  }

  /// Density per area with which a walk that stands at the path's last vertex goes on to q (from the camera: by a
  /// random point of a random pixel).
  double walk_pdf(const SurfacePoint& q) const { return step_pdf(worker_.path.size() - 1, q); }
  /// The same for the path's own last vertex.
  double vertex_pdf() const { return step_pdf(worker_.path.size() - 2, worker_.path.back()); }

  double step_pdf(int from, const SurfacePoint& q) const {
    const Path& path = worker_.path;
    const SurfacePoint& x = path.vertex[from];
    const double to_area = solid_angle_to_area(x.p, q);
    if (from == 0)
      return scene_.camera.image_area_per_solid_angle(normalize(q.p - x.p)) * to_area / scene_.camera.pixels();
    const Scattering s(path.vertex[from - 1].p, x, q.p);
    return s.pdf_towards_light(scene_.material_of(x.triangle)) * to_area;
  }

  /// Density of y on its emitter triangle's arc as seen from q, per area and length.
  double emitter_arc_pdf(const SurfacePoint& q, const SurfacePoint& y) const {
    const double distance = length(y.p - q.p);
    EllipseArcs arcs;
    const int t = y.triangle;
    if (!clip_ellipse({q.p, q.p, 2 * distance}, scene_.corner(t, 0), scene_.corner(t, 1), scene_.corner(t, 2), arcs))
      return 0;
    return 1 / (arcs.total_span * distance);
  }

  /// Density of q on its triangle's arc between foci x and y, per area and length.
  double surface_arc_pdf(const SurfacePoint& x, const SurfacePoint& q, const SurfacePoint& y) const {
    const Ellipsoid ellipsoid(x.p, y.p, length(q.p - x.p) + length(q.p - y.p));
    EllipseArcs arcs;
    const int t = q.triangle;
    if (!ellipsoid.valid() ||
        !clip_ellipse(ellipsoid, scene_.corner(t, 0), scene_.corner(t, 1), scene_.corner(t, 2), arcs))
      return 0;
    const Vec3 d = q.p - arcs.center;
    const double e11 = dot(arcs.e1, arcs.e1), e12 = dot(arcs.e1, arcs.e2), e22 = dot(arcs.e2, arcs.e2);
    const double d1 = dot(d, arcs.e1), d2 = dot(d, arcs.e2);
    const double phi = std::atan2(d2 * e11 - d1 * e12, d1 * e22 - d2 * e12);
    return 1 / (arcs.total_span * area_per_angle_and_length(ellipsoid, arcs, phi, q.n));
  }

  /// The worker's path is complete and as long as side i of the target says.
  void deliver(const Target& target, int i, int pixel, const Rgb& value) {
    if constexpr (kGathers) {
      receiver_.take(target.index, worker_.path.size() - 2, value);
    } else if (!target.pair) {
      if (worker_.matters(worker_.path)) worker_.emit(worker_.path, pixel, value * target.scale, target.tau[0], pass_.use);
    } else if constexpr (Sink::kDifferential) {
      differentiate_path(scene_, worker_.path.vertex.data(), worker_.path.size(), true, worker_.differential);
      if (worker_.differential.empty()) return;
      worker_.sink.bind(worker_.differential);
      worker_.sink.add_length_rate(pixel, target.gate, value * (i == 0 ? target.scale : -target.scale));
    }
  }

  Worker<Sink>& worker_;
  const PreparedScene& scene_;
  const GatePass pass_;
  [[no_unique_address]] Receiver receiver_;
  std::vector<Target> targets_;
};

}  // namespace isochron
