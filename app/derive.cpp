#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/plots.h"
#include "app/progress.h"
#include "core/base/progress.h"
#include "core/image/image.h"
#include "optim/experiment/files.h"
#include "optim/problem/darkness.h"
#include "optim/problem/estimates.h"
#include "optim/problem/gate_columns.h"
#include "optim/problem/heavy_tail.h"
#include "optim/problem/loss.h"
#include "optim/problem/memory.h"

namespace isochron {
namespace {

/// Of images held at a time, about; more unknowns are done in groups, each with the same random numbers.
constexpr double kMostBytes = 1e9;

std::vector<std::string> written(const Parameters& parameters, const Parameters::Block& block, const char* ending) {
  std::vector<std::string> files;
  for (int i = block.begin; i < block.begin + block.count; ++i)
    files.push_back(parameters.component_names()[i] + ending);
  return files;
}

int derive(const CommonOptions& command) {
  begin_session(command);
  Problem problem(read_experiment(command, false), warn);
  problem.set_evaluations(1);
  problem.require_parameters();
  const Parameters& parameters = problem.parameters();
  const std::vector<double> theta = parameters.parse_point(command.at.empty() ? "initial" : command.at);
  const Parameters::Block block = chosen_parameter(parameters, command.parameter);
  const std::string folder = output_folder(command.output, problem.experiment(), "-derive");

  double bytes = 0;
  for (const MemoryUse& part : derivative_memory(problem, 1)) bytes += part.bytes;
  const int group = std::max(1, static_cast<int>(std::min(kMostBytes / bytes, 1e6)));
  require_memory(problem, derivative_memory(problem, std::min(group, block.count)));
  make_output_folder(folder);
  catch_interrupts();
  ProgressDisplay display(command.quiet);
  ProgressStage stage("rendering the derivatives", (block.count + group - 1) / group);
  std::string table =
      "parameter,gate,component,mean,standard_error,replicates,degrees_of_freedom,effective_count,half_width_95" +
      gate_column_names(problem.experiment().gates) + "\n";
  HeavyTails tails;
  bool dark = true;  // every derivative is exactly zero
  for (int first = block.begin; first < block.begin + block.count; first += group) {
    const int count = std::min(group, block.begin + block.count - first);
    auto components = estimate_derivatives(problem, theta, first, count);
    for (int i = 0; i < count; ++i) {
      const std::string& name = parameters.component_names()[first + i];
      std::vector<std::string> names;
      std::vector<StoredImage> images;
      for (DerivativeEstimate& component : components) {
        names.push_back(component.component);
        images.push_back(std::move(component.images[i]));
        require_finite(images.back(), fmt::format("{} of {}", component.component, name));
        for (int pixel = 0; dark && pixel < images.back().pixels(); ++pixel)
          images.back().for_each(pixel, [&](std::uint32_t, float value) { dark = dark && value == 0; });
      }
      write_exr_components(folder + "/" + name + ".exr", names, images, exr_notes(problem.experiment().gates));
      for (int g = 0; g < problem.gates().size(); ++g)
        for (const DerivativeEstimate& component : components) {
          const Statistics& s = component.gates[i];
          table += fmt::format("{},{},{},{},{},{},{},{},{}{}\n", name, g, component.component, s.mean[g],
                               s.standard_error[g], s.replicates, s.degrees[g], s.effective_count[g],
                               s.half_width_95(g), gate_column_values(problem, g));
          tails.add(name, g, s.effective_count[g]);
        }
    }
    stage.advance();
  }
  display.end();
  write_file_atomically(folder + "/derive.csv", table);
  if (dark) {
    const GatedImage image =
        problem.render(theta, problem.stream(Pass::primal), {0, problem.experiment().samples.primal});
    const std::string warning = darkness_warning(problem, theta, image, "the image");
    warn(warning.empty() ? "every derivative is zero: no parameter changes what the gates see" : warning);
  }
  if (const std::string warning = tails.warning(); !warning.empty()) spdlog::warn(warning);
  const bool plotted = !command.no_plots && draw_plots(folder);
  say_written(folder, written(parameters, block, ".exr"));
  if (plotted) say_written(folder, written(parameters, block, ".png"));
  say_written(folder, {"derive.csv"});
  return command.no_plots || plotted ? 0 : 1;
}

}  // namespace

void add_derive(CLI::App& app, Action& action) {
  const auto [sub, command] = add_command(app, action, "derive", "Render derivative images, term by term", derive);
  add_experiment_options(*sub, *command);
  add_parameter_option(*sub, *command);
  sub->footer(
      "Examples:\n"
      "  isochron derive cube.yaml --samples 256\n"
      "  isochron derive cube.yaml --parameter height --at target -o derivative\n"
      "  isochron derive cube.yaml --set gradient.method=finite_difference");
}

}  // namespace isochron
