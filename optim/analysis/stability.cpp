#include "optim/analysis/stability.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "core/base/cpu_time.h"
#include "core/base/error.h"
#include "optim/problem/rendered_objective.h"
#include "optim/problem/vector_math.h"
#include "optim/run/loop.h"

namespace isochron {
namespace {

constexpr int kEstimates = 24;
/// Shares of a width's time. A quarter of the target's leaves the same errors, those of the branches at a width of 1e-5: its noise does not
/// limit them.
constexpr double kShareOfReference = 0.25, kTargetShare = 0.2;
constexpr double kMostOfBias = 0.1, kMostOfVariance = 0.5;
/// Finite differences of more unknowns would take nearly all the time.
constexpr int kMostUnknowns = 16;

/// Target images with as many samples as fit the time, but no more than the experiment's.
GatedImage quick_target(Experiment experiment, double core_seconds) {
  automatic_method().change(experiment);
  const int most = experiment.target.samples;
  for (int samples = 1;; samples = std::min(2 * samples, most)) {
    experiment.target.samples = samples;
    const Problem problem(experiment);
    problem.estimator();
    const double start = cpu_seconds();
    GatedImage image = problem.make_target();
    const double time = cpu_seconds() - start;
    if (samples == most || 4 * time > core_seconds) return image;
  }
}

/// Adam from the initial values; returns the parameters' error at the end over that at the start.
double reconstruct(const Problem& problem, const GatedImage& target, int iterations) {
  const Parameters& parameters = problem.parameters();
  if (!parameters.target_known()) return std::numeric_limits<double>::quiet_NaN();
  OptimizerSpec spec = problem.experiment().optimizer;
  // The experiment's own schedule in fewer, larger steps, which lead as far in all.
  const double larger = std::max(1.0, static_cast<double>(spec.iterations) / iterations);
  spec.method = OptimizerMethod::adam;
  spec.learning_rate *= larger;
  spec.decay.start = static_cast<int>(std::lround(spec.decay.start / larger));
  spec.decay.half_life /= larger;
  const std::unique_ptr<Optimizer> optimizer = make_optimizer(spec, problem.preconditioner(), parameters.scales());
  const RenderedObjective objective(problem, target);
  LoopOptions options;
  options.iterations = iterations;
  options.row = [](const Evaluation&, const std::vector<double>&, bool) {};
  options.save = [] {};
  Checkpoint state;
  state.theta = parameters.initial();
  const double before = parameters.distance_to_target(state.theta);
  run_loop(objective, *optimizer, 0, options, state);
  return parameters.distance_to_target(state.theta) / before;
}

StabilityCell map_cell(MethodRun& run, const GatedImage& target, const Reference& reference, double core_seconds,
                       const StabilityOptions& options) {
  const std::vector<double> theta = run.problem().parameters().initial();
  const SampleTrial trial = try_samples(run, theta, target, 1, core_seconds);
  const int step = trial.last_within(core_seconds, 1);
  StabilityCell cell;
  cell.factor = trial.factor(step);
  // Nearer to the time than powers of two and single trials come.
  constexpr int kRounds = 3;
  for (std::uint32_t round = 0; round < kRounds; ++round) {
    run.set_factor(cell.factor);
    double time = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < 2; ++i)
      time = std::min(time, run.gradient(theta, target, kEstimates + 2 * round + i).core_seconds);
    cell.factor = std::max(run.least_factor(), cell.factor * std::clamp(core_seconds / time, 0.25, 4.0));
  }
  run.set_factor(cell.factor);
  Repeats estimates;
  for (std::uint32_t i = 0; i < kEstimates; ++i) {
    MethodRun::Estimate estimate = run.gradient(theta, target, i);
    cell.core_seconds += estimate.core_seconds / kEstimates;
    estimates.push_back(std::move(estimate.gradient));
  }
  cell.direction = direction(estimates, reference);
  cell.error_ratio = reconstruct(run.problem(), target, options.iterations);
  cell.failure = failure(cell.direction, resolved(reference), cell.error_ratio);
  cell.reference_error = reference.error;
  return cell;
}

}  // namespace

const char* name(Failure failure) {
  constexpr const char* kNames[] = {"", "no signal", "bias", "variance", "descent"};
  return kNames[static_cast<int>(failure)];
}

