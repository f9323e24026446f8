// Runs in levels (ParameterSpec::remesh): each is an ordinary run on a mesh that stands, begun with what the one before found,
// its surface in new triangles, those of coarse levels as long as before, others half as long (next_level.h).
//
//   DIR/experiment.yaml, inputs/, target.exr    of all levels; the target is rendered from the mesh as loaded
//   DIR/geometry/target_SHAPE                   that mesh at the target values, where they are known
//   DIR/levels/K/                               an ordinary run: experiment.yaml, checkpoint, log.csv, final.exr, ...
//   DIR/levels/K/scene/                         its scene, and surface.ply, where its mesh is another than the loaded one
//   DIR/initial.exr, geometry/initial_SHAPE     of the first level
//   DIR/final.exr, final.h5, geometry/final_SHAPE  of the last level that has ended
//   DIR/log.csv                                 of all levels that have ended, iterations and seconds counted through
//   DIR/summary.yaml                            of that level, and `levels`, a line for each, also of one under way
//
// A level is made only from files of the one before, its experiment.yaml last. So a run that was killed, within a level or between
// two, continues where it was, to the same bits.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "optim/problem/problem.h"
#include "optim/run/next_level.h"
#include "optim/run/run.h"

namespace isochron {

/// Where the experiment asks for levels, throws InputError unless all of them can be made.
void require_levels(const Problem& problem);

/// Of a run's folder: that of the last level there is, or itself where there is none.
std::string last_level_folder(const std::string& folder);

/// Begins or continues. `run_level` runs what its options' folder holds.
RunStatus run_levels(const Experiment& experiment, const RunOptions& options,
                     const std::function<RunStatus(const RunOptions&)>& run_level);

}  // namespace isochron
