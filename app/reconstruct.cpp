#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <filesystem>

#include "app/commands.h"
#include "app/execute_run.h"
#include "app/temporary_folder.h"
#include "core/base/file.h"
#include "optim/reconstruct/reconstruction.h"
#include "optim/run/run_folder.h"

namespace isochron {
namespace {

struct ReconstructCommand {
  CommonOptions common;
  ReconstructionSpec spec;
  bool force = false;
};

/// A folder that says that there is nothing to be found, and how much light would be needed.
int end_without_signal(const Reconstruction& found, const std::string& folder, bool force) {
  const FolderLock lock = prepare_run_folder(folder, force, warn);
  write_file_atomically(folder + "/summary.yaml", fmt::format("fit: {{verdict: no_signal, photons_needed: {:.3g}}}\n{}",
                                                              found.photons_needed, found.files.at("start.yaml")));
  spdlog::error(
      "{}: no light of a hidden surface stands out of the background; the smallest surface that could be told apart "
      "would have to send "
      "some {:.0f} photons to all points together",
      folder, found.photons_needed);
  return 1;
}

int reconstruct(ReconstructCommand command) {
  begin_session(command.common);
  const std::string name = std::filesystem::path(command.spec.capture).stem().string();
  const std::string folder = command.common.output.empty() ? "runs/" + name : command.common.output;
  const TemporaryFolder place;
  const Reconstruction found = begin_reconstruction(command.spec, place.path(), warn);
  if (!found.has_signal) return end_without_signal(found, folder, command.force);
  const Experiment experiment = load_experiment(place.path() + "/experiment.yaml");
  return execute_run(folder, command.common, command.force, [&](RunOptions options) {
    options.files = found.files;
    return start_run(experiment, options);
  });
}

}  // namespace

void add_reconstruct(CLI::App& app, Action& action) {
  auto command = std::make_shared<ReconstructCommand>();
  CLI::App* sub = app.add_subcommand("reconstruct", "Find the hidden surface behind a capture's photon counts");
  sub->add_option("capture", command->spec.capture, "photon counts of a wall's points")
      ->required()
      ->type_name("CAPTURE.h5");
  sub->add_option("-o,--output", command->common.output, "output folder; default runs/NAME-OF-THE-FILE")
      ->type_name("DIR");
  sub->add_option("--response", command->spec.response,
                  "table of the detector's response: offsets in ps, values; without one light is counted as it arrives")
      ->type_name("IRF.csv");
  sub->add_option("--seconds", command->spec.seconds,
                  "what the fit may take on two cores: more for less noise (default 300)")
      ->check(CLI::Range(1.0, 1e6))
      ->type_name("N");
  sub->add_option("--seed", command->spec.seed, "seed of the random numbers")->type_name("N");
  sub->add_flag("--force", command->force,
                "overwrite the run that the folder holds (else it is moved to DIR.1, DIR.2, ...)");
  add_session_options(*sub, command->common);
  sub->footer(
      "Examples:\n"
      "  isochron reconstruct capture.h5\n"
      "  isochron reconstruct capture.h5 --response response.csv -o runs/mine --seconds 60");
  sub->callback([&action, command] { action = [command] { return reconstruct(*command); }; });
}

}  // namespace isochron
