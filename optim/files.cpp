#include "optim/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "core/math/error.h"

namespace isochron {
namespace {

[[noreturn]] void fail(const std::string& what, const std::string& file) {
  throw std::runtime_error(fmt::format("{}: {}: {}", file, what, std::strerror(errno)));
}

/// Closes on every way out.
struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) close(fd);
  }
};

void sync_folder(const std::string& folder) {
  const Descriptor file{open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  if (file.fd < 0 || fsync(file.fd) != 0) fail("cannot flush", folder);
}

}  // namespace

void write_file_atomically(const std::string& file, const std::string& text) {
  const std::string temporary = file + ".tmp";
  {
    const Descriptor out{open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)};
    if (out.fd < 0) fail("cannot write", temporary);
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t n = write(out.fd, text.data() + done, text.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) fail("cannot write", temporary);
      done += static_cast<std::size_t>(n);
    }
    if (fsync(out.fd) != 0) fail("cannot flush", temporary);
  }
  if (rename(temporary.c_str(), file.c_str()) != 0) fail("cannot rename", temporary);
  const std::string folder = std::filesystem::path(file).parent_path().string();
  sync_folder(folder.empty() ? "." : folder);
}

std::optional<std::string> read_file(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  std::ostringstream text;
  text << in.rdbuf();
  if (in.bad()) return std::nullopt;
  return text.str();
}

void make_output_folder(const std::string& folder) {
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

std::string exact(double value) {
  return fmt::format("{}", value);
}

}  // namespace isochron
