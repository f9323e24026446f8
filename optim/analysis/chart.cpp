#include "optim/analysis/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace isochron {
namespace {

constexpr double kReferenceShare = 0.25;
constexpr std::uint64_t kReferenceSeed = 0x7265666572656e63u;  // changes the experiment's
constexpr int kReferenceRepeats = 32;
constexpr int kLevels = 4;
constexpr int kFewestRepeats = 4, kRepeats = 10, kMostRepeats = 400;
/// Unknowns that are measured where the time grows with their number.
constexpr int kMostComponents = 6;

/// Levels of one height have the same random numbers in all methods, and others than those of another height:
/// methods that come down to the same settings then have the same errors.
std::uint32_t first_iteration(double factor) {
  static_assert(kMostRepeats < 1 << 12);
  return static_cast<std::uint32_t>(std::ilogb(factor) + 64) << 12;
}

std::vector<double> select(const std::vector<double>& values, const std::vector<int>& components) {
  std::vector<double> selected;
  for (int component : components) selected.push_back(values[component]);
  return selected;
}

Repeats select(const Repeats& repeats, const std::vector<int>& components) {
  Repeats selected;
  for (const auto& repeat : repeats) selected.push_back(select(repeat, components));
  return selected;
}

std::string percent(double relative) {
  return fmt::format("{:.3g} %", 100 * relative);
}

/// Relative bias for people; an upper bound where none stands out: two standard errors.
std::string bias_text(const SquaredNorm& bias2) {
  if (significant(bias2)) return percent(std::sqrt(bias2.value));
  return "< " + percent(std::sqrt(std::max(0.0, bias2.value) + 2 * bias2.standard_error));
}

double best_of(const Chart& chart) {
  double best = INFINITY;
  for (const ChartMethod& method : chart.methods) best = std::min(best, method.to_error.value);
  return best;
}

ChartMethod measure_levels(MethodRun& run, const Method& method, const std::vector<double>& theta,
                           const GatedImage& target, double core_seconds) {
  const int unknowns = run.problem().parameters().size();
  if (method.gradient != Method::Gradient::adjoint) run.set_components(spread_components(unknowns, kMostComponents));
  const SampleTrial trial = try_samples(run, theta, target, kRepeats, core_seconds);
  int levels = kLevels;
  while (levels > 1 && trial.last_within(core_seconds / levels, kRepeats) < levels - 1) --levels;
  const double of_level = core_seconds / levels;
  const int top = trial.last_within(of_level, kRepeats);
  ChartMethod result;
  result.name = method.name;
  result.components = static_cast<int>(run.components().size());
  for (int step = top - levels + 1; step <= top; ++step) {
    SampleLevel level;
    level.factor = trial.factor(step);
    run.set_factor(level.factor);
    std::uint32_t iteration = first_iteration(level.factor);
    double spent = 0;
    do {
      MethodRun::Estimate estimate = run.gradient(theta, target, iteration++);
      spent += estimate.core_seconds;
      level.repeats.push_back(std::move(estimate.gradient));
      level.core_seconds = spent / static_cast<double>(level.repeats.size());
    } while (level.repeats.size() < kFewestRepeats ||
             (level.repeats.size() < kMostRepeats && spent + level.core_seconds < of_level));
    result.levels.push_back(std::move(level));
  }
  return result;
}

}  // namespace

bool resolved(const Reference& reference) {
  return reference.norm2.value > 4 * reference.norm2.standard_error;
}

bool fine_enough(const Reference& reference, double error) {
  return reference.error < 0.5 * error;
}

Reference make_reference(const Experiment& experiment, const std::vector<double>& theta, const GatedImage& target,
                         double core_seconds) {
  Experiment own = experiment;
  own.seed ^= kReferenceSeed;
  own.estimator.max_bounces = std::max(own.estimator.max_bounces, own.target.max_bounces);
  MethodRun run(own, automatic_method());
  const SampleTrial trial = try_samples(run, theta, target, kReferenceRepeats, core_seconds);
  // All of the time, in equal repeats.
  const int last = trial.last_within(core_seconds, kReferenceRepeats);
  run.set_factor(trial.factor(last) * std::max(1.0, core_seconds / (kReferenceRepeats * trial.core_seconds[last])));
  Reference result;
  for (int i = 0; i < kReferenceRepeats; ++i) {
    MethodRun::Estimate estimate = run.gradient(theta, target, static_cast<std::uint32_t>(i));
    result.repeats.push_back(std::move(estimate.gradient));
    result.core_seconds += estimate.core_seconds;
  }
  const WeightedRepeats alone{&result.repeats, 1};
  result.norm2 = squared_norm({&alone, 1});
  const double noise2 = total_variance(result.repeats).value / kReferenceRepeats;
  result.error = result.norm2.value > 0 ? std::sqrt(noise2 / result.norm2.value) : INFINITY;
  return result;
}

