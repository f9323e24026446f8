// Which experiment is meant, and with what changes: of the command line and of Python alike.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "optim/experiment/experiment.h"
#include "optim/problem/parameters.h"

namespace isochron {

struct ExperimentSource {
  std::string file;
  std::vector<std::string> set;  ///< KEY.PATH=VALUE, see load_experiment
  std::optional<int> samples;    ///< per pixel, for every term that is not left out
  std::optional<std::uint64_t> seed;
};

/// Reads the experiment and makes the changes. `target_values`: see load_experiment. Throws InputError.
Experiment read_experiment(const ExperimentSource& source, bool target_values = true);

/// `output`, or where that is empty runs/NAME followed by `suffix`.
std::string output_folder(const std::string& output, const Experiment& experiment, const std::string& suffix = "");

/// Makes theta, one value per unknown of its `parameters`, the point to start from.
void start_at(const std::vector<double>& theta, const Parameters& parameters, Experiment& experiment);

}  // namespace isochron
