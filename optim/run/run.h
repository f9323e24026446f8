// A run and its folder: the loop of loop.h with files. See checkpoint.h for what survives a kill, log.h for
// the rows of log.csv.
//
// Order of writing: inputs/ (see inputs.h), experiment.yaml, target.exr, then per iteration the log's row and the checkpoint (before
// them, in iteration 0, initial.exr), at last geometry/final_SHAPE, final.exr and summary.yaml. Every random number depends on
// (seed, iteration, pass) alone and the target is used as target.exr holds it (rounded to float), so a run
// that was killed anywhere and resumed gives the same bits.
#pragma once
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "optim/experiment/experiment.h"
#include "optim/problem/own_loss.h"
#include "optim/run/level_scatter.h"
#include "optim/run/log.h"
#include "optim/run/loop.h"

namespace isochron {

struct Progress {
  int iteration = 0, iterations = 0;
  double loss = 0;
  double param_rmse = 0;             ///< NaN where unknown
  double seconds_per_iteration = 0;  ///< average of this call
  double seconds_left = 0;           ///< of the level, where there are some
  int level = 0, levels = 0;         ///< 0: the run is not one in levels
};

struct RunOptions {
  std::string folder;
  bool force = false;  ///< overwrite a run that the folder holds (else it is moved aside)
  /// Name and contents of files that are put beside experiment.yaml as the run begins. What is in a `start.yaml` a summary of levels has,
  /// too.
  std::map<std::string, std::string> files;
  /// What is minimised in place of the experiment's loss, where there is one, and its name for messages. The experiment needs no
  /// target then. A run remembers that it had one: it is not resumed without.
  OwnLoss loss;
  std::string loss_name;
  std::function<void(const Progress&)> progress;  ///< after every row of the log
  /// The same with all that the row is about; `closing`: it is of final parameters that no iteration had. What it throws ends
  /// the run; Interrupted as a requested stop does.
  std::function<void(const LogRow&, const std::vector<double>& theta, const Evaluation& now, bool closing)> row;
  /// Whether standard errors of what was found are stated, and expected counts rendered until their noise does not decide the verdict; of
  /// a level that others follow they are not.
  bool errors = true;
  bool followed_unless_explained =
      false;  ///< another level follows, which states the errors, where the counts are not explained
  /// Gets the factors of evidence (evidence.h) where another level follows and samples of the posterior were made.
  std::function<void(std::vector<double>)> evidence;
  /// Their distances from what is found add to the errors of its vertices.
  EarlierSurfaces earlier;
  std::function<void(const std::string&)> warning;  ///< one line
  std::function<void(const std::string&)> report;   ///< at the end, text of run_report()
};

/// Optimises from the initial values. A stop that is requested (progress.h) leaves a checkpoint. Throws InputError, before any rendering, when
/// the experiment does not fit its scene, has no parameters, or the folder cannot be written or holds a run already.
RunStatus start_run(const Experiment& experiment, const RunOptions& options);

/// Goes on from the last checkpoint of options.folder, or from the start when there is none yet. Throws
/// InputError when the folder holds no run, or one whose loss was not the experiment's and options.loss is missing.
RunStatus resume_run(const RunOptions& options);

}  // namespace isochron
