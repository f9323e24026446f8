// How the variance of the gate's derivative grows as gates get narrower (theory section 7): scenes and
// measurement.
#pragma once
#include "tests/render/scene_building.h"
#include "tests/render/support.h"

namespace isochron::testing {

/// A floor of one triangle under a small lamp; with `plate`, something that casts a shadow on it.
inline Scene growth_scene(bool plate) {
  Scene scene;
  scene.camera.position = {0.3, 1.5, 2.2};
  scene.camera.look_at = {0, 0, 0.8};
  scene.camera.fov = 80;
  scene.camera.width = scene.camera.height = 8;
  add_shape(scene, "floor", Mesh{{{-20, 0, 20}, {20, 0, 20}, {0, 0, -30}}, {{0, 1, 2}}}, diffuse(Rgb(0.6)));
  add_shape(scene, "lamp", quad({-0.1, 2, -0.1}, {0.1, 2, -0.1}, {0.1, 2, 0.1}, {-0.1, 2, 0.1}), diffuse(Rgb(0.0)),
            Rgb(10.0));
  if (plate)
    add_shape(scene, "plate", quad({-0.4, 1.2, 0.1}, {0.2, 1.2, 0.1}, {0.2, 1.2, 0.7}, {-0.4, 1.2, 0.7}),
              diffuse(Rgb(0.0)));
  return scene;
}

struct GrowthMethod {
  const char* name;
  Sampling sampling;
  bool antithetic;
  bool keep_length = false;
};
inline constexpr GrowthMethod kGrowthMethods[] = {{"standard", Sampling::standard, true},
                                                  {"ellipsoidal, uncoupled", Sampling::ellipsoidal, false},
                                                  {"ellipsoidal, coupled pairs", Sampling::ellipsoidal, true},
                                                  {"ellipsoidal, kept lengths", Sampling::ellipsoidal, true, true}};
inline constexpr double kGrowthCenter = 4.35;

/// A term of the derivative of the mean image by a vertical motion of the floor, gaussian gate of standard
/// deviation `width` times the path length, one bounce: estimate from `batches` batches of `samples` per
/// pixel each. Samples are independent, as theory has them: what low-discrepancy ones gain varies with the width.
inline Estimate growth_estimate(const Scene& scene, const GrowthMethod& method, double width, int samples, int batches,
                                Term term = Term::interior) {
  const TangentBasis basis = make_basis(scene, {translate(scene, "floor", {0, 1, 0})});
  const GateSet gates(GateShape::gaussian(width * kGrowthCenter), {kGrowthCenter});
  const Renderer renderer(
      scene, gates,
      {.max_bounces = 1,
       .sampling = method.sampling,
       .antithetic = method.antithetic,
       .numbers = Numbers::independent,
       .keep_length = method.keep_length},
      &basis);
  return term_means(renderer, term, 1, 1, samples, batches, {61, 0, 0})[0][0];
}

/// Slope of the least-squares line through (ln x, ln y).
inline double fitted_exponent(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double u = std::log(x[i]), v = std::log(y[i]);
    sx += u, sy += v, sxx += u * u, sxy += u * v;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace isochron::testing
