#pragma once
#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/base/error.h"

namespace isochron {

/// A new folder where the system keeps such, gone with all that is in it when this is. Throws InputError where none can be made.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_((std::filesystem::temp_directory_path() / "isochron-XXXXXX").string()) {
    if (!::mkdtemp(path_.data())) throw InputError(path_ + ": cannot be made");
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace isochron
