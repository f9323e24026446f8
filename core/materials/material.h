// Scattering of a surface, as a function of three cosines only (all our lobes are isotropic): cos_i = n.w_i towards
// the light side, cos_o = n.w_o towards the camera side, cos_io = w_i.w_o. f = albedo * lobe.
#pragma once
#include <optional>
#include <string>

#include "core/math/vec.h"

namespace isochron {

enum class MaterialType { diffuse, rough_conductor };

struct Material {
  std::string name;
  MaterialType type = MaterialType::diffuse;
  Rgb albedo{0.5};         ///< diffuse albedo, or the conductor's reflectance
  double roughness = 0.2;  ///< GGX alpha
  double ior = 1.5;
  bool two_sided = false;  ///< reflects on both sides of the face
};

/// ln(lobe) differentiated by its arguments; the lobe's value alongside.
struct LobeDerivative {
  double value = 0;  ///< 1/sr
  double d_cos_i = 0, d_cos_o = 0, d_cos_io = 0, d_roughness = 0;  ///< of ln(value)
};

struct DirectionSample {
  Vec3 direction;  ///< unit, world space
  double pdf;      ///< per solid angle
  double weight;   ///< lobe * |cos_i| / pdf
};

/// Lobe value in 1/sr, without cosine and albedo; zero where nothing is scattered (below the surface). For
/// `two_sided` materials a pair of negative cosines counts as a pair of positive ones.
double lobe(const Material& material, double cos_i, double cos_o, double cos_io);

/// As `lobe`, with the derivatives of its logarithm. Where value is 0 the derivatives are 0.
LobeDerivative lobe_derivative(const Material& material, double cos_i, double cos_o, double cos_io);

/// Density per solid angle with which `sample_direction` draws w_i given w_o.
double direction_pdf(const Material& material, double cos_i, double cos_o, double cos_io);

/// Draws w_i given w_o (both point away from the surface with unit normal n): cosine-weighted for diffuse, visible GGX
/// normals (Heitz 2018) for rough conductors. Empty when nothing is scattered.
std::optional<DirectionSample> sample_direction(const Material& material, const Vec3& n, const Vec3& w_o, double u0,
                                                double u1);

}  // namespace isochron
