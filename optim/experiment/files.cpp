#include "optim/experiment/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/ranks.h"

namespace isochron {
namespace {

void make_folder_here(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!std::filesystem::is_directory(folder))
    throw InputError(fmt::format("output folder {}: cannot be made: {}", folder, error.message()));
  const std::string probe = folder + "/.isochron.tmp";
  const int fd = open(probe.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (fd < 0) throw InputError(fmt::format("output folder {}: cannot be written: {}", folder, std::strerror(errno)));
  close(fd);
  std::filesystem::remove(probe, error);
}

}  // namespace

std::optional<std::string> read_file(const std::string& file) {
  std::string problem;
  return read_regular_file(file, problem);
}

void make_output_folder(const std::string& folder) {
  on_first_rank([&] { make_folder_here(folder); });
}

std::string exact(double value) {
  return fmt::format("{}", value);
}

}  // namespace isochron