Direction direction(const Repeats& estimates, const Reference& reference) {
  const std::vector<double> truth = mean(reference.repeats);
  const double length = norm(truth), n = static_cast<double>(estimates.size());
  Direction result;
  double squares = 0;
  int zero = 0, positive = 0;
  for (const auto& estimate : estimates) {
    const double own = norm(estimate);
    if (own == 0) ++zero;
    if (own == 0 || length == 0) continue;
    double cosine = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) cosine += estimate[i] / own * (truth[i] / length);
    if (cosine > 0) ++positive;
    result.cosine.value += cosine / n;
    squares += cosine * cosine / n;
  }
  result.zero = zero / n;
  result.positive = positive / n;
  result.cosine.standard_error =
      std::sqrt(std::max(0.0, squares - result.cosine.value * result.cosine.value) / (n - 1));
  const Measured& square = reference.norm2;
  const double norm2 = resolved(reference) ? square.value : std::max(0.0, square.value) + 2 * square.standard_error;
  result.variance = total_variance(estimates);
  const WeightedRepeats groups[] = {{&estimates, 1}, {&reference.repeats, -1}};
  result.bias2 = squared_norm(groups);
  if (norm2 == 0) return result;
  for (double* x : {&result.variance.value, &result.variance.standard_error, &result.bias2.value,
                    &result.bias2.standard_error, &result.bias2.error_if_zero})
    *x /= norm2;
  return result;
}

Failure failure(const Direction& d, bool reference_resolved, double error_ratio) {
  const bool arrives = !(error_ratio > kWorksError);  // also where it is not known
  if (d.positive >= kWorksPositive && arrives) return Failure::none;
  if (d.zero >= 0.5) return Failure::no_signal;
  // The gradient is no larger than the reference's noise lets it be: noise of that size is too much in any
  // case.
  if (!reference_resolved) return d.variance.value >= 1 ? Failure::variance : Failure::no_signal;
  const double bias2 = significant(d.bias2) ? d.bias2.value : 0;
  if (bias2 >= d.variance.value && bias2 >= kMostOfBias * kMostOfBias) return Failure::bias;
  if (d.variance.value >= kMostOfVariance * kMostOfVariance) return Failure::variance;
  // A bias that single estimates hide in their noise leads astray all the same.
  if (bias2 >= kMostOfBias * kMostOfBias) return Failure::bias;
  return Failure::descent;
}

namespace {

/// Empty where the derivative is known under Dirac gates.
std::string why_not_dirac(const Experiment& experiment, const std::vector<double>& theta) {
  Experiment narrow = experiment;
  narrow.gates = with_relative_width(experiment.gates, 0);
  automatic_method().change(narrow);
  try {
    const Problem problem(narrow);
    const Scene scene = problem.parameters().apply(theta);
    const TangentBasis basis = problem.parameters().tangent(theta);
    problem.renderer(scene, problem.estimator(), &basis);
    return {};
  } catch (const InputError& error) {
    return error.what();
  }
}

}  // namespace

bool may_find(const Method& method, Experiment experiment) {
  if (!make_gates(experiment.gates).shape().is_dirac()) return true;
  method.change(experiment);
  const EstimatorOptions& estimator = experiment.estimator;
  const bool images_only = method.gradient == Method::Gradient::finite_difference;
  return estimator.sampling != Sampling::standard && (images_only || estimator.keep_length.value_or(true));
}

GateSpec with_relative_width(const GateSpec& gates, double width) {
  if (gates.unbounded())
    throw InputError(fmt::format("gates.kind: {} gates have no width to vary (allowed: any other kind)", gates.kind));
  GateSpec scaled = gates;
  const double own = make_gates(gates).relative_width();
  if (width == 0) {
    const GateSet set = make_gates(gates);
    scaled.choose("dirac");
    scaled.centers.clear();
    for (int g = 0; g < set.size(); ++g) scaled.centers.push_back(set.center(g) / length_unit(gates));
  } else if (own > 0) {
    scaled.shape = gates.shape->stretched(width / own);
  } else {
    throw InputError(fmt::format("gates.kind: {} gates have no width to vary (allowed: any other kind)", gates.kind));
  }
  return scaled;
}

