// The kinds of materials: a name each.
#include "core/scene/materials/material.h"

namespace isochron {

extern const MaterialKind kDiffuse, kRoughConductor, kRoughDielectric, kPlastic, kRetroreflecting;

std::span<const MaterialKind* const> material_kinds() {
  static constexpr const MaterialKind* kKinds[] = {&kDiffuse, &kRoughConductor, &kRoughDielectric, &kPlastic,
                                                   &kRetroreflecting};
  return kKinds;
}

}  // namespace isochron
