#include "optim/chart.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <memory>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/plots.h"
#include "optim/files.h"

namespace isochron {
namespace {

struct ChartCommand {
  CommonOptions common;
  double seconds = 60;
  double error_percent = 1;
  std::vector<double> steps;
};

int chart(const ChartCommand& command) {
  begin_session(command.common);
  const Experiment experiment = read_experiment(command.common);
  const Problem problem(experiment);
  problem.require_parameters();
  const std::vector<double> theta =
      problem.parameters().parse_point(command.common.at.empty() ? "initial" : command.common.at);
  const std::string folder =
      command.common.output.empty() ? "runs/" + experiment.name + "-chart" : command.common.output;
  make_output_folder(folder);
  catch_interrupts();
  ChartOptions options;
  options.core_seconds = command.seconds * thread_count(command.common);
  options.error = command.error_percent / 100;
  options.steps = command.steps.empty() ? default_steps(problem, theta) : command.steps;
  options.poll = poll_interrupt;
  options.progress = [](const std::string& what) { spdlog::info("{}", what); };
  options.progress("target");
  const GatedImage target = problem.make_target(poll_interrupt);
  const Chart result = make_chart(experiment, theta, target, options);
  write_file_atomically(folder + "/chart.csv", chart_csv(result));
  write_file_atomically(folder + "/chart_table.csv", chart_table_csv(result));
  fmt::print("{}", chart_table(result));
  spdlog::info("wrote {0}/chart.csv and {0}/chart_table.csv", folder);
  return command.common.no_plots || draw_charts(folder) ? 0 : 1;
}

}  // namespace

void add_chart(CLI::App& app, Action& action) {
  auto command = std::make_shared<ChartCommand>();
  CLI::App* sub =
      app.add_subcommand("chart", "Chart the error of the loss gradient against time, for every method");
  add_experiment_options(*sub, command->common);
  sub->add_option(
         "--seconds", command->seconds,
         "time for the whole chart on idle cores, about; a quarter goes to the reference, the target is not "
         "counted")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->type_name("N");
  sub->add_option("--error", command->error_percent, "relative error that the table asks for, in percent")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->type_name("PERCENT");
  sub->add_option(
         "--steps", command->steps,
         "steps of the finite differences, in units of the parameters; default: 4, 1 and 1/4 times the step "
         "that `check` would take")
      ->delimiter(',')
      ->check(CLI::PositiveNumber)
      ->type_name("A,B,C");
  sub->footer(
      "Writes chart.csv, chart_table.csv and chart.png into -o, default runs/NAME-chart.\n"
      "Examples:\n"
      "  isochron chart cube.yaml\n"
      "  isochron chart cube.yaml --seconds 300 --at height=0.1 -o charts\n"
      "  isochron chart cube.yaml --set gates.sigma=0.1 --steps 0.1,0.01");
  sub->callback([&action, command] { action = [command] { return chart(*command); }; });
}

}  // namespace isochron
