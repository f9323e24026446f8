// What a scene needs of the model: the cheapest setting whose loss gradient is that of the full model.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "optim/analysis/gradient_cost.h"
#include "optim/analysis/inspection.h"

namespace isochron {

/// The keys of an experiment that advice is about.
struct Setting {
  int max_bounces = 0;
  Sampling sampling = Sampling::automatic;
  std::array<int, kPasses> samples{};  ///< per pixel: primal, then the terms
};

/// One way to sample the advised model, at the numbers of samples that give the present setting's variance.
struct SamplingTrial {
  Sampling sampling = Sampling::automatic;
  std::array<int, kPasses> samples{};
  double seconds = 0;               ///< CPU seconds per evaluation, predicted
  double effective_count = 0;       ///< below heavy_tail.h's limit the variance is not to be trusted
  std::vector<GradientCost> costs;  ///< per point
};

struct Advice {
  Setting before, after;
  ReductionChoice reduction;
  std::vector<SamplingTrial> trials;  ///< the experiment's own sampling first
  /// CPU seconds per evaluation of the loss gradient; before: measured, after: predicted.
  double seconds_before = 0, seconds_after = 0;
  std::vector<GradientCost> costs_before;  ///< per point
};

struct Inspection {
  std::vector<PointInspection> points;
  Advice advice;
};

/// The most that the gradient of the advised model may be off, relative to its norm.
inline constexpr double kBiasTolerance = 0.01;

/// Inspects an experiment with the analytic method from `start` on, for about so many CPU seconds.
/// Throws InputError where it has no parameters or another method.
Inspection inspect(const Problem& problem, const std::vector<double>& start, double seconds);

/// From the costs of the present setting and of trials with their costs: fills in the trials' samples,
/// seconds and effective counts, and the advised samples and sampling. Numbers of samples stay unless new ones save a
/// tenth; so does the sampling unless another saves a fifth and its variance can be trusted.
void choose_samples(Advice& advice, double pixels);

/// The experiment with the advised setting. The target keeps all its bounces.
Experiment advised(Experiment experiment, const Setting& setting);

/// The same as YAML to be pasted into the experiment file: the keys that differ from the defaults or the
/// file.
std::string advice_yaml(const Experiment& experiment, const Setting& setting);

/// `point,quantity,term,bounces,gate,shape,share,standard_error`: light and gradient by bounces, gates and
/// shapes; and `bias` by the number of bounces that the model would stop at.
std::string inspection_csv(const Problem& problem, const Inspection& inspection);

}  // namespace isochron
