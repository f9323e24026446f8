// What the estimators need of a scene at one value of the parameters, computed once.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "core/geometry/bounds.h"
#include "core/geometry/ellipsoid_bvh.h"
#include "core/render/camera_flow.h"
#include "core/render/camera_model.h"
#include "core/render/ray_caster.h"
#include "core/scene/scene.h"

namespace isochron {

/// A point on a triangle; barycentrics weigh the triangle's three vertices.
struct SurfacePoint {
  Vec3 p;
  Vec3 n;  ///< unit face normal
  int triangle = -1;
  double b[3] = {0, 0, 0};
};

/// What a ray that meets a triangle asks for, side by side in memory: two cache lines, the first of which decides
/// where the ray ends and how it goes on.
struct alignas(64) TriangleRecord {
  Vec3 normal;  ///< unit; zero when the triangle has no area
  Vec3 origin;  ///< corner 0
  const Material* material = nullptr;
  int shape = -1;
  bool emits = false;
  bool moves = false;  ///< a path through the triangle can have a derivative
  Vec3 to_b1, to_b2;   ///< barycentrics of p in the plane: b[i] = to_bi . (p - origin)
};

/// Discrete distribution by cumulative sums.
class DiscreteDistribution {
 public:
  DiscreteDistribution() = default;
  explicit DiscreteDistribution(const std::vector<double>& weights);
  bool empty() const { return total() <= 0; }
  double total() const { return cumulative_.empty() ? 0 : cumulative_.back(); }
  /// Probability of all indices before i.
  double below(int i) const { return (i ? cumulative_[i - 1] : 0) / total(); }
  double probability(int i) const { return (cumulative_[i] - (i ? cumulative_[i - 1] : 0)) / total(); }
  /// Index drawn in proportion to its weight; `u` in (0, 1) is replaced by a fresh uniform number.
  int sample(double& u) const;

 private:
  std::vector<double> cumulative_;
};

/// Which degrees of freedom move. Everything else is skipped by the derivative passes.
struct MovingParts {
  std::vector<std::uint8_t> vertex, triangle;
  std::vector<std::uint8_t> albedo, roughness, ior;  ///< per material
  std::vector<std::uint8_t> emission;                ///< per shape
  std::vector<std::uint8_t> scatters;                ///< per triangle: its material's albedo, roughness or ior moves
  bool any = false, geometry = false;
  bool lengths = false;  ///< paths can change their length
  MovingParts(const Scene& scene, const TangentBasis* basis);
};

class PreparedScene {
 public:
  /// `follow_radius`: see CameraFlow.
  PreparedScene(const Scene& scene, const TangentBasis* basis, double follow_radius = 0);

  const Scene& scene;
  CameraModel camera;
  DofLayout layout;
  MovingParts moving;
  CameraFlow camera_flow;
  RayCaster caster;
  std::vector<Vec3> normal;   ///< per triangle, unit
  std::vector<double> area;   ///< per triangle
  std::vector<int> emitters;  ///< triangles that emit
  EllipsoidBvh all_triangles, moving_triangles, emitter_triangles;

  const Shape& shape_of(int triangle) const { return scene.shapes[records_[triangle].shape]; }
  const Material& material_of(int triangle) const { return *records_[triangle].material; }
  const Vec3& corner(int triangle, int i) const { return scene.positions[scene.triangles[triangle].vertex[i]]; }

  /// Radiance that leaves the point towards the unit direction w; black on the back of an emitter.
  Rgb emitted(const SurfacePoint& x, const Vec3& w) const {
    return dot(x.n, w) > 0 ? shape_of(x.triangle).emission : Rgb();
  }

