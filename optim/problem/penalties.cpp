#include "optim/problem/penalties.h"

#include <algorithm>

#include "optim/problem/bending.h"

namespace isochron {

QuadraticPenalty penalty_of(const std::vector<ParameterSpec>& specs, const Parameters& parameters, const Scene& scene) {
  QuadraticPenalty penalty;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const ParameterSpec& spec = specs[i];
    const Parameters::Block& block = parameters.blocks()[i];
    if (spec.slopes > 0) penalty.add_slopes(scene, parameters.vertex_field(block), spec.slopes);
    if (spec.bending > 0)
      penalty.add_forms(bending_forms(parameters, parameters.vertex_field(block), parameters.initial()), spec.bending);
    if (spec.variation > 0)
      penalty.add_forms(variation_forms(parameters, parameters.vertex_field(block), parameters.initial()),
                        spec.variation);
    if (spec.tangential > 0)
      penalty.add_forms(tangential_forms(parameters, parameters.vertex_field(block), parameters.initial()),
                        spec.tangential);
    if (spec.prior_width > 0) penalty.add_prior(block, parameters.initial(), spec.prior_width);
  }
  return penalty;
}

QuadraticPenalty prior_of(std::vector<ParameterSpec> specs, const Parameters& parameters, const Scene& scene) {
  for (ParameterSpec& spec : specs) {
    if (!spec.bends()) continue;
    spec.slopes = 0;
    spec.tangential = std::max(kHeldTangents, spec.tangential);
  }
  return penalty_of(specs, parameters, scene);
}

}  // namespace isochron
