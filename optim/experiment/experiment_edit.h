// Changes of single values in an experiment file that leave everything else as it is, comments included.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "optim/experiment/experiment.h"

namespace isochron {

/// A scalar to set: a key at the top (`max_bounces`), or one in a map at the top (`samples`, `primal`).
struct Edit {
  std::vector<std::string> key;
  std::string value;
};

/// The text with the edits made, line by line: existing values are replaced, comments behind them keep their
/// column where there is room, and missing keys are added to their map (in blocks after its last entry) or at
/// the end. Reads maps in blocks or in braces on one line. What it does not understand it may get wrong: see
/// edit_experiment.
std::string edited(std::string text, std::span<const Edit> edits);

/// What makes an experiment file that reads as `before` read as `after`.
std::vector<Edit> changes(const Experiment& before, const Experiment& after);

/// Edits the file so that it reads as `wanted`, atomically. Throws InputError and leaves the file alone where
/// the edited text does not.
void edit_experiment(const std::string& file, std::span<const Edit> edits, const Experiment& wanted);

}  // namespace isochron
