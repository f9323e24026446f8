#include "app/package_folder.h"

#include <filesystem>

namespace isochron {

std::string package_folder() {
  std::error_code error;
  const std::filesystem::path beside = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  const std::filesystem::path built = beside / "python";
  if (std::filesystem::exists(built / "isochron", error)) return built;
  return (beside / ISOCHRON_PACKAGE_FROM_PROGRAM).lexically_normal();
}

}  // namespace isochron
