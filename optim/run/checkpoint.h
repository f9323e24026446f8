// The optimiser's state on disk. DIR/checkpoint.yaml is the latest, DIR/checkpoint.previous.yaml the one
// before; a kill at any moment leaves at least one of them whole once the first was written.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "optim/problem/parameters.h"
#include "optim/solvers/descent.h"
#include "optim/solvers/optimizer.h"
#include "optim/solvers/safeguard.h"

namespace isochron {

/// Of the file's keys and what they mean: to be raised with any change of them. The program's version, which the file
/// also has, is for the reader of it.
inline constexpr int kCheckpointSchema = 6;

struct Checkpoint {
  int iteration = 0;   ///< iterations done; the next row of the log has this number
  double seconds = 0;  ///< spent on them
  std::vector<double> theta;
  OptimizerState optimizer;  ///< empty before the first iteration
  SafeguardState safeguard;
  DescentState descent;
  int steps_rejected = 0, steps_rejected_in_row = 0;  ///< by the optimiser itself, see Optimizer::rejected()
  /// Of iteration 0, for the summary; NaN before it.
  double loss_initial, loss_noise_initial, image_rmse_initial, param_rmse_initial;
  Checkpoint();
};

/// Doubles are written with all their digits, a checksum of the text comes last. Throws std::runtime_error.
void save_checkpoint(const std::string& folder, const Checkpoint& checkpoint, const Parameters& parameters);

/// The latest checkpoint that is whole, or none when there is no checkpoint file. `warning` receives one line when the
/// latest was damaged (it is removed) and the one before is used, or when another version of the program wrote it. Throws
/// InputError when files exist but none can be used, or when one is of another schema or of other parameters.
std::optional<Checkpoint> load_checkpoint(const std::string& folder, const Parameters& parameters,
                                          std::string* warning);

}  // namespace isochron
