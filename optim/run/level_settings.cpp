#include "optim/run/level_settings.h"

#include <algorithm>
#include <cmath>

#include "optim/problem/penalties.h"
#include "optim/run/next_level.h"

namespace isochron {
namespace {

/// By trials with the rabbit (optim/README.md, Dim albedos).
constexpr double kDimmed = 0.88;

/// Diffusion of the gradient of albedos by vertex where adam moves borders, far above one over the least eigenvalues of the graph Laplacian of
/// some hundred vertices: albedos of connected vertices move together. Vertex by vertex adam follows noise and hardly changes their mean, which
/// decides how far borders go (optim/README.md, Dim albedos).
constexpr double kTogether = 1000;

/// Slopes of offsets hold a level near its start: steps of adam are short anyway, and borders must not be held back. Inner vertices
/// keep to their normals: of motion within a surface of one albedo the gradient is all noise, which adam would follow until triangles fold.
void free_borders(const RemeshSpec& remesh, LossKind loss, ParameterSpec& spec) {
  spec.slopes = remesh.adam_slopes;
  if (loss == LossKind::poisson) spec.tangential = std::max(kHeldTangents, spec.tangential);
}

}  // namespace

void step_by_adam(const RemeshSpec& remesh, int level, Experiment& level_experiment) {
  OptimizerSpec& adam = level_experiment.optimizer;
  adam = {};
  adam.method = OptimizerMethod::adam;
  adam.learning_rate = std::ldexp(remesh.adam_rate, -remesh.halvings(level));
  adam.stop_window = 0;
  adam.iterations = remesh.adam_iterations;
  if (level == remesh.last_by_adam()) {
    if (remesh.adam_last > 0) adam.iterations = remesh.adam_last;
    adam.decay = {.start = adam.iterations / 3, .half_life = adam.iterations / 9.0};
  }
  level_experiment.samples.interior *= 2;
  level_experiment.target.histograms = (level_experiment.target.histograms + 1) / 2;
}

void set_weights(const Experiment& whole, int level, bool evidence_follows, std::vector<ParameterSpec>& parameters) {
  const ParameterSpec& remeshed = *remeshed_parameter(whole);
  const RemeshSpec& remesh = remeshed.remesh;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const ParameterSpec& asked = whole.parameters[i];
    ParameterSpec& spec = parameters[i];
    const bool weighs_slopes = spec.evidence && !spec.bends();
    if (!(evidence_follows && weighs_slopes)) spec.slopes = asked.slopes;
    // Early levels have far to go, and coarse triangles bend unevenly.
    if (!evidence_follows) spec.variation = remesh.comes_early(level) ? 0 : asked.variation;
    spec.tangential = asked.tangential;
    if (spec.type == ParameterType::texture && spec.shape == remeshed.shape) {
      if (remesh.finds_outline(level)) spec.slopes = remesh.outline_slopes;
      spec.diffusion = remesh.steps_by_adam(level) ? kTogether : asked.diffusion;
    }
    if (remesh.steps_by_adam(level) && spec.name == remeshed.name) free_borders(remesh, whole.loss.kind, spec);
  }
}

void dim(const std::string& shape, std::vector<ParameterSpec>& parameters) {
  for (ParameterSpec& spec : parameters) {
    if (spec.type != ParameterType::texture || spec.shape != shape || !spec.lower.empty()) continue;
    for (double& albedo : spec.initial) albedo *= kDimmed;
  }
}

}  // namespace isochron