Stability map_stability(const Experiment& experiment, const StabilityOptions& options) {
  if (experiment.gates.unbounded()) with_relative_width(experiment.gates, 1);  // throws
  if (experiment.target.measured())
    throw InputError(experiment.file +
                     ": target.images: measured images have one width of gates (a target to be rendered)");
  Stability map;
  std::vector<Method> all = methods_for(experiment, options.steps, map.notes);
  all.pop_back();  // `paper` differs in cost, not in where it fails
  if (!options.steps.empty()) all.push_back(independent_differences(options.steps[options.steps.size() / 2]));
  std::vector<double> theta;
  {
    const Problem problem(experiment);
    theta = problem.parameters().initial();
  }
  if (theta.size() > kMostUnknowns) {
    std::erase_if(all, [](const Method& m) { return m.gradient == Method::Gradient::finite_difference; });
    map.notes.push_back(fmt::format("{} unknowns: no finite differences", theta.size()));
  }
  std::vector<double> widths = options.widths;
  std::erase_if(widths, [&](double width) {
    if (width > 0) return false;
    const std::string refusal = why_not_dirac(experiment, theta);
    if (!refusal.empty()) map.notes.push_back("no Dirac gates: " + refusal);
    return !refusal.empty();
  });
  const double of_width = options.core_seconds / static_cast<double>(widths.size());
  ProgressStage stage("mapping", static_cast<int>(widths.size()));
  for (double width : widths) {
    options.progress(fmt::format("width {:.3g}", width));
    Experiment narrow = experiment;
    narrow.gates = with_relative_width(experiment.gates, width);
    const GatedImage target = quick_target(narrow, kTargetShare * of_width);
    const Reference reference = make_reference(narrow, theta, target, kShareOfReference * of_width);
    std::vector<Method> methods = all;
    std::erase_if(methods, [&](const Method& method) { return !may_find(method, narrow); });
    std::deque<MethodRun> runs;
    for (const Method& method : methods) runs.emplace_back(narrow, method);
    const std::vector<std::size_t> first = first_alike(runs, methods, fmt::format("width {:.3g}: ", width), map.notes);
    // All take the time that the slowest needs for its least number of samples, if that is more than their share.
    double different = 0, slowest = 0;
    for (std::size_t m = 0; m < methods.size(); ++m) {
      if (first[m] < m) continue;
      ++different;
      runs[m].set_factor(runs[m].least_factor());
      slowest = std::max(slowest, runs[m].gradient(theta, target, 0).core_seconds);
    }
    const double of_methods = (1 - kShareOfReference - kTargetShare) * of_width;
    const double time = std::max(slowest, of_methods / different / (kEstimates + options.iterations));
    std::vector<StabilityCell> cells;
    for (std::size_t m = 0; m < methods.size(); ++m) {
      cells.push_back(first[m] < m ? cells[first[m]] : map_cell(runs[m], target, reference, time, options));
      cells.back().method = methods[m].name;
      cells.back().width = width;
    }
    for (std::size_t m = 0; m < all.size(); ++m) {
      if (m < cells.size() && cells[m].method == all[m].name) continue;
      StabilityCell none;
      none.method = all[m].name;
      none.width = width;
      none.direction.zero = none.error_ratio = 1;
      none.reference_error = reference.error;
      none.failure = Failure::no_signal;
      cells.insert(cells.begin() + static_cast<std::ptrdiff_t>(m), none);
    }
    map.cells.insert(map.cells.end(), cells.begin(), cells.end());
    stage.advance();
  }
  return map;
}

std::string stability_csv(const Stability& map) {
  std::string text =
      "width,method,factor,core_seconds,positive,cosine,cosine_error,zero,variance,bias2,bias2_error,"
      "error_ratio,reference_error,failure\n";
  for (const StabilityCell& c : map.cells) {
    const Direction& d = c.direction;
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", c.width, c.method, c.factor, c.core_seconds,
                        d.positive, d.cosine.value, d.cosine.standard_error, d.zero, d.variance.value, d.bias2.value,
                        d.bias2.standard_error, c.error_ratio, c.reference_error, name(c.failure));
  }
  return text;
}

std::string stability_table(const Stability& map) {
  std::string text;
  std::size_t column = 26;
  for (const StabilityCell& cell : map.cells) column = std::max(column, cell.method.size());
  for (std::size_t i = 0; i < map.cells.size() && map.cells[i].width == map.cells[0].width; ++i)
    text += fmt::format("  {:<{}}", map.cells[i].method, column);
  text = fmt::format("{:<9}{}\n", "width", text);
  for (std::size_t i = 0; i < map.cells.size(); ++i) {
    const StabilityCell& c = map.cells[i];
    const bool first = i == 0 || map.cells[i - 1].width != c.width;
    const bool last = i + 1 == map.cells.size() || map.cells[i + 1].width != c.width;
    if (first) text += fmt::format("{:<9.3g}", c.width);
    text += fmt::format("  {:<{}}",
                        fmt::format("{:.0f} % {:.3g} {}", 100 * c.direction.positive, c.error_ratio, name(c.failure)),
                        column);
    if (last) text += "\n";
  }
  text += fmt::format(
      "Estimates that point the right way; error after the reconstruction over that before. Reasons where "
      "that is more "
      "than {}, or the first less than {:.0f} %\n",
      kWorksError, 100 * kWorksPositive);
  for (const std::string& note : map.notes) text += note + "\n";
  return text;
}

}  // namespace isochron