  /// The dielectric that the segment between x and y, which see each other, runs inside of: one with an end on the
  /// back of its face. Null outside. Opaque surfaces and the camera (triangle -1) know no medium: a segment between
  /// two of them counts as outside.
  const Material* medium_between(const SurfacePoint& x, const SurfacePoint& y) const {
    if (!has_dielectric_) return nullptr;
    const Vec3 d = y.p - x.p;
    if (is_behind(x, d)) return &material_of(x.triangle);
    if (is_behind(y, -d)) return &material_of(y.triangle);
    return nullptr;
  }
  /// Optical length of the segment over its geometric length.
  double index_between(const SurfacePoint& x, const SurfacePoint& y) const {
    const Material* medium = medium_between(x, y);
    return medium ? medium->ior : 1;
  }
  bool outside(const SurfacePoint& x, const SurfacePoint& y) const { return !medium_between(x, y); }
  bool is_dielectric(int triangle) const { return material_of(triangle).type == MaterialType::rough_dielectric; }
  /// Lower bound of the optical length of any path over the distance between its ends.
  double least_index() const { return least_index_; }

  bool emits(int triangle) const { return records_[triangle].emits; }
  /// Whether a path through the triangle can have a derivative because of it.
  bool moves(int triangle) const { return records_[triangle].moves; }

  /// Uniform by area x radiance over the emitters; `pdf` per area.
  SurfacePoint sample_emitter(double u0, double u1, double u2, double& pdf) const;
  double emitter_pdf(int triangle) const { return emitter_pdf_[triangle]; }

  /// Signed distance of p from the triangle's plane, positive on the normal's side.
  double height_over(int triangle, const Vec3& p) const {
    const TriangleRecord& r = records_[triangle];
    return dot(r.normal, p - r.origin);
  }
  /// Point where the line from `origin` along `direction` (unit) meets the triangle's plane, in double precision.
  SurfacePoint point_on_triangle(int triangle, const Vec3& origin, const Vec3& direction) const {
    const TriangleRecord& r = records_[triangle];
    const double distance = dot(r.normal, r.origin - origin) / dot(r.normal, direction);
    return point_in_plane(triangle, origin + direction * distance);
  }
  /// The triangle's point nearest to being p: barycentrics of p, which lies in its plane.
  SurfacePoint point_in_plane(int triangle, const Vec3& p) const {
    const TriangleRecord& r = records_[triangle];
    const Vec3 d = p - r.origin;
    const double b1 = dot(r.to_b1, d), b2 = dot(r.to_b2, d);
    return {p, r.normal, triangle, {1 - b1 - b2, b1, b2}};
  }

  /// First surface point from `x` (offset off its surface) along the unit direction w.
  std::optional<SurfacePoint> trace(const SurfacePoint& x, const Vec3& w) const {
    return first_point(leave(x, w), x.p, w);
  }
  /// First surface point along a ray from the camera.
  std::optional<SurfacePoint> trace_camera(const Vec3& direction) const {
    return first_point(camera.position, camera.position, direction);
  }
  bool visible(const SurfacePoint& x, const SurfacePoint& y) const {
    const Vec3 d = y.p - x.p;
    return !caster.occluded(leave(x, d), leave(y, -d));
  }
  bool visible_from_camera(const SurfacePoint& x) const {
    return !caster.occluded(camera.position, leave(x, camera.position - x.p));
  }

  /// `x.p` moved off its surface to the side of the unit direction w.
  Vec3 leave(const SurfacePoint& x, const Vec3& w) const {
    return x.p + x.n * std::copysign(caster.offset(), dot(x.n, w));
  }

  /// Lower bound of the optical length of any path from p to an emitter.
  double distance_to_emitters(const Vec3& p) const;

 private:
  /// Whether x is on a dielectric's face whose back the direction d leaves from.
  bool is_behind(const SurfacePoint& x, const Vec3& d) const {
    return x.triangle >= 0 && is_dielectric(x.triangle) && dot(x.n, d) < 0;
  }
  /// First point on the ray that starts at `lifted`; it is put on the line through `origin`.
  std::optional<SurfacePoint> first_point(const Vec3& lifted, const Vec3& origin, const Vec3& w) const {
    const int t = caster.first_triangle(lifted, w);
    if (t < 0 || dot(records_[t].normal, w) == 0) return std::nullopt;
    return point_on_triangle(t, origin, w);
  }

  std::vector<TriangleRecord> records_;
  std::vector<double> emitter_pdf_;
  std::vector<Bounds> emitter_bounds_;  ///< one per emitting shape
  DiscreteDistribution emitter_distribution_;
  bool has_dielectric_ = false;
  double least_index_ = 1;
};

}  // namespace isochron
