// The area emitter: every point of a shape emits the same radiance in all directions on the normal's side.
#pragma once
#include "core/base/description.h"
#include "core/base/vec.h"

namespace isochron {

struct AreaEmitter {
  Rgb radiance;  ///< black: the shape is no emitter

  AreaEmitter() = default;
  AreaEmitter(const Rgb& of_all) : radiance(of_all) {}

  bool emits() const { return !radiance.is_black(); }
  /// Towards the unit direction w from a point with normal n.
  Rgb towards(const Vec3& n, const Vec3& w) const { return dot(n, w) > 0 ? radiance : Rgb(); }
  /// What points are picked by, per area.
  double power() const { return radiance.max(); }
  /// Its value in scene files. `grey` becomes false where it is three numbers.
  Field field(bool& grey) { return field::color(radiance, NumberRange::non_negative(), grey); }

  friend bool operator==(const AreaEmitter&, const AreaEmitter&) = default;
};

}  // namespace isochron
