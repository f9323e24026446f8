#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/plots.h"
#include "app/progress.h"
#include "core/base/progress.h"
#include "core/image/image.h"
#include "optim/experiment/files.h"
#include "optim/problem/capture_data.h"
#include "optim/problem/darkness.h"
#include "optim/problem/estimates.h"
#include "optim/problem/gate_columns.h"
#include "optim/problem/heavy_tail.h"
#include "optim/problem/memory.h"

namespace isochron {
namespace {

int render(const CommonOptions& options) {
  begin_session(options);
  const Problem problem(read_experiment(options, false), warn);
  const std::vector<double> theta = problem.parameters().parse_point(options.at.empty() ? "initial" : options.at);
  require_memory(problem, image_memory(problem));
  const std::string folder = output_folder(options.output, problem.experiment(), "-render");
  make_output_folder(folder);
  catch_interrupts();
  ProgressDisplay display(options.quiet);
  const ImageEstimate estimate = estimate_image(problem, theta);
  display.end();
  require_finite(estimate.image, "the image");
  if (const std::string dark = darkness_warning(problem, theta, estimate.gates.mean, "the image"); !dark.empty())
    warn(dark);
  write_exr(folder + "/render.exr", estimate.image, exr_notes(problem.experiment().gates));
  std::string table = "gate,mean,standard_error,replicates,degrees_of_freedom,effective_count,half_width_95" +
                      gate_column_names(problem.experiment().gates) + "\n";
  const Statistics& s = estimate.gates;
  HeavyTails tails;
  for (int g = 0; g < problem.gates().size(); ++g) {
    table += fmt::format("{},{},{},{},{},{},{}{}\n", g, s.mean[g], s.standard_error[g], s.replicates, s.degrees[g],
                         s.effective_count[g], s.half_width_95(g), gate_column_values(problem, g));
    tails.add("the image", g, s.effective_count[g]);
  }
  write_file_atomically(folder + "/render.csv", table);
  if (const std::string warning = tails.warning(); !warning.empty()) spdlog::warn(warning);
  const bool plotted = !options.no_plots && draw_plots(folder);
  std::vector<std::string> files = {"render.exr", "render.csv"};
  if (write_histograms(folder + "/render.h5", problem.experiment(), problem.scene(), estimate.image))
    files.push_back("render.h5");
  if (plotted) files.push_back("render.png");
  say_written(folder, files);
  return options.no_plots || plotted ? 0 : 1;
}

}  // namespace

void add_render(CLI::App& app, Action& action) {
  const auto [sub, options] = add_command(app, action, "render", "Render the gated images", render);
  add_experiment_options(*sub, *options);
  sub->footer(
      "Examples:\n"
      "  isochron render cube.yaml --samples 256\n"
      "  isochron render cube.yaml --at target -o target_images\n"
      "  isochron render cube.yaml --at height=0.1 --set gates.sigma=0.05");
}

}  // namespace isochron
