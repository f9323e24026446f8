// Copies of what a run reads, in its folder DIR:
//   DIR/inputs/inputs.yaml      which files they are copies of, with checksums
//   DIR/inputs/experiment.yaml  the experiment as the user wrote it (what counts is DIR/experiment.yaml)
//   DIR/inputs/scene/           the scene file and its meshes
//   DIR/inputs/                 target images and mask, and files of numbers, whose values stand in DIR/experiment.yaml too
// So a run needs nothing outside its folder, which can be moved.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "core/scene/scene_copy.h"
#include "optim/experiment/experiment.h"

namespace isochron {

/// All files that the experiment was read from, with names below DIR/inputs. They are held in memory, target images
/// included: the folder may be the one they come from. Throws InputError.
std::vector<FileCopy> collect_inputs(const Experiment& experiment);

/// Writes the copies into `folder`/inputs and makes the experiment read them. Throws InputError where that folder holds
/// something else.
void write_inputs(const std::string& folder, const std::vector<FileCopy>& inputs, Experiment& experiment);

/// Throws InputError when a copy has changed since the run began. Where an original has, `warning` receives one line: the
/// run continues with the copies. Originals that are no longer there are passed over.
void check_inputs(const std::string& folder, const std::function<void(const std::string&)>& warning);

}  // namespace isochron
