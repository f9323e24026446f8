#include "optim/reconstruct/run_reconstruction.h"

#include <fmt/format.h>

#include <filesystem>

#include "core/base/file.h"
#include "core/base/ranks.h"
#include "core/base/scratch_folder.h"
#include "optim/run/run_folder.h"

namespace isochron {
namespace {

void write_without_signal(const Reconstruction& found, const RunOptions& options) {
  const FolderLock lock = prepare_run_folder(options.folder, options.force, options.warning);
  write_file_atomically(options.folder + "/summary.yaml",
                        fmt::format("fit: {{verdict: no_signal, photons_needed: {:.3g}}}\n{}", found.photons_needed,
                                    found.files.at("start.yaml")));
}

}  // namespace

std::string default_folder(const ReconstructionSpec& spec) {
  return "runs/" + std::filesystem::path(spec.capture).stem().string();
}

ReconstructionResult run_reconstruction(const ReconstructionSpec& spec, RunOptions options) {
  const ScratchFolder place;
  Reconstruction found = begin_reconstruction(spec, place.path(), options.warning);
  if (!found.has_signal) {
    on_first_rank([&] { write_without_signal(found, options); });
    return {{}, found.photons_needed};
  }
  options.files = std::move(found.files);
  return {start_run(load_experiment(place.path() + "/experiment.yaml"), options), found.photons_needed};
}

}  // namespace isochron
