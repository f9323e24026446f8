// Parts of the reader of experiment files (experiment.cpp).
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/yaml_reader.h"
#include "optim/experiment/experiment.h"

namespace isochron {

/// Where paths start from, and the files of numbers that were read.
struct InputFolder {
  std::filesystem::path path;
  std::vector<std::string> number_files;
};

/// Absolute path of a file that the value names. Throws InputError where there is none.
std::string existing_file(const YamlValue& value, const InputFolder& folder);

/// Rows of a file of numbers that the value names, see read_number_file.
std::vector<std::vector<double>> read_numbers(const YamlValue& value, InputFolder& folder, int columns = 0);

/// The key `gates`, checked as far as can be without the scene.
GateSpec read_gates(const YamlValue& value, InputFolder& folder);

}  // namespace isochron
