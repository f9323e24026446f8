// Secondary visibility boundary: a path segment D-S grazes an edge at y (theory section 5, "Secondary"). Several ways
// to find such segments, combined by multiple importance sampling (balance heuristic; BoundaryDensities):
//   - from the edge, direction within the wedge of grazing directions;
//   - from the edge, aimed at a point on an emitter;
//   - from the camera: D is a vertex of a camera path, y a point of a random edge. Finds what a narrow field of view
//     or a glossy surface sees;
//   - under narrow gates, from the camera at a length drawn from the gates: y is where the shadow of a random edge, cast
//     from D onto an emitter's plane, is at the distance that is left; or y is random, and D moved within its pixel, along either
//     image axis, to where the length is right;
//   - or, for D that the camera sees, from the edge: y is where the shadow, cast from a random point of an emitter onto a surface, has the right
//     length. Where one's density vanishes another's does not.
// From the edge, the D side walks on and connects to the camera at every vertex. Segments that end at a light without an
// extent, or begin at the sensor point of a capture, are found in one way each: from an edge point, which determines them.
#pragma once
#include <vector>

#include "core/techniques/boundary_edges.h"
#include "core/techniques/boundary_guide.h"
#include "core/techniques/light_side.h"

namespace isochron {

/// Densities of finding a segment, and the weights that follow (balance heuristic).
struct BoundaryDensities {
  double
      camera_over_edge;  ///< from the camera, by a random edge point, over from an edge; infinite: only the camera finds it
  double camera_at_length = 0;  ///< from the camera at a length over that by a random edge point
  double edge_at_length = 0;    ///< from an edge at a length over that in a random direction
  bool random = true;           ///< whether random ones are drawn

  /// The weights of contributions, divided by the densities of random ones, of all that begins at an edge, and of all from the camera: at a
  /// length the part of a segment is larger as the density is.
  double of_edge() const { return 1 / (from_edge() + camera_over_edge * from_camera()); }
  double of_camera() const { return camera_over_edge > 0 ? 1 / (from_edge() / camera_over_edge + from_camera()) : 0; }
  /// The part that the camera takes in all.
  double camera_part() const { return of_camera() * from_camera(); }

 private:
  double from_edge() const { return (random ? 1 : 0) + edge_at_length; }
  double from_camera() const { return (random ? 1 : 0) + camera_at_length; }
};

class SecondaryBoundary {
 public:
  /// There must be edges to sample from where a sample is asked for (`has_secondary`). `narrow_gates`: use the techniques
  /// that draw lengths from the gates.
  SecondaryBoundary(Worker& worker, const BoundaryEdges& edges, const BoundaryGuide& guide, bool narrow_gates);

  /// One segment from an edge, and under narrow gates one more at a length; contributions are scaled by `scale` (one over the number of such
  /// samples). `pixel`: which it serves in a capture; a camera's lands on any.
  void sample_from_edge(int pixel, double scale, Rng& rng);

  /// One segment from an edge to a light without an extent, likewise. There must be such lights.
  void sample_from_light(int pixel, double scale, Rng& rng);

  /// One camera path through `pixel`, with a random edge point at each of its vertices; of a capture also at the sensor point.
  void sample_from_camera(int pixel, double scale, Rng& rng);

 private:
  friend class BoundaryWeights;  // looks at the densities of segments that one technique finds and others could find

  /// The boundary segment: from D (camera side) through the edge point along the unit direction w to S (light side).
  struct Segment {
    BoundaryEdges::Sample y;
    Vec3 w, n_b;
    double sine = 0;
    int side = 0;  ///< of n_b on which the occluder lies
    SurfacePoint camera_end, light;
    double r_d = 0, r_s = 0;

    /// Sets sine, n_b (normal to the edge and to w) and side, from y and w. False where there is no boundary.
    bool orient();
    /// The edge point moved off the occluder, and some more towards D: where the edge lies in a surface that the
    /// occluder touches, both rays start in front of it, so that it is S. It is not D as well: a path counts once.
    Vec3 offset_ray_origin(double offset) const;
  };

  /// A way from D to the camera.
  struct Connection {
    int pixel;
    int bounces;              ///< scattering vertices on the camera side, D included
    Rgb value;                ///< without multiple importance sampling
    double length;            ///< camera to D
    double camera_over_edge;  ///< density of finding the segment from the camera over that from the edge
    SurfacePoint before;      ///< the vertex before D; none (triangle -1) where D is x1
  };
  enum class Found { from_edge, from_camera, from_light };

