#include <spdlog/spdlog.h>

#include <optional>

#include "app/commands.h"
#include "app/execute_run.h"
#include "optim/reconstruct/run_reconstruction.h"

namespace isochron {
namespace {

struct ReconstructCommand {
  CommonOptions common;
  ReconstructionSpec spec;
};

int reconstruct(const ReconstructCommand& command) {
  begin_session(command.common);
  const std::string folder = command.common.output.empty() ? default_folder(command.spec) : command.common.output;
  double photons_needed = 0;
  const auto start = [&](const RunOptions& options) {
    const ReconstructionResult result = run_reconstruction(command.spec, options);
    photons_needed = result.photons_needed;
    return result.status;
  };
  const std::optional<int> status = execute_run(folder, command.common, start);
  if (status) return *status;
  spdlog::error(
      "{}: no light of a hidden surface stands out of the background; the weakest detectable surface would "
      "send some {:.0f} photons to all points together",
      folder, photons_needed);
  return 1;
}

}  // namespace

void add_reconstruct(CLI::App& app, Action& action) {
  const auto [sub, command] =
      add_command(app, action, "reconstruct", "Find the hidden surface behind a capture's photon counts", reconstruct);
  sub->add_option("capture", command->spec.capture, "HDF5 file of photon counts at points of a wall")
      ->required()
      ->type_name("CAPTURE.h5");
  sub->add_option("-o,--output", command->common.output, "output folder; default runs/NAME-OF-THE-FILE")
      ->type_name("DIR");
  sub->add_option("--response", command->spec.response,
                  "table of the detector's response: offsets in ps, values; default: light is counted when it arrives")
      ->type_name("IRF.csv");
  sub->add_option("--seconds", command->spec.seconds,
                  "work of the fit, as much as two cores do in that time; more gives less noise (default 300)")
      ->check(number(kLeastSeconds, kMostSeconds))
      ->type_name("N");
  add_seed_option(*sub, command->spec.seed);
  add_force_option(*sub, command->common);
  add_session_options(*sub, command->common);
  sub->footer(
      "Examples:\n"
      "  isochron reconstruct capture.h5\n"
      "  isochron reconstruct capture.h5 --response response.csv -o runs/mine --seconds 60");
}

}  // namespace isochron
