// Fresnel's reflectance of dielectrics, unpolarised.
#pragma once
#include <algorithm>
#include <cmath>

namespace isochron {

inline double square(double x) {
  return x * x;
}

/// Of a smooth face between the side `front` of a dielectric and the other.
struct Fresnel {
  double m2;        ///< squared index of the far side relative to the near one
  double contrast;  ///< m2 - 1
  double m2_by_ior;

  Fresnel(double ior, bool front)
      : m2(front ? ior * ior : 1 / (ior * ior)),
        contrast((ior - 1) * (ior + 1) * (front ? 1 : -m2)),
        m2_by_ior(front ? 2 * ior : -2 * m2 / ior) {}

  /// Relative index times the cosine of refraction; 0 under total reflection. x: cosine of incidence.
  double refracted(double x) const { return std::sqrt(std::max(contrast + x * x, 0.0)); }
  double reflectance(double x) const {
    const double g = refracted(x);
    return g > 0 ? 0.5 * (square(across(x, g)) + square(along(x, g))) : 1;
  }
  /// Derivatives of ln(reflectance); they grow without bound, but integrably, towards the critical angle.
  void differentiate(double x, double& by_cosine, double& by_ior) const {
    by_cosine = by_ior = 0;
    const double g = refracted(x);
    if (!(g > 0)) return;
    const double s = across(x, g), p = along(x, g), scale = 2 / (g * (s * s + p * p));
    const double sum2 = square(x + g), parallel2 = square(m2 * x + g);
    by_cosine = scale * 2 * (p * m2 * contrast / parallel2 - s * s);
    by_ior = scale * x * (p * (2 * g * g - m2) / parallel2 - s / sum2) * m2_by_ior;
  }

 private:
  // Amplitudes (x - g) / (x + g) and (m2 x - g) / (m2 x + g), with x - g = -contrast / (x + g).
  double across(double x, double g) const { return -contrast / square(x + g); }
  double along(double x, double g) const { return contrast * (x * (x + g) - 1) / ((x + g) * (m2 * x + g)); }
};

/// Cosine of incidence on the half vector of a reflection; cos_io: of the angle between both directions.
inline double incidence(double cos_io) {
  return std::sqrt(std::max(0.5 * (1 + cos_io), 0.0));
}

}  // namespace isochron