Chart make_chart(const Experiment& experiment, const std::vector<double>& theta, const GatedImage& target,
                 const ChartOptions& options) {
  Chart chart;
  chart.error = options.error;
  chart.unknowns = static_cast<int>(theta.size());
  options.progress("reference");
  chart.reference = make_reference(experiment, theta, target, kReferenceShare * options.core_seconds);
  if (!resolved(chart.reference))
    throw std::runtime_error(
        fmt::format("the gradient does not stand out of its noise at this point (squared norm {:.3g} +- {:.2g}): "
                    "another point (--at), or more time (--seconds)",
                    chart.reference.norm2.value, chart.reference.norm2.standard_error));
  const std::vector<Method> methods =
      options.techniques ? methods_without(experiment) : methods_for(experiment, options.steps, chart.notes);
  std::deque<MethodRun> runs;
  for (const Method& method : methods) runs.emplace_back(experiment, method);
  const std::vector<std::size_t> first = first_alike(runs, methods, "", chart.notes);
  std::size_t different = 0;
  for (std::size_t m = 0; m < runs.size(); ++m) different += first[m] == m;
  const double each = (1 - kReferenceShare) * options.core_seconds / static_cast<double>(different);
  ProgressStage stage("charting", static_cast<int>(different));
  for (std::size_t m = 0; m < runs.size(); ++m) {
    if (first[m] < m) {
      chart.methods.push_back(chart.methods[first[m]]);
      chart.methods.back().name = methods[m].name;
      continue;
    }
    options.progress(methods[m].name);
    ChartMethod row = measure_levels(runs[m], methods[m], theta, target, each);
    const std::vector<int> components = spread_components(chart.unknowns, row.components);
    const double scale = static_cast<double>(chart.unknowns) / row.components;
    // A squared loss has a gradient whose mean does not depend on the number of samples.
    row.error = method_error(row.levels, select(chart.reference.repeats, components), chart.reference.norm2.value,
                             scale, experiment.loss.kind == LossKind::squared);
    row.to_error = core_seconds_to(options.error, row.error);
    chart.methods.push_back(std::move(row));
    stage.advance();
  }
  if (!fine_enough(chart.reference, options.error))
    chart.notes.push_back(fmt::format("the reference's own error is {}: too noisy to tell a bias of {} (--seconds)",
                                      percent(chart.reference.error), percent(options.error)));
  return chart;
}

std::string chart_csv(const Chart& chart) {
  const double norm2 = chart.reference.norm2.value;
  std::string text =
      "method,factor,repeats,core_seconds,error,variance,variance_error,bias2,bias2_error,components,"
      "unknowns\n";
  text +=
      fmt::format("reference,,{},{},{},{},,,,{},{}\n", chart.reference.repeats.size(), chart.reference.core_seconds,
                  chart.reference.error, chart.reference.error * chart.reference.error, chart.unknowns, chart.unknowns);
  for (const ChartMethod& method : chart.methods) {
    const double scale = static_cast<double>(chart.unknowns) / method.components;
    const Repeats reference = select(chart.reference.repeats, spread_components(chart.unknowns, method.components));
    for (const SampleLevel& level : method.levels) {
      const Measured variance = total_variance(level.repeats);
      const SquaredNorm bias2 = method_error({level}, reference, norm2, scale, false).bias2;
      const double relative = variance.value * scale / norm2;
      text += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", method.name, level.factor, level.repeats.size(),
                          level.core_seconds, std::sqrt(std::max(0.0, relative + bias2.value)), relative,
                          variance.standard_error * scale / norm2, bias2.value, bias2.standard_error, method.components,
                          chart.unknowns);
    }
  }
  return text;
}

std::string chart_table_csv(const Chart& chart) {
  std::string text = "method,core_seconds,standard_error,ratio,rate,slope,bias2,bias2_error,bias_significant\n";
  const double best = best_of(chart);
  for (const ChartMethod& m : chart.methods)
    text += fmt::format("{},{},{},{},{},{},{},{},{}\n", m.name, m.to_error.value, m.to_error.standard_error,
                        m.to_error.value / best, m.error.rate.value, m.error.slope, m.error.bias2.value,
                        m.error.bias2.standard_error, significant(m.error.bias2));
  return text;
}

std::string chart_table(const Chart& chart) {
  std::size_t width = 6;
  for (const ChartMethod& method : chart.methods) width = std::max(width, method.name.size());
  std::string text = fmt::format("{:<{}}  {:>26}  {:>8}  {:>7}  bias\n", "method", width,
                                 "core-seconds to " + percent(chart.error) + " error", "ratio", "slope");
  const double best = best_of(chart);
  for (const ChartMethod& m : chart.methods) {
    const std::string time = std::isfinite(m.to_error.value)
                                 ? fmt::format("{:.3g} +- {:.2g}", m.to_error.value, m.to_error.standard_error)
                                 : fmt::format("never (bias {})", bias_text(m.error.bias2));
    const std::string ratio = std::isfinite(m.to_error.value) ? fmt::format("{:.3g}", m.to_error.value / best) : "";
    text += fmt::format(
        "{:<{}}  {:>26}  {:>8}  {:>7.2f}  {}{}\n", m.name, width, time, ratio, m.error.slope, bias_text(m.error.bias2),
        m.components < chart.unknowns ? fmt::format("  (from {} of {} unknowns)", m.components, chart.unknowns) : "");
  }
  text += fmt::format("reference: {} error, {:.3g} core-seconds\n", percent(chart.reference.error),
                      chart.reference.core_seconds);
  text += "slope: of the error over time, on log scales; where it is steeper than -0.5, times are upper bounds\n";
  for (const std::string& note : chart.notes) text += note + "\n";
  return text;
}

}  // namespace isochron
