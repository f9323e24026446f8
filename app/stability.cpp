#include "optim/analysis/stability.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/plots.h"
#include "app/progress.h"
#include "core/base/error.h"
#include "core/base/progress.h"
#include "optim/experiment/description.h"
#include "optim/experiment/files.h"
#include "optim/problem/memory.h"

namespace isochron {
namespace {

struct StabilityCommand {
  CommonOptions common;
  double seconds = 180;
  int iterations = 50;
  std::vector<double> widths, steps;
};

/// Half decades from 10 % to a millionth of the path length and, where derivatives know them, Dirac gates.
std::vector<double> default_widths(const Scene& scene) {
  std::vector<double> widths;
  for (int i = 2; i <= 12; ++i) widths.push_back(std::pow(10, -0.5 * i));
  if (may_keep_length(scene)) widths.push_back(0);
  return widths;
}

void require_widths(const std::vector<double>& widths) {
  for (const double width : widths)
    if (width != 0 && !(width >= kLeastRelativeWidth && width <= 1))
      throw InputError(fmt::format("--widths: {} (allowed: 0, or {} to 1)", width, kLeastRelativeWidth));
}

int stability(const StabilityCommand& command) {
  begin_session(command.common);
  require_widths(command.widths);
  Experiment experiment = read_experiment(command.common);
  StabilityOptions options;
  with_relative_width(experiment.gates, 0.1);  // steady gates fail here
  const Problem problem(experiment, warn);
  options.widths = command.widths.empty() ? default_widths(problem.scene()) : command.widths;
  std::sort(options.widths.begin(), options.widths.end(), std::greater<>());
  options.widths.erase(std::unique(options.widths.begin(), options.widths.end()), options.widths.end());
  problem.require_parameters();
  const std::vector<double> theta = problem.parameters().initial();
  require_memory(problem, image_memory(problem));
  const std::string folder = output_folder(command.common.output, experiment, "-stability");
  make_output_folder(folder);
  catch_interrupts();
  options.core_seconds = command.seconds * thread_count(command.common);
  options.iterations = command.iterations;
  options.steps = command.steps.empty() ? default_steps(problem, theta) : command.steps;
  options.progress = [](const std::string& what) { spdlog::info("{}", what); };
  ProgressDisplay display(command.common.quiet);
  const Stability map = map_stability(experiment, options);
  display.end();
  write_file_atomically(folder + "/stability.csv", stability_csv(map));
  fmt::print("{}", stability_table(map));
  const bool plotted = !command.common.no_plots && draw_charts(folder);
  std::vector<std::string> files = {"stability.csv"};
  if (plotted) files.push_back("stability.png");
  say_written(folder, files);
  return command.common.no_plots || plotted ? 0 : 1;
}

}  // namespace

void add_stability(CLI::App& app, Action& action) {
  const auto [sub, command] = add_command(
      app, action, "stability", "Map over gate width and method where gradients and reconstructions fail", stability);
  add_experiment_options(*sub, command->common);
  sub->get_option("--at")->group("");
  sub->add_option("--seconds", command->seconds,
                  "about the time for the whole map on idle cores; every gradient of a width takes the same time")
      ->check(positive_number())
      ->capture_default_str()
      ->type_name("N");
  sub->add_option("--iterations", command->iterations, "of each short reconstruction, by Adam")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str()
      ->type_name("N");
  sub->add_option("--widths", command->widths,
                  "standard deviations of the gates over the path length, 0: Dirac gates; default: 1e-1 to 1e-6 in "
                  "half decades and 0")
      ->delimiter(',')
      ->type_name("A,B,C");
  sub->add_option("--steps", command->steps, "steps of the finite differences, as in `chart`")
      ->delimiter(',')
      ->check(positive_number())
      ->type_name("A,B,C");
  sub->footer(
      "Writes stability.csv and stability.png into -o, default runs/NAME-stability.\n"
      "Examples:\n"
      "  isochron stability cube.yaml\n"
      "  isochron stability cube.yaml --widths 1e-2,1e-3,0 --seconds 60 -o map\n"
      "  isochron stability corridor.yaml --iterations 100 --seconds 600");
}

}  // namespace isochron
