// Finds the triangles that an ellipsoidal shell crosses.
#pragma once
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/vec.h"

namespace isochron {

/// 8-wide bounding-volume hierarchy over triangles, queried with confocal ellipsoids.
class EllipsoidBvh {
 public:
  struct Input {
    std::array<Vec3, 3> vertex;
    int id;  ///< what queries report
  };
  EllipsoidBvh();
  explicit EllipsoidBvh(const std::vector<Input>& triangles);
  EllipsoidBvh(EllipsoidBvh&&) noexcept;
  EllipsoidBvh& operator=(EllipsoidBvh&&) noexcept;
  ~EllipsoidBvh();

  bool empty() const;
  /// Appends to `ids` every triangle that may meet an ellipsoid with foci a, b and a total length in
  /// [tau_low, tau_high]: all that do, and few that do not. tau_low below |a-b| means "down to nothing",
  /// tau_high at or below |a-b| finds nothing, an infinite one sets no limit. Triangles with coordinates that
  /// are not finite are never reported, those without area may be. The order depends on the hierarchy only.
  /// Safe to call from several threads. Returns the nodes and leaves visited: the work done.
  int query(const Vec3& a, const Vec3& b, double tau_low, double tau_high, std::vector<int>& ids) const;
  /// The same for the two ellipsoids of total lengths tau_low and tau_high only: leaves out nearly all triangles
  /// strictly between them, of which a fine mesh has many. The others come in the order of `query`.
  int query_surfaces(const Vec3& a, const Vec3& b, double tau_low, double tau_high, std::vector<int>& ids) const;

  /// A focus and the cone that paths leave it by.
  struct Focus {
    Vec3 p;
    Vec3 axis;            ///< unit; zero (with a right angle): all directions
    double cosine, sine;  ///< of the angle between the axis and the cone's border, at most a right angle
    bool lambertian;      ///< paths count by their cosine with the axis
  };
  /// The triangles of `query_surfaces`, and some that only come close: for callers who look for arcs on each. Of the many
  /// of a fine mesh a random choice of those between the foci's cones: as many as make up a few leaves, at a cost that
  /// grows only with the hierarchy's depth. Appends to `ids` and, of the same length, one over each triangle's
  /// probability, which favours what is near the foci. `u`: uniform in (0, 1).
  void sample_surfaces(const Focus& a, const Focus& b, double tau_low, double tau_high, double u, std::vector<int>& ids,
                       std::vector<double>& inverse_probability) const;

 private:
  struct Shell;
  std::optional<Shell> make_shell(const Vec3& a, const Vec3& b, double tau_low, double tau_high) const;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace isochron
