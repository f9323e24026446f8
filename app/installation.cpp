#include "app/installation.h"

#include <filesystem>

namespace isochron {
namespace {

/// `folder`, seen from the program, if it holds `name`, as in a build folder; else `installed`, seen from the program.
std::string beside_program(const char* folder, const char* name, const char* installed) {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  if (std::filesystem::exists(program / folder / name, error)) return program / folder;
  return (program / installed).lexically_normal();
}

}  // namespace

std::string package_folder() {
  return beside_program("python", "isochron", ISOCHRON_PACKAGES_FROM_PROGRAM);
}

std::string mpi_module() {
  return beside_program(".", "isochron_mpi.so", ISOCHRON_MODULES_FROM_PROGRAM) + "/isochron_mpi.so";
}

}  // namespace isochron
