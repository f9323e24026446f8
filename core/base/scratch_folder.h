#pragma once
#include <stdlib.h>

#include <filesystem>
#include <string>

#include "core/base/error.h"

namespace isochron {

/// A new folder where the system keeps such, gone with all that is in it when this is. Throws InputError where none can be made.
class ScratchFolder {
 public:
  ScratchFolder() : path_((std::filesystem::temp_directory_path() / "isochron-XXXXXX").string()) {
    if (!::mkdtemp(path_.data())) throw InputError(path_ + ": cannot be made");
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace isochron
