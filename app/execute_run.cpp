#include "app/execute_run.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "app/interrupt.h"
#include "app/plots.h"
#include "app/progress.h"
#include "core/base/progress.h"
#include "optim/run/report.h"

namespace isochron {

std::optional<int> execute_run(const std::string& folder, const CommonOptions& common,
                               const std::function<std::optional<RunStatus>(const RunOptions&)>& start) {
  catch_interrupts();
  ProgressDisplay display(common.quiet);
  RunOptions options;
  options.folder = folder;
  options.force = common.force;
  options.progress = [&](const Progress& progress) { display.show(progress); };
  options.warning = warn;
  std::string report;
  options.report = [&](const std::string& text) { report = text; };
  const std::optional<RunStatus> status = start(options);
  display.end();
  if (!status) return {};
  if (status == RunStatus::interrupted) {
    spdlog::warn("interrupted; continue with: isochron resume {}", folder);
    return 1;
  }
  const bool plotted = common.no_plots || draw_plots_and_report(folder);
  if (!common.quiet) fmt::print("{}{}", report, files_to_look_at(folder, !common.no_plots && plotted));
  if (status == RunStatus::diverged) {
    spdlog::error("{}: the run diverged; see log.csv and summary.yaml there", folder);
    return 1;
  }
  spdlog::info("{}: {}", folder, name(*status));
  return plotted ? 0 : 1;
}

}  // namespace isochron
