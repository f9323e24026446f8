#include "optim/analysis/check.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/progress.h"
#include "core/base/progress.h"
#include "optim/experiment/files.h"
#include "optim/problem/darkness.h"
#include "optim/problem/estimates.h"
#include "optim/problem/gate_columns.h"
#include "optim/problem/heavy_tail.h"
#include "optim/problem/memory.h"

namespace isochron {
namespace {

/// Most components of one parameter that are checked, evenly spaced.
constexpr int kMostComponents = 32;

std::vector<int> components_to_check(const Parameters& parameters, const Parameters::Block& chosen) {
  std::vector<int> components;
  for (const Parameters::Block& block : parameters.blocks()) {
    const int begin = std::max(block.begin, chosen.begin);
    const int count = std::min(block.begin + block.count, chosen.begin + chosen.count) - begin;
    const int kept = std::min(count, kMostComponents);
    if (kept < count) fmt::print("{}: {} of {} components, evenly spread\n", block.name, kept, count);
    for (int i = 0; i < kept; ++i)
      components.push_back(begin + static_cast<int>(static_cast<long long>(count) * i / kept));
  }
  return components;
}

std::string verdict(const Comparison& row, int comparisons) {
  const std::string rare = row.effective_count < kFewestDeviations ? " (rare hits)" : "";
  switch (finding(row, comparisons)) {
    case Finding::agrees:
      return "ok" + rare;
    case Finding::differs:
      return "DIFFERS" + rare;
    case Finding::difference_saw_nothing:
      return "difference saw nothing";
    case Finding::nothing:
      return "nothing";
  }
  return {};
}

void print_table(const Problem& problem, const std::vector<Comparison>& table) {
  std::size_t width = std::string_view("parameter").size(), label = std::string_view("center").size();
  for (const Comparison& row : table) {
    width = std::max(width, row.parameter.size());
    label = std::max(label, gate_label(problem, row.gate).size());
  }
  fmt::print("{:<{}} {:>4} {:>{}} {:>11} {:>11} {:>11} {:>23} {:>23} {:>7} {:>6}  verdict\n", "parameter", width,
             "gate", "center", label, "interior", "visibility", "path_length", "total +- se", "finite diff. +- se", "z",
             "limit");
  const int comparisons = static_cast<int>(table.size());
  for (const Comparison& row : table)
    fmt::print(
        "{:<{}} {:>4} {:>{}} {:>11.4g} {:>11.4g} {:>11.4g} {:>11.4g} +- {:>8.2g} {:>11.4g} +- {:>8.2g} "
        "{:>7.2f} {:>6.2f}  {}\n",
        row.parameter, width, row.gate, gate_label(problem, row.gate), label, row.terms[0], row.terms[1], row.terms[2],
        row.total, row.standard_error, row.finite_difference, row.finite_difference_error, row.z,
        false_alarm_limit(comparisons, row.degrees), verdict(row, comparisons));
}

int check(const CommonOptions& command) {
  begin_session(command);
  std::vector<std::string> notes;
  const Problem problem(check_experiment(read_experiment(command, false), notes), warn);
  problem.require_parameters();
  const Parameters& parameters = problem.parameters();
  const std::vector<double> theta = parameters.parse_point(command.at.empty() ? "initial" : command.at);
  const Parameters::Block chosen = chosen_parameter(parameters, command.parameter);
  std::vector<MemoryUse> memory = derivative_memory(problem, 1);
  for (const MemoryUse& part : difference_memory(problem, kMostCheckReplicates)) memory.push_back(part);
  require_memory(problem, memory);
  const std::string folder = output_folder(command.output, problem.experiment(), "-check");
  make_output_folder(folder);
  catch_interrupts();
  for (const std::string& note : notes) fmt::print("{}\n", note);
  const std::vector<int> components = components_to_check(parameters, chosen);
  for (int component : components) check_step(problem, theta, component);  // fails before anything is rendered

  std::vector<Comparison> table;
  ProgressDisplay display(command.quiet);
  {
    ProgressStage stage("comparing derivatives", static_cast<int>(components.size()));
    for (int component : components) {
      const auto rows = check_derivative(problem, theta, component);
      table.insert(table.end(), rows.begin(), rows.end());
      stage.advance();
    }
  }
  display.end();
  const int comparisons = static_cast<int>(table.size());
  for (const Comparison& row : table)
    if (!std::isfinite(row.total) || !std::isfinite(row.finite_difference))
      throw std::runtime_error(fmt::format("the derivative by {} is not finite: values overflow", row.parameter));
  write_file_atomically(folder + "/check.csv", check_csv(problem, table));
  print_table(problem, table);
  const auto count = [&](Finding what) {
    return static_cast<int>(std::count_if(table.begin(), table.end(),
                                          [&](const Comparison& row) { return finding(row, comparisons) == what; }));
  };
  const int wrong = count(Finding::differs), blind = count(Finding::difference_saw_nothing),
            empty = count(Finding::nothing);
  fmt::print("{} of {} differ: |z| above the limit of Student's law (1 % chance of a false alarm in the whole table)\n",
             wrong, comparisons);
  if (wrong > 0)
    fmt::print("Too few samples may miss rare events and so their error: repeat with more, and another seed\n");
  if (blind > 0)
    fmt::print(
        "{} of {}: no sample of the finite difference met what changes, so it cannot judge the derivative: repeat "
        "with more samples, or a larger gradient.step\n",
        blind, comparisons);
  if (empty > 0) {
    fmt::print("{} of {} compare nothing with nothing\n", empty, comparisons);
    const GatedImage image =
        problem.render(theta, problem.stream(Pass::primal), {0, problem.experiment().samples.primal});
    const std::string dark = darkness_warning(problem, theta, image, "the image");
    if (!dark.empty()) warn(dark);
    if (empty == comparisons) spdlog::error("nothing was checked: every derivative is zero, as is every difference");
  }
  HeavyTails tails;
  for (const Comparison& row : table) tails.add(row.parameter, row.gate, row.effective_count);
  if (const std::string warning = tails.warning(); !warning.empty()) spdlog::warn(warning);
  say_written(folder, {"check.csv"});
  return wrong == 0 && blind == 0 && empty < comparisons ? 0 : 1;
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  const auto [sub, command] = add_command(
      app, action, "check",
      "Compare the derivatives with finite differences; exit status 1 if they differ or are all zero", check);
  add_experiment_options(*sub, *command);
  add_parameter_option(*sub, *command);
  sub->footer(
      "Every term takes the same number of samples: --samples, or the largest number of the experiment.\n"
      "gradient.step is the largest of the three steps; by default it follows from scene, gates and value.\n"
      "Examples:\n"
      "  isochron check cube.yaml --samples 64\n"
      "  isochron check cube.yaml --parameter height --at height=0.1 -o check\n"
      "  isochron check cube.yaml --set gradient.step=0.02");
}

}  // namespace isochron
