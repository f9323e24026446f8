// Documents behind the checked reading of YAML (yaml_reader.h): parsed, and changed by overrides.
#pragma once
#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

namespace isochron {

/// Kind and content of a node, for messages.
std::string describe(const YAML::Node& node);
/// Control characters as blanks.
std::string one_line(std::string text);
/// `source`:LINE:COLUMN of a mark, counted from one.
std::string place(const std::string& source, const YAML::Mark& mark);

/// Throws InputError where the file cannot be read.
std::string read_yaml_text(const std::string& file);

/// The only document in `text`. Not by YAML::LoadAll, which finds empty documents without end before some
/// characters. Throws InputError, which names `source`.
YAML::Node parse_document(const std::string& source, const std::string& text);

/// Puts an override's value into the tree and adds its path to `overridden`. Sections on the way that the
/// file leaves out are made, and added too.
void apply_override(YAML::Node node, const std::string& text, std::vector<std::string>& overridden);

}  // namespace isochron
