// What the estimators need of a scene at one value of the parameters, computed once.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "core/base/bounds.h"
#include "core/base/large_array.h"
#include "core/geometry/ellipsoid.h"
#include "core/geometry/ellipsoid_bvh.h"
#include "core/geometry/ray_caster.h"
#include "core/paths/differentiable.h"
#include "core/paths/emitters.h"
#include "core/paths/hidden_geometry.h"
#include "core/paths/records.h"
#include "core/paths/vertex_flow.h"
#include "core/scene/scene.h"
#include "core/scene/sensors/pinhole.h"
#include "core/scene/stacked_faces.h"

namespace isochron {

/// It can be kept from one value of the parameters to the next: `update` rebuilds what depends on what has changed.
class PreparedScene {
 public:
  PreparedScene(const Scene& source, const TangentBasis* basis, const FollowOptions& follow = {},
                CasterUpdate of_caster = CasterUpdate::rebuild);
  PreparedScene(const PreparedScene&) = delete;
  PreparedScene& operator=(const PreparedScene&) = delete;

  /// For `source`, which has the topology of the initial scene. The result does not depend on earlier updates.
  void update(const Scene& source, const TangentBasis* basis, const FollowOptions& follow);
  /// Whether each degree of freedom has as many entries in the basis as in that of the last update.
  bool same_columns(const TangentBasis* basis) const;
  /// The number of the last update. changed(t): that of the last one in which triangle t moved, or in which it, its vertices
  /// or its material began or ceased to be differentiable.
  int revision() const { return revision_; }
  int changed(int triangle) const { return changed_[triangle]; }
  /// That of the last update in which any of the shape's triangles may have changed.
  int shape_changed(int shape) const { return shape_changed_[shape]; }

  Scene scene;  ///< a copy
  CameraModel camera;
  DofLayout layout;
  Differentiable differentiable;
  VertexFlows flows;
  RayCaster caster;
  StackedFaces stacked;
  /// Of the triangles with a vertex that moves, grown by the rounding error of rays; and of all vertices but x1
  /// that may follow or be followed.
  Bounds moving_bounds, flowing_bounds;
  Emitters emitters;
  /// Lights without an extent: the scene's, or the spots of a capture's laser.
  std::vector<PointLight> lights;
  HiddenGeometry hidden;

  /// Triangles that ellipsoids are intersected with: all, those that can give a path a derivative, those that emit. A hierarchy
  /// is made when first asked for: standard sampling asks for none.
  enum class Part { all, moving, emitting };
  const EllipsoidBvh& hierarchy(Part part) const;

  int shape_index(int triangle) const { return records_[triangle].shape; }
  const Shape& shape_of(int triangle) const { return scene.shapes[shape_index(triangle)]; }
  const Bsdf& bsdf_of(int triangle) const { return *shapes_[shape_index(triangle)].bsdf; }
  /// Whether its material reflects on both sides.
  bool two_sided(int triangle) const { return shapes_[shape_index(triangle)].two_sided; }

  bool captures() const { return scene.capture.has_value(); }
  int pixels() const { return camera.pixels(); }
  bool leaves_out(int pixel) const { return captures() && scene.capture->leaves_out(pixel); }
  /// That have samples.
  double share_of_pixels() const {
    if (!captures() || scene.capture->left_out.empty()) return 1;
    const std::vector<char>& left_out = scene.capture->left_out;
    return static_cast<double>(std::count(left_out.begin(), left_out.end(), 0)) / static_cast<double>(left_out.size());
  }
  /// x0 of the paths of a pixel.
  SurfacePoint sensor_point(int pixel) const {
    if (!captures()) return {camera.position, {}, -1};
    const WallPoint& s = scene.capture->sensor_of(pixel);
    return {s.p, s.n, -1};
  }
  /// What a pixel makes of radiance from the unit direction w, per solid angle: of a camera, whose image holds the direction,
  /// image area; of a capture the wall's reflection.
  double importance(int pixel, const Vec3& w) const {
    if (!captures()) return camera.image_area_per_solid_angle(w);
    return std::max(0.0, dot(scene.capture->sensor_of(pixel).n, w)) * kInvPi;
  }
  /// The light that a pixel of a capture is lit by, in place of a triangle.
  int spot_of(int pixel) const { return index_of_light(scene.capture->spot_index(pixel)); }
  /// Length that every path of a pixel has besides the way from its sensor point to the laser's spot: from the laser to the
  /// spot and from the sensor point to the detector, and a time offset of its own (one that all share shifts the gates).
  /// 0 of a camera.
  double extra_length(int pixel) const {
    if (!captures()) return 0;
    const std::vector<double>& offsets = scene.detector.time_offset;
    return scene.capture->extra_length(pixel) + (offsets.size() == 1 ? 0 : offsets[scene.capture->sensor_index(pixel)]);
  }
  /// Whether light of one bounce returns along the way that it came.
  bool confocal() const { return captures() && scene.capture->confocal(); }
  /// The index k by which the rules for flows treat x_k. x1 of a camera keeps to its pixel's ray; x1 of a capture does not, so
  /// it counts as x2, and so on.
  int flow_rank(int k) const { return captures() ? k + 1 : k; }