  const Warp& edge_warp() const { return guide_.warp(BoundaryGuide::table(Technique::from_edge)); }
  /// For edge points drawn from D, vertex `bounces` of a path through the pixel.
  const Warp& camera_warp(int pixel, int bounces) const { return guide_.warp(camera_table(pixel, bounces)); }
  int camera_table(int pixel, int bounces) const {
    return BoundaryGuide::table_from_camera(scene_.camera, pixel, bounces);
  }

  /// Whether the triangle scatters light to the side that w points to.
  bool faces(int triangle, const Vec3& w) const;

  /// Uniform in azimuth over the grazing wedge (see BoundaryEdge::azimuths) and in the cosine to the edge.
  static Vec3 direction_in_wedge(const BoundaryEdges::Sample& y, double u0, double u1);

  /// Density per solid angle of w from the edge: wedge and aimed together. `g.light` is known.
  double direction_pdf(const Segment& g) const;

  /// Conservative test: may the ray from the edge point along w end on moving geometry, or on a point that follows it?
  bool may_meet_flowing(const Segment& g, const Vec3& w) const {
    return scene_.flowing_bounds.meets_ray(g.offset_ray_origin(scene_.caster.offset()), w);
  }
  bool may_flow(const SurfacePoint& x) const {
    return scene_.has_moving_vertex(x.triangle) || scene_.flows.possible_at(x.p);
  }

  /// One segment from an edge in a random direction: within the wedge, or aimed at an emitter.
  void search_from_edge(int pixel, double scale, Rng& rng);

  /// Traces from the edge point along w to S. False where there is none, or it faces away.
  bool find_light_end(Segment& g);

  /// Traces from the edge point against w to D. False where there is none, it faces away, or nothing moves.
  bool find_camera_end(Segment& g);

  /// The speed of the edge relative to the line that grazes it, as a linear form in vertex velocities, where D and S
  /// follow nothing; once with D as x1, once as a material point. False when nothing moves.
  bool differentiate(const Segment& g);

  /// The same on the path of connection c that continues to `next` (none: triangle -1), with what D and S follow.
  const LocalDifferential& with_following(const Segment& g, const Connection& c, const SurfacePoint& next);
  /// The same on a path that ends at S, which moves so that the length is kept if paths do so.
  const LocalDifferential& with_kept_length(const Segment& g, const Connection& c, Found found);

  /// Of the vertices from x1 to D: the product of the densities per area with which BSDF sampling draws each of them, walking
  /// towards the light or towards the camera.
  struct WalkDensities {
    double towards_light = 1, towards_camera = 1;
  };
  /// The factors of these products that a vertex x gives, between `before` (camera side) and `after` (light side): density of
  /// drawing `after`, and that of drawing `before`.
  double towards(const SurfacePoint& before, const SurfacePoint& x, const SurfacePoint& after) const;
  double back(const SurfacePoint& before, const SurfacePoint& x, const Vec3& after) const;

  /// Density of finding the segment from the camera, by a path on which D is vertex k, over that of finding it from the edge.
  double camera_over_edge(const Segment& g, const SurfacePoint& x1, int k, int pixel, const WalkDensities& walk) const;

  /// What `differentiate` found for a D that is x1, or for one that moves with its material.
  const LocalDifferential& flow_of(const Connection& c) const {
    return scene_.flow_rank(c.bounces) == 1 ? camera_flow_ : material_flow_;
  }

  /// Walks on from D, away from the light, and collects a connection to the camera, or to the sensor point of the pixel, at
  /// every one of so many vertices at most.
  void walk_to_camera(const Segment& g, int of_pixel, double scale, int vertices, Rng& rng);

  /// Includes the worker's last vertex but one, which is number `bounce`, in `camera_densities_`.
  void extend_camera_densities(int bounce);

  /// Draws an edge point for D, vertex `bounces` of a path through the pixel.
  BoundaryEdges::Pick pick_from_camera(int pixel, int bounces, Rng& rng) const;

  /// D is the last vertex of the worker's path: tries the edge point.
  void connect_edge(int pixel, const Rgb& throughput, const BoundaryEdges::Pick& pick, Rng& rng);

