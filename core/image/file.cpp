#include "core/image/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "core/math/error.h"

namespace isochron {
namespace {

/// Opens a file that did not exist before, in the folder of `path`.
int create_beside(const std::string& path, std::string& name) {
  static std::atomic<unsigned> counter{0};
  int descriptor = -1;
  do {
    name = fmt::format("{}.{}-{}.tmp", path, ::getpid(), counter++);
    descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor < 0 && errno == EEXIST);
  return descriptor;
}

/// 0, or the errno of what failed.
int write_all(int descriptor, const std::string& contents) {
  for (std::size_t done = 0; done < contents.size();) {
    const ssize_t written = ::write(descriptor, contents.data() + done, contents.size() - done);
    if (written < 0 && errno != EINTR) return errno;
    if (written > 0) done += static_cast<std::size_t>(written);
  }
  return ::fsync(descriptor) == 0 ? 0 : errno;
}

/// Makes the rename itself durable. Not every file system can; the file is whole either way.
void flush_folder(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

void write_file_atomically(const std::string& path, const std::string& contents) {
  const auto failure = [&](int error) {
    return InputError(fmt::format("{}: cannot be written: {}", path, std::strerror(error)));
  };
  std::string temporary;
  const int descriptor = create_beside(path, temporary);
  if (descriptor < 0) throw failure(errno);
  int error = write_all(descriptor, contents);
  if (::close(descriptor) != 0 && error == 0) error = errno;
  if (error == 0 && std::rename(temporary.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    throw failure(error);
  }
  flush_folder(path);
}

}  // namespace isochron