  /// The texture at x, which multiplies the BSDF, of a shape that has one.
  double texture(const SurfacePoint& x) const {
    const auto b = barycentrics(x);
    const auto& v = records_[x.triangle].vertex;
    return b[0] * scene.texture[v[0]] + b[1] * scene.texture[v[1]] + b[2] * scene.texture[v[2]];
  }
  bool textured(int triangle) const { return shapes_[shape_index(triangle)].textured; }
  /// Its gradient along the surface.
  Vec3 texture_gradient(const SurfacePoint& x) const;

  /// Radiance that leaves the point of an emitter towards the unit direction w; of a light without an extent radiant
  /// intensity.
  Rgb emitted(const SurfacePoint& x, const Vec3& w) const {
    if (is_light(x.triangle)) return lights[light_number(x.triangle)].towards(w);
    return shapes_[shape_index(x.triangle)].emission.towards(x.n, w);
  }

  /// What the segment between x and y, which see each other, runs inside of: the shape of a transparent material with an end
  /// of the segment on the back of its face. Null outside. Opaque surfaces and the camera (triangle -1) know no medium: a
  /// segment between two of them counts as outside.
  const ShapeRecord* medium_between(const SurfacePoint& x, const SurfacePoint& y) const {
    if (!has_medium_) return nullptr;
    const Vec3 d = y.p - x.p;
    if (is_behind(x, d)) return &shapes_[shape_index(x.triangle)];
    if (is_behind(y, -d)) return &shapes_[shape_index(y.triangle)];
    return nullptr;
  }
  /// Optical length of the segment over its geometric length.
  double index_between(const SurfacePoint& x, const SurfacePoint& y) const {
    const ShapeRecord* medium = medium_between(x, y);
    return medium ? medium->index : 1;
  }
  bool outside(const SurfacePoint& x, const SurfacePoint& y) const { return !medium_between(x, y); }
  bool transparent(int triangle) const { return shapes_[shape_index(triangle)].index > 0; }
  /// Lower bound of the optical length of any path over the distance between its ends.
  double least_index() const { return least_index_; }

  /// Unit; zero when the triangle has no area.
  const Vec3& normal(int triangle) const { return records_[triangle].normal; }
  double area(int triangle) const { return records_[triangle].area; }
  bool emits(int triangle) const { return triangle >= 0 && records_[triangle].emits; }
  /// Whether a path through the triangle, or to the light in its place, can have a derivative because of it.
  bool has_gradient(int triangle) const {
    return triangle >= 0 ? records_[triangle].has_gradient
                         : differentiable.every_path || (is_light(triangle) && light_changes(triangle));
  }
  /// Whether one of its vertices, or the light in its place, moves.
  bool has_moving_vertex(int triangle) const {
    return triangle >= 0 ? records_[triangle].moving_corners != 0 : is_light(triangle) && light_changes(triangle);
  }
  /// Whether the light in a triangle's place can have a derivative.
  bool light_changes(int triangle) const {
    const std::size_t i = light_number(triangle);
    return i < differentiable.light.size() && differentiable.light[i];
  }
  /// f(corner, vertex) for each of the triangle's vertices that move.
  template <class F>
  void for_each_moving_corner(int triangle, F&& f) const {
    const TriangleRecord& r = records_[triangle];
    for (int i = 0; i < 3; ++i)
      if (r.moving_corners >> i & 1) f(i, r.vertex[i]);
  }

