#include "optim/analysis/advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/base/error.h"
#include "optim/problem/gate_columns.h"
#include "optim/problem/heavy_tail.h"
#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

/// Half of the time for where light and gradients come from, half for what they cost.
constexpr double kShareOfCosts = 0.5;
/// Measured variances and times are good to some ten percent: what saves less is left as it is, and so are
/// samples whose variance seems larger by less.
constexpr double kWorthNewSamples = 0.9, kWorthNewSampling = 0.8, kSameVariance = 1.25;

std::array<int, kPasses> samples_of(const Experiment& experiment, const std::array<bool, 3>& kept) {
  const SampleSpec& s = experiment.samples;
  return {s.primal, kept[0] ? s.interior : 0, kept[1] ? s.visibility : 0, kept[2] ? s.path_length : 0};
}

/// Median of the points' costs, pass by pass.
PerPass cost_per_sample(const std::vector<GradientCost>& costs) {
  PerPass result;
  for (int i = 0; i < kPasses; ++i) {
    std::vector<double> seconds;
    for (const GradientCost& c : costs) seconds.push_back(c.seconds[i]);
    result[i] = median(seconds);
  }
  return result;
}

double seconds_of(const std::vector<GradientCost>& costs, const std::array<int, kPasses>& samples, double pixels) {
  std::vector<double> overheads;
  for (const GradientCost& c : costs) overheads.push_back(c.overhead);
  const PerPass cost = cost_per_sample(costs);
  double sum = median(overheads);
  for (int i = 0; i < kPasses; ++i) sum += cost[i] * samples[i] * pixels;
  return sum;
}

PerPass real(const std::array<int, kPasses>& samples) {
  PerPass n;
  std::copy(samples.begin(), samples.end(), n.begin());
  return n;
}

std::vector<GradientCost> measure_all(const Problem& problem, const std::vector<PointInspection>& points,
                                      const std::array<bool, 3>& kept,
                                      const std::vector<std::array<int, kPasses>>& samples) {
  std::vector<GradientCost> costs;
  for (std::size_t i = 0; i < points.size(); ++i)
    costs.push_back(measure_cost(problem, points[i].point.theta, points[i].target, kept, samples[i]));
  return costs;
}

}  // namespace

void choose_samples(Advice& advice, double pixels) {
  // Points count alike: each by its variance relative to that of the present setting.
  std::vector<double> weights;
  for (const GradientCost& c : advice.costs_before) {
    const double before = c.variance(real(advice.before.samples));
    weights.push_back(before > 0 ? 1 / before : 0);
  }
  const double wanted =
      static_cast<double>(std::count_if(weights.begin(), weights.end(), [](double w) { return w > 0; }));
  advice.seconds_before = seconds_of(advice.costs_before, advice.before.samples, pixels);
  for (SamplingTrial& trial : advice.trials) {
    GradientVariance variance;
    trial.effective_count = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < trial.costs.size(); ++i) {
      variance.add(trial.costs[i].variance, weights[i]);
      trial.effective_count = std::min(trial.effective_count, trial.costs[i].effective_count);
    }
    // What the present setting has of the kept terms; what it lacks starts with one sample.
    std::array<int, kPasses> present = advice.before.samples;
    for (int t = 0; t < 3; ++t) {
      const bool kept = advice.reduction.kept.terms[t];
      present[1 + t] = kept ? std::max(present[1 + t], 1) : 0;
    }
    trial.samples = wanted > 0
                        ? cheapest_split(variance, cost_per_sample(trial.costs), advice.reduction.kept.terms, wanted)
                        : present;
    trial.seconds = seconds_of(trial.costs, trial.samples, pixels);
    const double unchanged = seconds_of(trial.costs, present, pixels);
    const bool good_enough = variance(real(present)) <= kSameVariance * wanted;
    if (trial.effective_count < kFewestDeviations || (trial.seconds > kWorthNewSamples * unchanged && good_enough)) {
      trial.samples = present;
      trial.seconds = unchanged;
    }
  }
  const SamplingTrial* best = &advice.trials.front();
  for (const SamplingTrial& trial : advice.trials)
    if (trial.seconds < kWorthNewSampling * best->seconds && trial.effective_count >= kFewestDeviations) best = &trial;
  advice.after = {advice.reduction.kept.max_bounces, best->sampling, best->samples};
  advice.seconds_after = best->seconds;
}

