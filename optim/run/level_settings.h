// What the experiment of a level has in place of the whole run's: weights of priors, and steps where adam moves borders (optim/README.md,
// Surfaces from captures).
#pragma once
#include <string>
#include <vector>

#include "optim/experiment/experiment.h"

namespace isochron {

/// Of a level by adam. The last of these halves its steps six times over its last two thirds, so that their noise averages out (optim/README.md,
/// Levels by adam). Where edges are half as long, so are steps. Each iteration has half of the histograms, and others than the one before, with
/// twice the samples of the gradient (optim/README.md, Histograms).
void step_by_adam(const RemeshSpec& remesh, int level, Experiment& level_experiment);

/// Weights of a level: those that the whole run's experiment asks for, but where evidence is to be a factor to the ones that it is found
/// with, and what outlines and adam need.
void set_weights(const Experiment& whole, int level, bool evidence_follows, std::vector<ParameterSpec>& parameters);

/// Albedos of the shape by vertex begin too low, unless a bound says how low they may be. Borders are drawn back more easily than they are
/// extended, and light that is missing extends them; as albedos rise again they come back.
void dim(const std::string& shape, std::vector<ParameterSpec>& parameters);

}  // namespace isochron