  /// A point of an emitter, in proportion to area x radiance; `pdf` per area, or of a light without an extent a probability.
  SurfacePoint sample_emitter(double u0, double u1, double u2, double& pdf) const {
    const int t = pick_emitter(u0);
    pdf = emitter_pdf(t);
    return point_on_emitter(t, u1, u2);
  }
  /// The same in steps, each of which prefetches what the next one reads, so that other work can be done meanwhile; the first,
  /// Emitters::prefetch, is optional.
  int pick_emitter(double u) const {
    const int t = emitters.pick(u);
    if (t >= 0) prefetch(t);
    return t;
  }
  SurfacePoint point_on_emitter(int triangle, double u1, double u2) const {
    if (is_light(triangle)) return point_of_light(triangle);
    return uniform_point(triangle, u1, u2);
  }
  SurfacePoint point_of_light(int triangle) const {
    const PointLight& light = lights[light_number(triangle)];
    return {light.position, light.kind == PointLight::Kind::wall ? light.direction : Vec3(), triangle};
  }
  SurfacePoint uniform_point(int triangle, double u1, double u2) const {
    const TriangleRecord& r = records_[triangle];
    return {r.origin + (r.edge[0] * (1 - u2) + r.edge[1] * u2) * std::sqrt(u1), r.normal, triangle};
  }
  /// A point on the area-sampled shapes, of density hidden.pdf().
  SurfacePoint sample_hidden(double u0, double u1) const {
    const int t = hidden.pick(u0);
    return uniform_point(t, u0, u1);
  }
  /// Asks for the triangle's record early.
  void prefetch(int triangle) const { isochron::prefetch(records_[triangle]); }
  /// Of a triangle that emits, per area; of a light without an extent, its probability. A capture's spot is certain.
  double emitter_pdf(int triangle) const {
    if (is_light(triangle)) return captures() ? 1 : lights[light_number(triangle)].power() / emitters.power();
    return shapes_[shape_index(triangle)].emitter_pdf;
  }

  /// The direction in which light leaves the point y of an emitter: of a shape by the cosine.
  Vec3 sample_emission(const SurfacePoint& y, double u0, double u1) const {
    return is_light(y.triangle) ? lights[light_number(y.triangle)].sample_direction(u0, u1)
                                : sample_cosine(y.n, u0, u1);
  }
  /// Its density per solid angle.
  double emission_pdf(const SurfacePoint& y, const Vec3& w) const {
    if (is_light(y.triangle)) return lights[light_number(y.triangle)].direction_pdf(w);
    return std::max(0.0, dot(y.n, w)) * kInvPi;
  }

  /// Edges from corner 0 to corners 1 and 2.
  const Vec3 (&edges(int triangle) const)[2] { return records_[triangle].edge; }
  std::array<Vec3, 3> corners(int triangle) const {
    const TriangleRecord& r = records_[triangle];
    return {r.origin, r.origin + r.edge[0], r.origin + r.edge[1]};
  }
  /// Whether the edge from corner i of an emitting triangle to the next ends the emitter's surface, or bends it.
  bool is_emitter_border(int triangle, int i) const { return records_[triangle].emitter_borders >> i & 1; }
  /// Weights of the triangle's three vertices at x.
  std::array<double, 3> barycentrics(const SurfacePoint& x) const {
    const TriangleRecord& r = records_[x.triangle];
    const Vec3 d = x.p - r.origin, n = r.normal / (2 * r.area);
    const double b1 = dot(cross(d, r.edge[1]), n), b2 = dot(cross(r.edge[0], d), n);
    return {1 - b1 - b2, b1, b2};
  }
  /// The triangle as clip_ellipse takes it.
  FocalTriangle focal_triangle(const Foci& foci, int triangle) const {
    const TriangleRecord& r = records_[triangle];
    return FocalTriangle(foci, r.origin, r.edge);
  }
  /// What the ellipsoid's surface leaves on the triangle; false for nothing.
  bool clip(const Ellipsoid& ellipsoid, int triangle, EllipseArcs& arcs) const {
    return clip_ellipse(ellipsoid, focal_triangle(ellipsoid, triangle), arcs);
  }
  /// Signed distance of p from the triangle's plane, positive on the normal's side.
  double height_over(int triangle, const Vec3& p) const {
    const TriangleRecord& r = records_[triangle];
    return dot(r.normal, p - r.origin);
  }
  /// Point where the line from `origin` along `direction` (unit) meets the triangle's plane, in double precision.
  SurfacePoint point_on_triangle(int triangle, const Vec3& origin, const Vec3& direction) const {
    const TriangleRecord& r = records_[triangle];
    const double distance = dot(r.normal, r.origin - origin) / dot(r.normal, direction);
    return {origin + direction * distance, r.normal, triangle};
  }

