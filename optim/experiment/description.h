// Descriptions of an experiment file's keys, see core/base/description.h.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/description.h"
#include "optim/experiment/experiment.h"

namespace isochron {

/// Where the file lies that is read or written: the paths in it are relative to there.
struct ExperimentFolder {
  std::filesystem::path path;
  std::vector<std::string> number_files = {};  ///< absolute paths of those that were read

  /// An existing file; the variable is its absolute path.
  Field file(std::string& variable) const;
  /// A number, a list of them, or a text file of them.
  Field values(std::vector<double>& variable);
  /// Rows of a text file of numbers, see read_number_file.
  std::vector<std::vector<double>> read_numbers(const YamlValue& value, int columns = 0);
};

/// Names that become names of files and columns.
Field file_name(std::string& variable);

void describe(Keys& keys, GateSpec& gates, ExperimentFolder& folder);
/// `target_required`: whether there is no target without the parameter's.
void describe(Keys& keys, ParameterSpec& parameter, ExperimentFolder& folder, bool target_required);
/// A target's max_bounces below 0 stands for the experiment's.
void describe(Keys& keys, Experiment& experiment, ExperimentFolder& folder);

}  // namespace isochron
