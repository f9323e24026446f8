#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/progress.h"
#include "core/base/error.h"
#include "core/base/progress.h"
#include "optim/analysis/advice.h"
#include "optim/experiment/choices.h"
#include "optim/experiment/experiment_edit.h"
#include "optim/experiment/files.h"
#include "optim/problem/gate_columns.h"
#include "optim/problem/heavy_tail.h"
#include "optim/problem/memory.h"

namespace isochron {
namespace {

struct InspectCommand {
  CommonOptions common;
  double seconds = 60;
  bool apply = false;
};

std::string percent(const Statistics& s, std::size_t i) {
  return fmt::format("{:7.2f} +-{:5.2f}", 100 * s.mean[i], 100 * s.standard_error[i]);
}

std::string share_of_term(const PointInspection& p, const Statistics& s, int term, std::size_t i) {
  return p.found[term] ? percent(s, i) : fmt::format("{:>15}", "-");
}

/// One row per bounce, gate or shape: light, then the gradient by terms, then `more`, under its title.
void print_rows(const PointInspection& p, const std::string& title, const std::vector<std::string>& names,
                const Statistics& light, const Statistics& gradient, const std::string& title_of_more = "",
                const std::vector<std::string>& more = {}) {
  std::size_t width = title.size();
  for (const std::string& name : names) width = std::max(width, name.size());
  fmt::print("  {:>{}} {:>15} {:>15} {:>15} {:>15}{}\n", title, width, "light", "interior", "visibility", "path_length",
             title_of_more);
  for (std::size_t i = 0; i < names.size(); ++i) {
    fmt::print("  {:>{}} {}", names[i], width, percent(light, i));
    for (int t = 0; t < 3; ++t) fmt::print(" {}", share_of_term(p, gradient, t, t * names.size() + i));
    fmt::print("{}\n", more.empty() ? "" : "   " + more[i]);
  }
}

/// Those that were used, with what they take of the work.
void print_by_technique(const PointInspection& p) {
  const auto rows_of = [](const Statistics& all, const std::vector<int>& used, int blocks) {
    Statistics rows;
    for (int b = 0; b < blocks; ++b)
      for (const int t : used) {
        rows.mean.push_back(all.mean[b * kTechniques + t]);
        rows.standard_error.push_back(all.standard_error[b * kTechniques + t]);
      }
    return rows;
  };
  std::vector<int> used;
  std::vector<std::string> names, work;
  for (int t = 0; t < kTechniques; ++t) {
    std::string parts;
    bool any = false;
    for (const auto& pass : p.work) {
      parts += pass[t] > 0 ? fmt::format("{:8.1f}", 100 * pass[t]) : fmt::format("{:>8}", "-");
      any |= pass[t] > 0;
    }
    if (!any) continue;
    used.push_back(t);
    names.push_back(name(static_cast<Technique>(t)));
    work.push_back(parts);
  }
  print_rows(p, "technique", names, rows_of(p.shares.light_by_technique, used, 1),
             rows_of(p.shares.by_technique, used, 3), "   % of the work: images, terms", work);
}

void print_point(const Problem& problem, const PointInspection& p) {
  const int gates = problem.gates().size(), most = full_bounces(problem.experiment());
  fmt::print(
      "\nAt {}, % of the light and of the gradient, with standard errors ({} replicates of {} samples per "
      "pixel "
      "of the images and {}, {}, {} of the terms):\n",
      p.point.name, p.gradient.size(), p.samples[0], p.samples[1], p.samples[2], p.samples[3]);
  // Sums over gates, and over bounces; errors as if the summands were independent.
  const auto sum = [&](int count, int others, auto&& index) {
    Statistics s;
    for (int i = 0; i < count; ++i) {
      double mean = 0, error = 0;
      for (int j = 0; j < others; ++j) {
        mean += p.shares.light.mean[index(i, j)];
        error = std::hypot(error, p.shares.light.standard_error[index(i, j)]);
      }
      s.mean.push_back(mean);
      s.standard_error.push_back(error);
    }
    return s;
  };
  std::vector<std::string> names, bias;
  for (int b = 0; b <= most; ++b) {
    names.push_back(std::to_string(b));
    const RelativeBias r = relative_bias(p.gradient, {b, {true, true, true}});
    bias.push_back(fmt::format("{:7.2f} +-{:5.2f}", 100 * r.value, 100 * r.standard_error));
  }
  print_rows(p, "bounces", names, sum(most + 1, gates, [&](int b, int g) { return b * gates + g; }),
             p.shares.by_bounces, "   bias if paths stop here", bias);
  names.clear();
  for (int g = 0; g < gates; ++g) names.push_back(fmt::format("{} ({})", g, gate_label(problem, g)));
  print_rows(p, "gate (center)", names, sum(gates, most + 1, [&](int g, int b) { return b * gates + g; }),
             p.shares.by_gate);
  names.clear();
  for (const Shape& s : problem.scene().shapes) names.push_back(s.name);
  print_rows(p, "shape", names, p.shares.light_by_shape, p.shares.by_shape);
  print_by_technique(p);
}

std::string numbers(const std::array<int, kPasses>& n) {
  return fmt::format("{}, {}, {}, {}", n[0], n[1], n[2], n[3]);
}

void print_costs(const Inspection& inspection) {
  fmt::print(
      "\nVariance of the gradient (of one sample per pixel; units of the parameters' ways to the target) and "
      "CPU "
      "time of the present setting:\n");
  fmt::print("  {:<16} {:<12} {:>11} {:>17} {:>16}\n", "point", "pass", "variance", "times image noise",
             "us per sample");
  const Advice& advice = inspection.advice;
  for (std::size_t i = 0; i < inspection.points.size(); ++i) {
    const GradientCost& c = advice.costs_before[i];
    const std::string& point = inspection.points[i].point.name;
    fmt::print("  {:<16} {:<12} {:>11.3g} {:>17} {:>16.3g}\n", point, "primal", c.variance.image, "",
               1e6 * c.seconds[0]);
    for (int t = 0; t < 3; ++t)
      if (c.seconds[1 + t] > 0)
        fmt::print("  {:<16} {:<12} {:>11.3g} {:>17.3g} {:>16.3g}\n", point, name(kTerms[t]), c.variance.term[t],
                   c.variance.cross[t], 1e6 * c.seconds[1 + t]);
  }
}

/// How a problem's paths are found.
void print_techniques(const Problem& problem) {
  const auto print = [](const char* what, bool connections, double light) {
    if (connections)
      fmt::print("  {:<24} ellipsoidal connections{}\n", what, light > 0 ? " with light subpaths" : "");
    else
      fmt::print("  {:<24} {:>3.0f} % standard sampling, {:>3.0f} % light subpaths\n", what, 100 * (1 - light),
                 100 * light);
  };
  const auto mix_of = [&](const EstimatorOptions& options) {
    return sampling_mix(options, problem.gates(), problem.scene());
  };
  const SamplingMix image = mix_of(problem.image_estimator()), gradient = mix_of(problem.estimator());
  fmt::print("\nHow paths are found:\n");
  print("images", image.image_connections, image.image_light);
  print("images, for gradients", gradient.image_connections, gradient.image_light);
  print("interior", gradient.interior_connections, gradient.interior_light);
}

void print_advice(const Problem& problem, const Inspection& inspection) {
  const Advice& advice = inspection.advice;
  const Reduction& kept = advice.reduction.kept;
  fmt::print("\nNeeded: {} of {} bounces", kept.max_bounces, full_bounces(problem.experiment()));
  for (int t = 0; t < 3; ++t) {
    const PointInspection& p = inspection.points[0];
    fmt::print("; {} {}", name(kTerms[t]), kept.terms[t] ? "yes" : !p.can_be[t] ? "no (it is zero)" : "no");
  }
  fmt::print("\nBias of the gradient of what is needed:");
  for (std::size_t i = 0; i < inspection.points.size(); ++i)
    fmt::print(" {:.2f} +- {:.2f} % ({})", 100 * advice.reduction.bias[i].value,
               100 * advice.reduction.bias[i].standard_error, inspection.points[i].point.name);
  fmt::print("\n");
  double beyond = 0;
  for (const PointInspection& p : inspection.points) beyond = std::max(beyond, expected_beyond(p.gradient));
  if (std::isinf(beyond))
    fmt::print("The last bounce brings no less than the one before: the full model itself may need far more\n");
  else if (beyond > kBiasTolerance)
    fmt::print(
        "If further bounces shrink like the last, the full model itself is off by {:.1f} %: it may need "
        "more\n",
        100 * beyond);
  for (const std::string& what : advice.reduction.undecided)
    fmt::print("Too few samples to decide about {}: kept. --seconds gives more\n", what);
  fmt::print(
      "Samples (primal, interior, visibility, path_length) and CPU seconds of a gradient of equal "
      "variance:\n");
  fmt::print("  {:<30} {:<28} {:>9.4f}\n", "now", numbers(advice.before.samples), advice.seconds_before);
  for (const SamplingTrial& trial : advice.trials)
    fmt::print(
        "  {:<30} {:<28} {:>9.4f}{}\n", fmt::format("advised, {} sampling", name_of(trial.sampling)),
        numbers(trial.samples), trial.seconds,
        trial.effective_count < kFewestDeviations ? "  (a few rare samples make the variance: not to be trusted)" : "");
  fmt::print("\n{}", advice_yaml(problem.experiment(), advice.after));
}

int inspect_experiment(const InspectCommand& command) {
  begin_session(command.common);
  if (command.apply && (!command.common.set.empty() || command.common.samples))
    throw InputError("--apply: not with --set or --samples, which change what is inspected (allowed: alone)");
  const Problem problem(read_experiment(command.common), warn);
  const Experiment& experiment = problem.experiment();
  problem.require_parameters();
  const std::vector<double> start =
      problem.parameters().parse_point(command.common.at.empty() ? "initial" : command.common.at);
  const std::string folder = output_folder(command.common.output, experiment, "-inspect");
  make_output_folder(folder);
  catch_interrupts();
  ProgressDisplay display(command.common.quiet);
  const Inspection inspection = inspect(problem, start, command.seconds);
  display.end();
  fmt::print("{}: {} unknowns, {} gates, {} bounces at most\n", experiment.name, problem.parameters().size(),
             problem.gates().size(), full_bounces(experiment));
  for (const PointInspection& p : inspection.points) print_point(problem, p);
  print_costs(inspection);
  print_techniques(problem);
  print_advice(problem, inspection);
  write_file_atomically(folder + "/inspect.csv", inspection_csv(problem, inspection));
  write_file_atomically(folder + "/inspect.yaml", advice_yaml(experiment, inspection.advice.after));
  say_written(folder, {"inspect.csv", "inspect.yaml"});
  if (!command.apply) return 0;
  const Experiment before = load_experiment(command.common.file);
  const Experiment after = advised(before, inspection.advice.after);
  const std::vector<Edit> list = changes(before, after);
  if (list.empty()) {
    spdlog::info("{}: nothing to change", command.common.file);
    return 0;
  }
  edit_experiment(command.common.file, list, after);
  spdlog::info("{}: {} values changed", command.common.file, list.size());
  return 0;
}

}  // namespace

void add_inspect(CLI::App& app, Action& action) {
  const auto [sub, command] = add_command(
      app, action, "inspect",
      "Measure how much of the model a scene needs: bounces, terms, sampling, numbers of samples", inspect_experiment);
  add_experiment_options(*sub, command->common);
  sub->add_option("--seconds", command->seconds, "about how many CPU seconds to spend, summed over cores; default 60")
      ->check(number(0.1, 1e6))
      ->type_name("N");
  sub->add_flag("--apply", command->apply, "write the advice into the experiment file");
  sub->footer(
      "Advises the smallest model whose gradient of the loss is within 1 % of the full model's, two standard "
      "errors\n"
      "included, and the numbers of samples that reach the present variance in the least time.\n"
      "Examples:\n"
      "  isochron inspect cube.yaml\n"
      "  isochron inspect cube.yaml --seconds 120 -o look\n"
      "  isochron inspect cube.yaml --apply");
}

}  // namespace isochron
