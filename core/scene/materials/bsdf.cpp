#include "core/scene/materials/bsdf.h"

#include "core/base/sincos_2pi.h"

namespace isochron {

Quantity::Range fraction_range(double) {
  return {1e-4, 1};
}

Quantity::Range roughness_range(double) {
  return {1e-3, 1};
}

void Bsdf::describe_two_sided(Keys& keys) {
  keys.value("two_sided", field::boolean(two_sided_), "whether the back reflects, too");
}

Vec3 sample_cosine(const Vec3& n, double u0, double u1) {
  const double r = std::sqrt(u0);
  const SineCosine phi = sincos_2pi(u1);
  return Frame(n).to_world({r * phi.cosine, r * phi.sine, std::sqrt(1 - u0)});
}

}  // namespace isochron
