#include "core/scene/materials/bsdf.h"

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

}  // namespace isochron
