// Ellipsoidal connections (theory sections 3 and 4, paper Section 5): paths of prescribed length. Three techniques,
// combined by multiple importance sampling:
//   surface arcs   q is put between a camera-side vertex x_k (the camera included) and a point y on an emitter, on an
//                  ellipse of total length tau;
//   emitter arcs   the emitter's point itself is put on a circle at the distance that is left;
//   light arcs     surface arcs with a vertex of a light subpath in the place of the emitter's point.
// Where paths keep their lengths (theory section 7) the ends of circles count, too: at the borders of emitters (EmitterBorders), and
// where circles begin, at the foot of the last scattering vertex q (front arcs: q on a conic from which the way to the foot has
// the length that is left).
// All need the segments next to the point on the arc outside of dielectrics: only there is the locus an ellipsoid of the optical length.
// A path that ends outside is found by emitter arcs, also if it went through dielectrics before.
// Every crossing arc is sampled once, but in meshes of many blocks, where candidates are a random choice and weigh as much more;
// beyond that only which arcs get their visibility tested is one, so the density of a technique is one over the arc's span.
// (The choice by contribution evaluates all arcs and tests as many of them as cost about as much again; the uniform one
// evaluates and tests only one arc.)
#pragma once
#include <span>
#include <vector>

#include "core/geometry/ellipsoid.h"
#include "core/techniques/emitter_borders.h"
#include "core/techniques/light_walk.h"
#include "core/techniques/target_lengths.h"
#include "core/techniques/worker.h"

namespace isochron {

/// Takes the light that EllipsoidalConnections::gather finds.
class LengthReceiver {
 public:
  virtual ~LengthReceiver() = default;
  /// `target` counts the lengths asked for; `value` is contribution over density from vertex 1 on, per unit of length and
  /// without the gate. The worker's path is the complete one.
  virtual void take(int target, int bounces, const Rgb& value) = 0;
};

class EllipsoidalConnections {
 public:
  /// Complete paths go to the receiver, or without one to the worker's sink.
  EllipsoidalConnections(Worker& worker, const GatePass& pass, LengthReceiver* receiver = nullptr)
      : worker_(worker), scene_(worker.scene), pass_(pass), receiver_(receiver), borders_(worker) {}

  /// Connections of the camera itself, which land on any pixel; contributions are scaled by `scale`. Not of captures.
  void sample_from_camera(double scale, Rng& rng);

  /// One path from `pixel` with connections at its vertices, but not at the camera; contributions are scaled by `scale`.
  void sample_walk(int pixel, double scale, Rng& rng);

  /// Walks on from vertex 1 of the worker's path, which vertex 0 sees, by up to `max_bounces` scattering vertices.
  /// Hands complete paths of the given lengths to the receiver, which there must be. Leaves the path grown.
  void gather(std::span<const double> lengths, int max_bounces, Rng& rng);

 private:
  /// One sampled point on an arc, before its visibility is known.
  struct ArcPoint {
    SurfacePoint point;
    double pdf = 0;  ///< of the point on its triangle's arc, per area and length
    Rgb value;       ///< contribution over density, unshadowed, without MIS weight
    int pixel = -1;
  };
  struct ArcPair {
    ArcPoint side[2];
    double weight() const { return side[0].value.max() + side[1].value.max(); }
  };

  /// Connections at the path's last vertex and at those of a walk from there.
  void connect_along(int pixel, double scale, int max_bounces, Rng& rng);

  /// Whether a connection of the worker's path to an emitter's triangle may contribute by any point on an arc. If not,
  /// for neither the path nor the emitter has a gradient, it does so only by points on triangles that move.
  bool any_arc_contributes(int emitter_triangle) const;

  void connect_surface(const TargetLength& target, int pixel, const Rgb& throughput, Rng& rng);
  void connect_light(const TargetLength& target, int pixel, const Rgb& throughput, Rng& rng);
  void connect_emitter(const TargetLength& target, int pixel, const Rgb& throughput, Rng& rng);
  void connect_front(const TargetLength& target, int pixel, const Rgb& throughput, Rng& rng);
  void connect_border(const TargetLength& target, int pixel, const Rgb& throughput, Rng& rng);

