#pragma once
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "core/base/scratch_folder.h"

namespace isochron {

/// A folder of its own for one test, removed at the end.
class TemporaryFolder : public ScratchFolder {
 public:
  std::string file(const std::string& name) const { return path() + "/" + name; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(file(name), std::ios::binary) << text;
    return file(name);
  }
  std::string read(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(file(name), std::ios::binary).rdbuf();
    return text.str();
  }
  bool has(const std::string& name) const { return std::filesystem::exists(file(name)); }
};

}  // namespace isochron
