#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <stdexcept>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/progress.h"
#include "core/base/clock.h"
#include "optim/experiment/files.h"
#include "optim/problem/darkness.h"
#include "optim/problem/estimates.h"
#include "optim/problem/heavy_tail.h"
#include "optim/problem/memory.h"
#include "optim/run/zero_gradient.h"

namespace isochron {
namespace {

/// The gradient of the first unknowns of each parameter, with 95 % intervals.
std::string on_screen(const Parameters& parameters, const Statistics& gradient) {
  constexpr int kMostRows = 4;
  std::string text;
  for (const Parameters::Block& block : parameters.blocks()) {
    const int shown = block.count > kMostRows ? kMostRows - 1 : block.count;
    for (int i = block.begin; i < block.begin + shown; ++i)
      text += fmt::format("  {}: {:.5g} +- {:.2g} (95 %)\n", parameters.component_names()[i], gradient.mean[i],
                          gradient.half_width_95(i));
    if (shown < block.count) text += fmt::format("  {}: {} more\n", block.name, block.count - shown);
  }
  return text;
}

int gradient(const CommonOptions& options) {
  begin_session(options);
  Problem problem(read_experiment(options), warn);
  problem.set_evaluations(1);
  problem.require_parameters();
  const Parameters& parameters = problem.parameters();
  const std::vector<double> theta = parameters.parse_point(options.at.empty() ? "initial" : options.at);
  require_memory(problem, image_memory(problem));
  const std::string folder = output_folder(options.output, problem.experiment(), "-gradient");
  make_output_folder(folder);
  catch_interrupts();
  gradient_repeats(problem);  // too few samples must show before the target is rendered
  ProgressDisplay display(options.quiet);
  const GatedImage target = problem.make_target();
  const GatedImage image =
      problem.render(theta, problem.stream(Pass::primal), {0, problem.experiment().samples.primal});
  if (const std::string dark = darkness_warning(problem, theta, image, target); !dark.empty()) warn(dark);
  const auto start = Clock::now();
  const GradientEstimate estimate = estimate_gradient(problem, theta, target);
  const double seconds = seconds_since(start);

  display.end();
  std::string table = "parameter,value,gradient,standard_error,degrees_of_freedom,effective_count,half_width_95\n";
  HeavyTails tails;
  for (int i = 0; i < parameters.size(); ++i) {
    const std::string& name = parameters.component_names()[i];
    if (!std::isfinite(estimate.gradient.mean[i]) || !std::isfinite(estimate.gradient.standard_error[i]))
      throw std::runtime_error(fmt::format("the gradient of {} is not finite: values overflow", name));
    const Statistics& s = estimate.gradient;
    table += fmt::format("{},{},{},{},{},{},{}\n", name, theta[i], s.mean[i], s.standard_error[i], s.degrees[i],
                         s.effective_count[i], s.half_width_95(i));
    tails.add(name, -1, s.effective_count[i]);
  }
  write_file_atomically(folder + "/gradient.csv", table);
  write_file_atomically(folder + "/gradient.yaml", fmt::format("seconds: {}\nthreads: {}\nrepeats: {}\n", seconds,
                                                               thread_count(options), estimate.gradient.replicates));
  if (const std::string warning = tails.warning(); !warning.empty()) spdlog::warn(warning);
  if (!options.quiet)
    fmt::print("{}{}", on_screen(parameters, estimate.gradient),
               zero_gradient_report(parameters, estimate.gradient.mean));
  say_written(folder, {"gradient.csv", "gradient.yaml"});
  return 0;
}

}  // namespace

void add_gradient(CLI::App& app, Action& action) {
  const auto [sub, options] =
      add_command(app, action, "gradient", "Estimate the gradient of the loss, its standard error and cost", gradient);
  add_experiment_options(*sub, *options);
  sub->footer(
      "Examples:\n"
      "  isochron gradient cube.yaml --samples 64\n"
      "  isochron gradient cube.yaml --at height=0.1 -o gradient --threads 2\n"
      "  isochron gradient cube.yaml --set gradient.method=finite_difference");
}

}  // namespace isochron