Inspection inspect(const Problem& problem, const std::vector<double>& start, double seconds) {
  problem.require_parameters();
  const Experiment& experiment = problem.experiment();
  if (experiment.gradient.method != GradientMethod::analytic)
    throw InputError(experiment.file +
                     ": gradient.method: finite differences cannot be taken apart (allowed: analytic)");
  Inspection result;
  const auto points = points_to_inspect(problem.parameters(), start);
  ProgressStage stage("inspecting", static_cast<int>(points.size()) + 2);  // the points, then costs before and after
  for (const InspectedPoint& point : points) {
    result.points.push_back(
        inspect_point(problem, point, (1 - kShareOfCosts) * seconds / static_cast<double>(points.size())));
    stage.advance();
  }

  const auto finds_any = [](const PointInspection& p) { return p.found[0] || p.found[1] || p.found[2]; };
  if (std::none_of(result.points.begin(), result.points.end(), finds_any))
    throw std::runtime_error("no path that the gates see has a derivative: there is nothing to advise");

  Advice& advice = result.advice;
  std::vector<GradientReplicates> replicates;
  for (const PointInspection& p : result.points) replicates.push_back(p.gradient);
  advice.reduction = choose_reduction(replicates, kBiasTolerance);

  std::array<bool, 3> present;
  for (int t = 0; t < 3; ++t) present[t] = experiment.samples.term(kTerms[t]) > 0 && result.points[0].can_be[t];
  advice.before = {experiment.estimator.max_bounces, experiment.estimator.sampling, samples_of(experiment, present)};

  const bool as_before =
      advice.reduction.kept.max_bounces == advice.before.max_bounces && advice.reduction.kept.terms == present;
  const bool other_sampling = experiment.estimator.sampling != Sampling::automatic;
  const double each = kShareOfCosts * seconds / (2 - as_before + other_sampling) / static_cast<double>(points.size());
  std::vector<std::array<int, kPasses>> samples;
  for (const PointInspection& p : result.points)
    samples.push_back(affordable_samples(problem, p.point.theta, p.target, present, each));
  advice.costs_before = measure_all(problem, result.points, present, samples);
  stage.advance();
  Setting reduced = advice.before;
  reduced.max_bounces = advice.reduction.kept.max_bounces;
  const auto trial = [&](Sampling sampling) {
    reduced.sampling = sampling;
    const Problem own(advised(experiment, reduced));
    return SamplingTrial{sampling, {}, 0, 0, measure_all(own, result.points, advice.reduction.kept.terms, samples)};
  };
  if (as_before)
    advice.trials.push_back({advice.before.sampling, {}, 0, 0, advice.costs_before});
  else
    advice.trials.push_back(trial(experiment.estimator.sampling));
  if (other_sampling) advice.trials.push_back(trial(Sampling::automatic));
  choose_samples(advice, problem.scene().camera.width * problem.scene().camera.height);
  return result;
}

Experiment advised(Experiment experiment, const Setting& setting) {
  if (!experiment.target.measured())
    experiment.target.max_bounces = std::max(experiment.target.max_bounces, experiment.estimator.max_bounces);
  experiment.estimator.max_bounces = setting.max_bounces;
  experiment.estimator.sampling = setting.sampling;
  experiment.samples = {setting.samples[0], setting.samples[1], setting.samples[2], setting.samples[3]};
  return experiment;
}

std::string advice_yaml(const Experiment& experiment, const Setting& setting) {
  const Experiment after = advised(experiment, setting);
  std::vector<std::string> keys{"max_bounces", "samples", "estimator.sampling"};
  if (after.target.max_bounces != setting.max_bounces) keys.push_back("target.max_bounces");
  return yaml(selected(resolved_keys(after, "."), keys));
}

std::string inspection_csv(const Problem& problem, const Inspection& inspection) {
  const std::string gate_names = gate_column_names(problem.experiment().gates);
  std::string text = "point,quantity,term,bounces,gate,shape,technique,share,standard_error" + gate_names + "\n";
  const int gates = problem.gates().size(), most = full_bounces(problem.experiment());
  const auto& shapes = problem.scene().shapes;
  for (const PointInspection& p : inspection.points) {
    const auto row = [&](const char* quantity, const char* term, const std::string& bounces, const std::string& gate,
                         const std::string& shape, double share, double error, const char* technique = "") {
      text += fmt::format("{},{},{},{},{},{},{},{},{}", p.point.name, quantity, term, bounces, gate, shape, technique,
                          share, error);
      if (!gate.empty())
        text += gate_column_values(problem, std::stoi(gate));
      else
        text += std::string(std::count(gate_names.begin(), gate_names.end(), ','), ',');
      text += '\n';
    };
    const auto entry = [](const Statistics& s, std::size_t i) { return std::pair(s.mean[i], s.standard_error[i]); };
    for (int b = 0; b <= most; ++b)
      for (int g = 0; g < gates; ++g) {
        const auto [share, error] = entry(p.shares.light, b * gates + g);
        row("light", "", std::to_string(b), std::to_string(g), "", share, error);
      }
    for (std::size_t s = 0; s < shapes.size(); ++s) {
      const auto [share, error] = entry(p.shares.light_by_shape, s);
      row("light", "", "", "", shapes[s].name, share, error);
    }
    for (int i = 0; i < kTechniques; ++i) {
      const char* technique = name(static_cast<Technique>(i));
      if (p.work[0][i] > 0) {
        const auto [share, error] = entry(p.shares.light_by_technique, i);
        row("light", "", "", "", "", share, error, technique);
        row("work", "", "", "", "", p.work[0][i], 0, technique);
      }
      for (int t = 0; t < 3; ++t)
        if (p.work[1 + t][i] > 0) {
          const auto [share, error] = entry(p.shares.by_technique, t * kTechniques + i);
          row("gradient", name(kTerms[t]), "", "", "", share, error, technique);
          row("work", name(kTerms[t]), "", "", "", p.work[1 + t][i], 0, technique);
        }
    }
    for (int t = 0; t < 3; ++t) {
      for (int b = 0; b <= most; ++b) {
        const auto [share, error] = entry(p.shares.by_bounces, t * (most + 1) + b);
        row("gradient", name(kTerms[t]), std::to_string(b), "", "", share, error);
      }
      for (int g = 0; g < gates; ++g) {
        const auto [share, error] = entry(p.shares.by_gate, t * gates + g);
        row("gradient", name(kTerms[t]), "", std::to_string(g), "", share, error);
      }
      for (std::size_t s = 0; s < shapes.size(); ++s) {
        const auto [share, error] = entry(p.shares.by_shape, t * shapes.size() + s);
        row("gradient", name(kTerms[t]), "", "", shapes[s].name, share, error);
      }
    }
    for (int b = 0; b <= most; ++b) {
      const RelativeBias bias = relative_bias(p.gradient, {b, {true, true, true}});
      row("bias", "", std::to_string(b), "", "", bias.value, bias.standard_error);
    }
  }
  return text;
}

}  // namespace isochron