  /// Candidates for arcs between the path's last vertex and another focus: all triangles that may hold one, or some of
  /// the many of a fine mesh.
  void find_candidates(const EllipsoidBvh& bvh, const EllipsoidBvh::Focus& other, double low, double high,
                       double thinning);
  /// The path's last vertex with the half space that it scatters into; the camera with its field of view.
  EllipsoidBvh::Focus focus() const;
  /// A vertex with the half space that it scatters light from the direction w into.
  EllipsoidBvh::Focus scattering_focus(const SurfacePoint& x, const Vec3& w) const {
    return {x.p, scene_.two_sided(x.triangle) && dot(x.n, w) < 0 ? -x.n : x.n, 0, 1, true};
  }
  bool connects_light() const { return !receiver_ && worker_.balance.light_connections; }

  /// An arc to test.
  struct Choice {
    int arc;                     ///< number in arcs_
    double weight;               ///< unshadowed contribution over the probability
    double inverse_probability;  ///< one over the probability to be chosen, candidates' own included
  };
  /// Chooses some of the candidates' arcs, which sample(triangle, arcs) fills in: one uniformly, or several in proportion to
  /// the unshadowed contribution, as many as take about as long to test, by `rays` for each side of a pair, as all arcs took to
  /// evaluate. One random number does for all. Arcs that carry nothing are left out.
  template <class F>
  std::span<const Choice> choose(double pick, int rays, F&& sample);
  /// f(side, point, inverse probability) for each chosen point that carries something and that the last vertex sees, while it is
  /// at the end of the path.
  template <class F>
  void for_each_seen(std::span<const Choice> choices, F&& f);

  /// Surface arcs between the path's last vertex and y, the focus `other`, which light reaches by a way of that optical length.
  /// `leaving(y, w)`: what y sends in the unit direction w, with the cosine there; `complete(side, q, inverse probability)`: of a
  /// chosen q that the path's last vertex sees, while it is at the end of the path.
  template <class Leaving, class Complete>
  void connect_arcs(const TargetLength& target, double way_of_light, const EllipsoidBvh::Focus& other, bool any_arc,
                    int pixel, const Rgb& factor, Rng& rng, const SurfacePoint& y, Leaving&& leaving,
                    Complete&& complete);
  /// Samples the arc of `ellipsoid` on triangle t; leaves `out` black when there is none or nothing is carried. `end(q)`: where a path by
  /// q gets its light from, the second focus or, of front arcs, the foot of q; `leaving`: see connect_arcs.
  template <class End, class Leaving>
  void surface_arc_point(const Ellipsoid& ellipsoid, const FocalTriangle& triangle, int t, End&& end, Leaving&& leaving,
                         double along, int pixel, const Rgb& factor, ArcPoint& out) const;
  /// What the point of an emitter sends, as `leaving`.
  auto leaves_emitter() const {
    return [this](const SurfacePoint& y, const Vec3& w) {
      const double cosine = is_light(y.triangle) ? 1 : dot(y.n, w);
      return cosine > 0 ? scene_.emitted(y, w) * cosine : Rgb();
    };
  }
  void emitter_arc_point(const Ellipsoid& sphere, const FocalTriangle& triangle, int t, double along, int pixel,
                         const Rgb& throughput, ArcPoint& out) const;
  /// At the path's last vertex, which is not its first: from the one before, to the unit direction `w`.
  Directions scattering_to(const Vec3& w) const;

  /// The worker's path is complete, by its vertex number `on_arc`, the point `found`, and as long as side i of the target says.
  void deliver(const TargetLength& target, int i, const ArcPoint& found, double inverse_probability, int on_arc);

  /// Whether to sample what a flow that keeps the length carries across the ends of circles.
  bool has_flux(const TargetLength& target) const {
    return !target.pair && !receiver_ && worker_.differential_sink && scene_.flows.keep_length();
  }

  Worker& worker_;
  const PreparedScene& scene_;
  const GatePass pass_;
  LengthReceiver* const receiver_;
  EmitterBorders borders_;
  LightWalk light_;
  bool light_is_traced_ =
      false;  ///< for the sample: late, as its first random numbers, which are the most even, are for other arcs
  std::vector<TargetLength> targets_;
  std::vector<ArcPair> arcs_;
  Vec3 back_;  ///< unit direction from the path's last vertex to the one before
  std::vector<Choice> choices_;
};

}  // namespace isochron
