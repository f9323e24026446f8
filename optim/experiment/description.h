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
  /// A number, a list of them, or a file of them.
  Field values(std::vector<double>& variable);
  /// Rows of a file of numbers, see read_number_file.
  std::vector<std::vector<double>> read_numbers(const YamlValue& value, const std::vector<std::string>& columns = {});
};

/// Names that become names of files and columns.
Field file_name(std::string& variable);

/// Bins that were not given (GateSpec::needs_bins) are left to whoever sets them, who is to call check_gates.
void describe(Keys& keys, GateSpec& gates, ExperimentFolder& folder);
/// The least standard deviation of gates that are no Dirac gates, over the longest centre. Path lengths are sums of doubles, each rounded
/// to 1e-16 of itself, over thousands of segments at most: narrower gates see nothing but rounding, and in the end their peaks overflow.
inline constexpr double kLeastRelativeWidth = 1e-12;
/// Throws InputError at `value` where no gates can be made or double precision does not resolve them.
void check_gates(const GateSpec& gates, const YamlValue& value);
/// `target_required`: whether there is no target without the parameter's.
void describe(Keys& keys, ParameterSpec& parameter, ExperimentFolder& folder, bool target_required);
/// A target's max_bounces below 0 stands for the experiment's. `target_values`: whether parameters must have them where
/// the target is rendered.
void describe(Keys& keys, Experiment& experiment, ExperimentFolder& folder, bool target_values = true);

}  // namespace isochron