  void walk_from_camera(int pixel, double scale, double tau, Rng& rng);

  /// As `connect_edge`, for light straight from an emitter on paths of length tau.
  void connect_edge_at_length(int pixel, const Rgb& throughput, double tau, Rng& rng);
  /// For light of one bounce on paths of length tau: a random edge point; a random one of the pixel's image coordinates, and the other
  /// (`axis`) such that the length is right.
  void connect_pixel_at_length(int pixel, int axis, double scale, double tau, Rng& rng);
  /// For light of one bounce on paths of length tau: a random point of an emitter; a triangle in line with it and a random point of an edge; the
  /// point of that edge whose shadow on the triangle has the length.
  void connect_lamp_at_length(double scale, Rng& rng);
  /// Puts y at point s of the edge, and w towards the emitter's point. False where the edge casts no shadow of it.
  static bool aim(Segment& g, const SurfacePoint& lamp, double s);
  /// The same, and finds the triangles that the line from the emitter's point meets behind the edge and that face it; none without a shadow.
  void find_in_line(Segment& g, const SurfacePoint& lamp, double s);
  /// D, the last vertex of the worker's path, y and tau are given: hands the path by an emitter's triangle to the sink.
  bool deliver_at_length(Segment& g, int pixel, int emitter, const Rgb& throughput, double tau, Rng& rng);
  /// The same of a segment with its one connection; `in_line`: see `densities`.
  bool deliver_at_length(const Segment& g, Found found, double tau, double in_line);

  /// Of a segment, and of light straight from S if that is on an emitter of a path of such a `length`; 0: other light. `in_line`: probability
  /// of D's triangle in connect_lamp_at_length, given the random point of the edge; it belongs to the sample. For segments that others find
  /// `draw_in_line` draws it.
  BoundaryDensities densities(const Segment& g, const Connection& c, double length, double in_line) const;
  double draw_in_line(const Segment& g, const Connection& c, double length, Rng& rng);
  /// Whether the camera sees x through no dielectric.
  bool sees_outside(const SurfacePoint& x) const { return scene_.outside(x, scene_.sensor_point(GatePick::kImage)); }
  /// Densities of the segment when the length is drawn from the gates, over that of a random edge point from the camera, and over that of a
  /// random direction from the edge. Lengths are drawn only for segments outside of dielectrics.
  double length_over_random(const Segment& g, const Connection& c, double length) const;
  double length_over_direction(const Segment& g, const Connection& c, double length) const;

  /// The part of the former that moves D within its pixel, where D is x1, without densities of the emitter and the length.
  double rate_in_pixel(const Segment& g, int pixel) const;

  /// D is the last vertex of the worker's path and y is given: completes the segment and its one connection.
  bool join_camera_path(Segment& g, int pixel, const Rgb& throughput);

  /// Gathers the light that S sends towards D and joins it with every connection.
  void finish(const Segment& g, Found found, Rng& rng);

  Worker& worker_;
  const PreparedScene& scene_;
  const BoundaryEdges& edges_;
  const BoundaryGuide& guide_;
  const BoundaryTechniques techniques_;
  const bool at_length_;       ///< from the camera
  const bool edge_at_length_;  ///< from edges
  /// Up to so many bounces light straight from emitters is found at lengths alone: under Dirac gates, which let no random segment through, any; of
  /// other narrow gates where paths keep their lengths, one, for which there are enough techniques that find every segment.
  const int at_length_alone_;
  const double camera_over_edge_rate_;  ///< samples of segments from the camera over those from an edge
  const double aimed_share_;            ///< of the directions from an edge
  LightSide light_side_;
  /// Whether a segment can move although neither its edge nor its ends do: by other vertices of a path that keeps its length.
  const bool any_may_move_;
  LocalDifferential camera_flow_, material_flow_, following_, of_length_;
  std::vector<SurfacePoint> whole_;  ///< the path from the camera to S
  std::vector<SurfacePoint> walk_;
  WalkDensities camera_densities_;  ///< of the worker's path, up to its last vertex but one
  std::vector<Connection> connections_;
  GatheredLight light_of_end_;      ///< of a segment from a light
  std::vector<CameraSide> before_;  ///< up to S, one per connection
  std::vector<int> in_line_;        ///< of find_in_line
};

}  // namespace isochron
