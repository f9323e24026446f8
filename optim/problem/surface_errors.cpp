#include "optim/problem/surface_errors.h"

#include <algorithm>
#include <cmath>

namespace isochron {
namespace {

bool has_errors(const ParameterSpec& spec) {
  return spec.type == ParameterType::vertices && spec.bends();
}

}  // namespace

bool has_surface_errors(const Problem& problem) {
  const std::vector<ParameterSpec>& specs = problem.experiment().parameters;
  return problem.experiment().gradient.method == GradientMethod::analytic &&
         std::any_of(specs.begin(), specs.end(), has_errors);
}

std::vector<double> surface_errors(const Problem& problem, const PosteriorSamples& samples,
                                   const std::vector<double>& theta, double scale) {
  const Parameters& parameters = problem.parameters();
  const Scene scene = parameters.apply(theta);
  const TangentBasis basis = parameters.tangent(theta);
  const DofLayout layout(scene);
  const std::vector<Vec3> normals = vertex_normals(scene);
  std::vector<double> errors(scene.positions.size(), std::nan(""));
  for (std::size_t i = 0; i < parameters.blocks().size(); ++i) {
    if (!has_errors(problem.experiment().parameters[i])) continue;
    for (const int v : parameters.vertex_field(parameters.blocks()[i]).vertices) {
      const double size = length(normals[v]);
      double sum = 0;
      for (const std::vector<double>& sample : samples.unknowns) {
        double along = 0;
        for (int axis = 0; axis < 3; ++axis) {
          const int row = layout.vertex(v, axis);
          for (int k = basis.row_begin[row]; k < basis.row_begin[row + 1]; ++k) {
            const auto& [unknown, coefficient] = basis.entries[k];
            along += normals[v][axis] / size * coefficient * sample[unknown];
          }
        }
        sum += along * along;
      }
      if (size > 0) errors[v] = std::sqrt(scale * sum / samples.count());
    }
  }
  return errors;
}

}  // namespace isochron
