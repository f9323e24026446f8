#include "optim/run_folder.h"

#include <fmt/format.h>

#include <filesystem>

#include "core/math/error.h"
#include "optim/files.h"

namespace isochron {
namespace {

/// Everything a run writes, experiment.yaml first: without it a half-cleared folder is no run.
void clear_run(const std::string& folder) {
  for (const char* file :
       {"experiment.yaml", "checkpoint.yaml", "checkpoint.previous.yaml", "log.csv", "summary.yaml", "target.exr",
        "initial.exr", "final.exr", "target.png", "initial.png", "final.png", "rmse.png"})
    std::filesystem::remove(std::filesystem::path(folder) / file);
}

/// Renames a folder to the first free of FOLDER.1, FOLDER.2, ...; returns the new name.
std::string set_aside(const std::string& folder) {
  const std::string base = std::filesystem::path(folder + "/").parent_path().string();
  for (int i = 1;; ++i) {
    const std::string kept = fmt::format("{}.{}", base, i);
    if (std::filesystem::exists(kept)) continue;
    std::error_code error;
    std::filesystem::rename(base, kept, error);
    if (error)
      throw InputError(
          fmt::format("{}: holds a run already, which cannot be moved to {}: {} (allowed: -o for another "
                      "folder, --force to overwrite)",
                      base, kept, error.message()));
    return kept;
  }
}

}  // namespace

void prepare_run_folder(const std::string& folder, bool force, const std::function<void(const std::string&)>& warning) {
  make_output_folder(folder);
  if (!std::filesystem::exists(folder + "/experiment.yaml")) return;
  if (force) {
    clear_run(folder);
    return;
  }
  const std::string kept = set_aside(folder);
  if (warning) warning(fmt::format("{} held a run already: moved to {}", folder, kept));
  make_output_folder(folder);
}

}  // namespace isochron
