// What the estimators need of a scene at one value of the parameters, computed once.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "core/geometry/ellipsoid_bvh.h"
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

/// Discrete distribution by cumulative sums.
class DiscreteDistribution {
 public:
  DiscreteDistribution() = default;
  explicit DiscreteDistribution(const std::vector<double>& weights);
  bool empty() const { return total() <= 0; }
  double total() const { return cumulative_.empty() ? 0 : cumulative_.back(); }
  double probability(int i) const { return (cumulative_[i] - (i ? cumulative_[i - 1] : 0)) / total(); }
  /// Index drawn in proportion to its weight; `u` in (0, 1) is replaced by a fresh uniform number.
  int sample(double& u) const;

 private:
  std::vector<double> cumulative_;
};

/// Which degrees of freedom move. Everything else is skipped by the derivative passes.
struct MovingParts {
  std::vector<std::uint8_t> vertex, triangle;
  std::vector<std::uint8_t> albedo, roughness;  ///< per material
  std::vector<std::uint8_t> emission;           ///< per shape
  std::vector<std::uint8_t> scatters;           ///< per triangle: its material's albedo or roughness moves
  bool any = false, geometry = false;
  MovingParts(const Scene& scene, const TangentBasis* basis);
};

class PreparedScene {
 public:
  PreparedScene(const Scene& scene, const TangentBasis* basis);

  const Scene& scene;
  CameraModel camera;
  DofLayout layout;
  MovingParts moving;
  RayCaster caster;
  std::vector<Vec3> normal;         ///< per triangle, unit
  std::vector<double> area;         ///< per triangle
  std::vector<int> emitters;        ///< triangles that emit
  EllipsoidBvh all_triangles, moving_triangles, emitter_triangles;

  const Shape& shape_of(int triangle) const { return scene.shapes[scene.triangles[triangle].shape]; }
  const Material& material_of(int triangle) const { return scene.materials[shape_of(triangle).material]; }
  const Vec3& corner(int triangle, int i) const { return scene.positions[scene.triangles[triangle].vertex[i]]; }

  /// Radiance that leaves the point towards the unit direction w; black on the back of an emitter.
  Rgb emitted(const SurfacePoint& x, const Vec3& w) const {
    return dot(x.n, w) > 0 ? shape_of(x.triangle).emission : Rgb();
  }
  bool emits(int triangle) const { return emits_[triangle]; }

  /// Uniform by area x radiance over the emitters; `pdf` per area.
  SurfacePoint sample_emitter(double u0, double u1, double u2, double& pdf) const;
  double emitter_pdf(int triangle) const { return emitter_pdf_[triangle]; }

  /// Point where the line from `origin` along `direction` (unit) meets the triangle's plane, in double precision.
  SurfacePoint point_on_triangle(int triangle, const Vec3& origin, const Vec3& direction) const;
  /// The triangle's point nearest to being p: barycentrics of p, which lies in its plane.
  SurfacePoint point_in_plane(int triangle, const Vec3& p) const;

  /// First surface point from `x` (offset off its surface) along the unit direction w.
  std::optional<SurfacePoint> trace(const SurfacePoint& x, const Vec3& w) const;
  /// First surface point along a ray from the camera.
  std::optional<SurfacePoint> trace_camera(const Vec3& direction) const;
  bool visible(const SurfacePoint& x, const SurfacePoint& y) const;
  bool visible_from_camera(const SurfacePoint& x) const;

  /// `x.p` moved off its surface to the side of the unit direction w.
  Vec3 leave(const SurfacePoint& x, const Vec3& w) const {
    return x.p + x.n * std::copysign(caster.offset(), dot(x.n, w));
  }

  /// Lower bound of the distance from p to any emitter.
  double distance_to_emitters(const Vec3& p) const;

 private:
  struct Box {
    Vec3 low, high;
  };
  std::vector<std::uint8_t> emits_;
  std::vector<double> emitter_pdf_;
  std::vector<Box> emitter_boxes_;  ///< one per emitting shape
  DiscreteDistribution emitter_distribution_;
};

}  // namespace isochron
