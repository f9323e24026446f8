#include "optim/run/run.h"

#include <spdlog/spdlog.h>

#include "app/commands.h"
#include "app/execute_run.h"

namespace isochron {
namespace {

struct RunCommand {
  CommonOptions common;
  bool force = false;
};

int run(const RunCommand& command) {
  begin_session(command.common);
  Experiment experiment = read_experiment(command.common);
  if (!command.common.at.empty()) {
    const Problem problem(experiment);
    start_at(problem.parameters().parse_point(command.common.at), problem.parameters(), experiment);
  }
  const std::string folder = output_folder(command.common, experiment);
  return execute_run(folder, command.common, command.force,
                     [&](const RunOptions& options) { return start_run(experiment, options); });
}

}  // namespace

void add_run(CLI::App& app, Action& action) {
  auto command = std::make_shared<RunCommand>();
  CLI::App* sub = app.add_subcommand("run", "Optimise from the initial values towards the target");
  add_experiment_options(*sub, command->common);
  sub->add_flag("--force", command->force,
                "overwrite the run that the folder holds (else it is moved to DIR.1, DIR.2, ...)");
  sub->footer(
      "Examples:\n"
      "  isochron run cube.yaml\n"
      "  isochron run cube.yaml -o out --samples 16 --set optimizer.iterations=20\n"
      "  isochron run cube.yaml --at height=0.1 --seed 5 --force");
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace isochron
