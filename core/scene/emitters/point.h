// Emitters without an extent: point lights, spot lights, and the spot that the laser of a capture lights on a wall. Next-event
// estimation and ellipsoidal connections reach them, rays never do.
#pragma once
#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/constants.h"
#include "core/base/description.h"
#include "core/base/frame.h"
#include "core/base/vec.h"

namespace isochron {

struct PointLight {
  enum class Kind {
    point,
    spot,
    wall  ///< a diffuse wall point that gets unit power: cos / pi
  };
  std::string name;
  Kind kind = Kind::point;
  Vec3 position;
  Vec3 direction{0, 0, -1};       ///< unit; of a wall its normal
  double cone = 25, blend = 0.2;  ///< spot: degrees from the direction to the dark, the part of that which fades
  Rgb intensity{1.0};             ///< radiant, in the direction of a spot; of a wall unused

  /// Radiant intensity towards the unit direction w.
  Rgb towards(const Vec3& w) const {
    if (kind == Kind::point) return intensity;
    const double cosine = dot(w, direction);
    if (kind == Kind::wall) return Rgb(cosine > 0 ? cosine * kInvPi : 0);
    double slope;
    return intensity * fade(cosine, slope);
  }
  /// Derivative of ln(towards(w)) by w and by `direction`, as if both were free vectors.
  struct Derivative {
    Vec3 w, direction;
  };
  Derivative derivative(const Vec3& w) const {
    if (kind == Kind::point) return {};
    const double cosine = dot(w, direction);
    if (kind == Kind::wall) return {direction / cosine, w / cosine};
    double slope;
    const double value = fade(cosine, slope);
    if (!(value > 0)) return {};
    return {direction * (slope / value), w * (slope / value)};
  }
  /// A direction in which light leaves a point, uniform, or a spot, uniform in its cone. Not of a wall.
  Vec3 sample_direction(double u0, double u1) const {
    const double cosine = 1 - u0 * spread(), sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    const SineCosine phi = sincos_2pi(u1);
    return Frame(direction).to_world({sine * phi.cosine, sine * phi.sine, cosine});
  }
  /// Its density per solid angle.
  double direction_pdf(const Vec3& w) const { return dot(w, direction) >= 1 - spread() ? 1 / (2 * kPi * spread()) : 0; }
  /// What it is picked by, comparable to area x radiance of a shape.
  double power() const {
    if (kind == Kind::wall) return 1;
    return 2 * spread() * intensity.max();
  }

 private:
  /// Part of the sphere that it lights, times two.
  double spread() const { return kind == Kind::point ? 2 : 1 - std::cos(cone * kPi / 180); }
  /// Falls from one to zero with the angle from the direction, by smoothstep; `slope`: by the angle's cosine.
  double fade(double cosine, double& slope) const {
    slope = 0;
    const double dark = cone * kPi / 180, angle = std::acos(std::clamp(cosine, -1.0, 1.0));
    const double t = (dark - angle) / (blend * dark);
    if (t >= 1) return 1;
    if (t <= 0) return 0;
    // d angle / d cosine = -1 / sin(angle), and t falls with the angle.
    slope = 6 * t * (1 - t) / (blend * dark * std::sin(angle));
    return t * t * (3 - 2 * t);
  }
};

/// Its keys in scene files: of a point or a spot light. `grey` becomes false where the intensity is three numbers.
void describe(Keys& keys, PointLight& light, bool& grey);

}  // namespace isochron
