// Reconstructions from a capture to a run's folder.
#pragma once
#include <optional>

#include "optim/reconstruct/reconstruction.h"
#include "optim/run/run.h"

namespace isochron {

struct ReconstructionResult {
  std::optional<RunStatus> status;  ///< none: the capture has no signal, and the folder a summary alone that says so
  double photons_needed = 0;        ///< see Reconstruction
};

/// runs/NAME-OF-THE-FILE.
std::string default_folder(const ReconstructionSpec& spec);

/// Begins a reconstruction and runs it into options.folder, beside whose files it puts those of Reconstruction. Throws InputError.
ReconstructionResult run_reconstruction(const ReconstructionSpec& spec, RunOptions options);

}  // namespace isochron
