// Materials as functions of three cosines, each of which can be set by itself, where a colour's value counts like another's.
#pragma once
#include <cmath>
#include <string>

#include "core/scene/materials/material.h"

namespace isochron::testing {

/// At theta from z.
inline Vec3 direction(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

/// With vectors that are no directions but keep the three cosines apart in derivatives.
inline Directions directions(double cos_i, double cos_o, double cos_io) {
  return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, cos_i, cos_o, cos_io};
}

/// Of unit vectors above a surface whose normal is z.
inline Directions directions(const Vec3& w_i, const Vec3& w_o) {
  return {{0, 0, 1}, w_i, w_o, w_i.z, w_o.z, dot(w_i, w_o)};
}

inline double value(const Material& m, double cos_i, double cos_o, double cos_io) {
  return m.bsdf().value(directions(cos_i, cos_o, cos_io)).r;
}
inline double pdf(const Material& m, double cos_i, double cos_o, double cos_io) {
  return m.bsdf().pdf(directions(cos_i, cos_o, cos_io));
}

/// Of ln(value).
struct CosineDerivative {
  double value, by_cos_i, by_cos_o, by_cos_io, by_roughness = 0, by_ior = 0;
};
inline CosineDerivative derivative(const Material& m, double cos_i, double cos_o, double cos_io, int colour = 0) {
  const Directions d = directions(cos_i, cos_o, cos_io);
  const BsdfDerivative all = m.bsdf().derivative(d);
  const auto& by = all.by_directions[colour];
  CosineDerivative result{m.bsdf().value(d)[colour], by.n.y, by.n.z, by.w_i.z};
  if (const int k = m.find("roughness"); k >= 0) result.by_roughness = all.by_number[k][colour];
  if (const int k = m.find("ior"); k >= 0) result.by_ior = all.by_number[k][colour];
  return result;
}

inline std::optional<DirectionSample> sample(const Material& m, const Vec3& n, const Vec3& given, double u0, double u1,
                                             double u2 = 0.5, TransportMode mode = TransportMode::radiance) {
  return m.bsdf().sample(n, given, u0, u1, u2, mode);
}

inline Material white_diffuse(bool two_sided = false) {
  Material m("diffuse");
  m.set("albedo", 1);
  m.bsdf().set_two_sided(two_sided);
  return m;
}
inline Material white_conductor(double alpha, bool two_sided = false) {
  Material m("rough_conductor");
  m.set("reflectance", 1);
  m.set("roughness", alpha);
  m.bsdf().set_two_sided(two_sided);
  return m;
}
inline Material glass(double alpha, double ior) {
  Material m("rough_dielectric");
  m.set("roughness", alpha);
  m.set("ior", ior);
  return m;
}

}  // namespace isochron::testing
