#include "optim/analysis/chart.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <memory>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/plots.h"
#include "app/progress.h"
#include "core/base/progress.h"
#include "optim/analysis/solver_race.h"
#include "optim/experiment/files.h"
#include "optim/problem/memory.h"

namespace isochron {
namespace {

struct ChartCommand {
  CommonOptions common;
  double seconds = 60;
  double error_percent = 1;
  std::vector<double> steps;
  bool techniques = false, solvers = false;
  int seeds = 3;
};

void note_progress(const std::string& what) {
  spdlog::info("{}", what);
}

void chart_solvers(const ChartCommand& command, const Problem& problem, const std::string& folder) {
  require_error(problem);
  RaceOptions options;
  options.core_seconds = command.seconds * thread_count(command.common);
  options.error = command.error_percent / 100;
  options.seeds = command.seeds;
  options.progress = note_progress;
  ProgressDisplay display(command.common.quiet);
  const Race race = race_solvers(problem.experiment(), problem.make_target(), options);
  display.end();
  write_file_atomically(folder + "/chart_solvers.csv", race_csv(race));
  fmt::print("{}", race_table(race));
}

void chart_gradient(const ChartCommand& command, const Problem& problem, const std::string& folder) {
  const std::vector<double> theta =
      problem.parameters().parse_point(command.common.at.empty() ? "initial" : command.common.at);
  ChartOptions options;
  options.core_seconds = command.seconds * thread_count(command.common);
  options.error = command.error_percent / 100;
  options.steps = command.steps;
  if (options.steps.empty() && !command.techniques) options.steps = default_steps(problem, theta);
  options.techniques = command.techniques;
  options.progress = note_progress;
  options.progress("target");
  ProgressDisplay display(command.common.quiet);
  const GatedImage target = problem.make_target();
  const Chart chart = make_chart(problem.experiment(), theta, target, options);
  display.end();
  write_file_atomically(folder + "/chart.csv", chart_csv(chart));
  write_file_atomically(folder + "/chart_table.csv", chart_table_csv(chart));
  fmt::print("{}", chart_table(chart));
}

int chart(const ChartCommand& command) {
  begin_session(command.common);
  const Problem problem(read_experiment(command.common), warn);
  problem.require_parameters();
  require_memory(problem, image_memory(problem));
  const std::string folder = output_folder(command.common.output, problem.experiment(), "-chart");
  make_output_folder(folder);
  catch_interrupts();
  (command.solvers ? chart_solvers : chart_gradient)(command, problem, folder);
  const bool plotted = !command.common.no_plots && draw_charts(folder);
  std::vector<std::string> files = {"chart.csv", "chart_table.csv"};
  if (command.solvers) files = {"chart_solvers.csv"};
  if (plotted) files.push_back(command.solvers ? "chart_solvers.png" : "chart.png");
  say_written(folder, files);
  return command.common.no_plots || plotted ? 0 : 1;
}

}  // namespace

void add_chart(CLI::App& app, Action& action) {
  const auto [sub, command] =
      add_command(app, action, "chart", "Chart the error of the loss gradient against time, for every method", chart);
  add_experiment_options(*sub, command->common);
  sub->add_option("--seconds", command->seconds,
                  "about the whole time on idle cores; a quarter is for the reference, the target is not "
                  "counted")
      ->check(positive_number())
      ->capture_default_str()
      ->type_name("N");
  sub->add_option("--error", command->error_percent, "relative error whose time the table gives, in percent")
      ->check(positive_number())
      ->capture_default_str()
      ->type_name("PERCENT");
  CLI::Option* steps =
      sub->add_option(
             "--steps", command->steps,
             "steps of the finite differences, in units of the parameters; default: 4, 1 and 1/4 times the step "
             "that `check` would take")
          ->delimiter(',')
          ->check(positive_number())
          ->type_name("A,B,C");
  CLI::Option* techniques = sub->add_flag("--techniques", command->techniques,
                                          "what each technique brings: `auto` without each, in place of other methods")
                                ->excludes(steps);
  CLI::Option* solvers =
      sub->add_flag("--solvers", command->solvers,
                    "reconstructions instead: error of the parameters against time for every optimiser")
          ->excludes(techniques)
          ->excludes(steps);
  sub->add_option("--seeds", command->seeds, "with --solvers: runs of each optimiser")
      ->check(CLI::Range(1, 1000))
      ->needs(solvers)
      ->capture_default_str()
      ->type_name("N");
  sub->footer(
      "Writes chart.csv, chart_table.csv and chart.png (--solvers: chart_solvers.csv and .png) into -o, "
      "default\n"
      "runs/NAME-chart.\n"
      "Examples:\n"
      "  isochron chart cube.yaml\n"
      "  isochron chart cube.yaml --techniques\n"
      "  isochron chart cube.yaml --solvers --seeds 5\n"
      "  isochron chart cube.yaml --seconds 300 --at height=0.1 -o charts\n"
      "  isochron chart cube.yaml --set gates.sigma=0.1 --steps 0.1,0.01");
}

}  // namespace isochron
