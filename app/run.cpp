#include "optim/run/run.h"

#include <spdlog/spdlog.h>

#include "app/commands.h"
#include "app/execute_run.h"

namespace isochron {
namespace {

int run(const CommonOptions& command) {
  begin_session(command);
  Experiment experiment = read_experiment(command);
  if (!command.at.empty()) {
    const Problem problem(experiment);
    start_at(problem.parameters().parse_point(command.at), problem.parameters(), experiment);
  }
  const std::string folder = output_folder(command.output, experiment);
  return *execute_run(folder, command, [&](const RunOptions& options) { return start_run(experiment, options); });
}

}  // namespace

void add_run(CLI::App& app, Action& action) {
  const auto [sub, command] =
      add_command(app, action, "run", "Optimise from the initial values towards the target", run);
  add_experiment_options(*sub, *command);
  add_force_option(*sub, *command);
  sub->footer(
      "Examples:\n"
      "  isochron run cube.yaml\n"
      "  isochron run cube.yaml -o out --samples 16 --set optimizer.iterations=20\n"
      "  isochron run cube.yaml --at height=0.1 --seed 5 --force");
}

}  // namespace isochron