  /// The triangle that the ray from exactly `from` along w hits first, up to `far` lengths of w, or -1.
  int first_hit(const Vec3& from, const Vec3& w, float far = std::numeric_limits<float>::infinity()) const {
    const int t = caster.closest_hit(from, w, far);
    if (t < 0 || !stacked.may_cover(t, normal(t), w)) return t;
    return top_face(t, point_on_triangle(t, from, w).p, w);
  }
  /// Of the triangles that lie on each other at the point p of `triangle` the one that is seen along w: an emitter that faces
  /// the viewer, else one that faces the viewer, else one with a back that scatters, else a black back; among those the last in
  /// the scene.
  int top_face(int triangle, const Vec3& p, const Vec3& w) const;
  /// The triangle that the ray from `x` (offset off its surface) along the unit direction w hits first, or -1. Its record is
  /// prefetched: a caller that has other work to do first does not wait for it.
  int closest_hit(const SurfacePoint& x, const Vec3& w) const { return prefetched_hit(offset_ray_origin(x, w), w); }
  /// The same up to `distance`, or a little more; without the prefetch.
  int closest_hit_within(const SurfacePoint& x, const Vec3& w, double distance) const {
    const Vec3 start = offset_ray_origin(x, w);
    return first_hit(start, w, static_cast<float>(distance + 4 * caster.offset()));
  }
  /// The same of a ray from the camera.
  int closest_camera_hit(const Vec3& direction) const { return prefetched_hit(camera.position, direction); }
  /// Where the ray from `origin` along w, which hits `triangle` (-1: none), ends; empty also for a face along which it runs.
  std::optional<SurfacePoint> end_point(int triangle, const Vec3& origin, const Vec3& w) const {
    if (triangle < 0 || dot(records_[triangle].normal, w) == 0) return std::nullopt;
    return point_on_triangle(triangle, origin, w);
  }
  /// Whether a triangle that lies on y's is what is seen there along d.
  bool covered(const SurfacePoint& y, const Vec3& d) const {
    return y.triangle >= 0 && stacked.may_cover(y.triangle, y.n, d) && top_face(y.triangle, y.p, d) != y.triangle;
  }
  /// Whether light from x meets y, which is the last point on its way or covered by nothing that lies on it.
  bool visible(const SurfacePoint& x, const SurfacePoint& y) const {
    const Vec3 d = y.p - x.p;
    if (covered(y, d)) return false;
    return !caster.occluded(offset_ray_origin(x, d), offset_ray_origin(y, -d));
  }

  /// `x.p` moved off its surface to the side of the unit direction w; where there is no surface, `x.p`.
  Vec3 offset_ray_origin(const SurfacePoint& x, const Vec3& w) const {
    return x.p + x.n * std::copysign(caster.offset(), dot(x.n, w));
  }

  /// Lower bound of the optical length of any path from p to an emitter.
  double distance_to_emitters(const Vec3& p) const { return emitters.distance(p) * least_index_; }

 private:
  /// Whether x is on a transparent face whose back the direction d leaves from.
  bool is_behind(const SurfacePoint& x, const Vec3& d) const {
    return x.triangle >= 0 && transparent(x.triangle) && dot(x.n, d) < 0;
  }
  int prefetched_hit(const Vec3& from, const Vec3& w) const {
    const int t = first_hit(from, w);
    if (t >= 0) prefetch(t);
    return t;
  }

  struct LazyHierarchy {
    std::once_flag made;
    EllipsoidBvh bvh;
  };
  /// Returns which vertices have moved, and sets which shapes have.
  std::vector<char> move_vertices(const std::vector<Vec3>& positions, std::vector<char>& moved_shapes);
  void update_shapes();
  void update_record(int triangle);
  void update_lights();
  void update_emitters();
  void update_emitter_borders(const Shape& shape);

  LargeArray<TriangleRecord> records_;
  std::vector<int> changed_, shape_changed_;
  int revision_ = 0;
  std::vector<int> pattern_;                                           ///< TangentBasis::row_begin: what moves
  mutable std::array<std::unique_ptr<LazyHierarchy>, 3> hierarchies_;  ///< by Part
  std::vector<ShapeRecord> shapes_;
  std::vector<char> emitting_shapes_;
  bool has_medium_ = false;
  double least_index_ = 1;
};

}  // namespace isochron
