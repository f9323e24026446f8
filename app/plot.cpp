#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/plots.h"
#include "core/base/error.h"

namespace isochron {
namespace {

bool has_images(const std::filesystem::path& folder) {
  const auto is_image = [](const std::filesystem::directory_entry& entry) {
    return entry.path().extension() == ".exr";
  };
  return std::any_of(std::filesystem::directory_iterator(folder), {}, is_image);
}

int plot(const std::string& folder) {
  catch_interrupts();
  const std::filesystem::path path = folder;
  if (!std::filesystem::is_directory(path)) throw InputError(fmt::format("plot: {}: no such folder", folder));
  for (const char* table : {"chart.csv", "chart_solvers.csv", "stability.csv"})
    if (std::filesystem::exists(path / table)) return draw_charts(folder) ? 0 : 1;
  if (!has_images(path) && !std::filesystem::exists(path / "log.csv"))
    throw InputError(
        fmt::format("plot: {}: nothing to draw (allowed: a folder that a command has written, with images "
                    "or a table)",
                    folder));
  return draw_plots(folder) ? 0 : 1;
}

}  // namespace

void add_plot(CLI::App& app, Action& action) {
  const auto [sub, folder] =
      add_command(app, action, "plot", "Draw the pictures of an output folder again, as after --no-plots", plot);
  sub->add_option("folder", *folder, "folder that a command has written")->required()->type_name("DIR");
  sub->footer(
      "Examples:\n"
      "  isochron plot runs/cube");
}

}  // namespace isochron
