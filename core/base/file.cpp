#include "core/base/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "core/base/error.h"
#include "core/base/ranks.h"

namespace isochron {
namespace {

/// Opens a file that did not exist before, in the folder of `path`, and locks it.
int create_beside(const std::string& path, std::string& name) {
  static std::atomic<unsigned> counter{0};
  int descriptor = -1;
  do {
    name = fmt::format("{}.{}-{}.tmp", path, ::getpid(), counter++);
    descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor < 0 && errno == EEXIST);
  if (descriptor >= 0) ::flock(descriptor, LOCK_EX | LOCK_NB);  // held until it is closed, see is_abandoned
  return descriptor;
}

/// Whether create_beside made the name.
bool is_temporary(std::string_view name) {
  const auto ends_with = [&](std::string_view end) {
    const bool does = name.ends_with(end);
    if (does) name.remove_suffix(end.size());
    return does;
  };
  const auto ends_with_number = [&] {
    const std::size_t digits = name.size() - (name.find_last_not_of("0123456789") + 1);
    name.remove_suffix(digits);
    return digits > 0;
  };
  return ends_with(".tmp") && ends_with_number() && ends_with("-") && ends_with_number() && ends_with(".");
}

/// Whether the process that wrote a file of create_beside has ended, which released its lock.
bool is_abandoned(const std::string& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool abandoned = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
  ::close(descriptor);
  return abandoned;
}

/// The file that a symbolic link stands for, whether it is there or not; any other path as it is.
std::string target_of(const std::string& path) {
  constexpr int kMostLinks = 40;  // as the system's own limit
  std::filesystem::path target = path;
  std::error_code error;
  for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(target, error); ++i)
    target = target.parent_path() / std::filesystem::read_symlink(target, error);
  return target.string();
}

/// 0, or the errno of what failed.
int write_all(int descriptor, std::string_view contents) {
  for (std::size_t done = 0; done < contents.size();) {
    const ssize_t written = ::write(descriptor, contents.data() + done, contents.size() - done);
    if (written < 0 && errno != EINTR) return errno;
    if (written > 0) done += static_cast<std::size_t>(written);
  }
  return 0;
}

/// Makes the rename itself durable. Not every file system can; the file is whole either way.
void flush_folder(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

/// The path is at fault, as given by the user, rather than a device that is full or broken.
bool is_fault_of_path(int error) {
  constexpr int kFaults[] = {EACCES, EPERM,        EROFS,  ENOENT, ENOTDIR, EISDIR,
                             ELOOP,  ENAMETOOLONG, EINVAL, EEXIST, EBUSY,   ENOTEMPTY};
  return std::find(std::begin(kFaults), std::end(kFaults), error) != std::end(kFaults);
}

[[noreturn]] void fail_to_write(const std::string& path, int error) {
  const std::string message = fmt::format("{}: cannot be written: {}", path, std::strerror(error));
  if (is_fault_of_path(error)) throw InputError(message);
  throw std::runtime_error(message);
}

/// A descriptor of a regular file, or -1 with the reason in `problem`; its size in `size`.
int open_regular_file(const std::string& path, std::size_t& size, std::string& problem) {
  // Without O_NONBLOCK, opening a named pipe would wait for a writer.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) {
    problem = fmt::format("cannot be opened: {}", std::strerror(errno));
    return -1;
  }
  struct stat status = {};
  problem.clear();
  if (::fstat(descriptor, &status) != 0) {
    problem = fmt::format("cannot be read: {}", std::strerror(errno));
  } else if (S_ISDIR(status.st_mode)) {
    problem = "is a folder";
  } else if (!S_ISREG(status.st_mode)) {
    problem = "is a pipe or a device, not a regular file";
  }
  size = static_cast<std::size_t>(status.st_size);
  if (problem.empty()) return descriptor;
  ::close(descriptor);
  return -1;
}

std::optional<std::string> read_here(const std::string& path, std::string& problem) {
  std::string contents;
  std::size_t size = 0;
  const int descriptor = open_regular_file(path, size, problem);
  if (descriptor < 0) return std::nullopt;
  contents.resize(size);
  std::size_t done = 0;
  for (;;) {  // the file may be longer than it was, or be one of /proc, which have no size
    if (done == contents.size()) contents.resize(done + (1 << 16));
    const ssize_t n = ::read(descriptor, contents.data() + done, contents.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) problem = fmt::format("cannot be read: {}", std::strerror(errno));
    if (n <= 0) break;
    done += static_cast<std::size_t>(n);
  }
  contents.resize(done);
  ::close(descriptor);
  if (!problem.empty()) return std::nullopt;
  return contents;
}

}  // namespace

NewFile::NewFile(const std::string& path) : path_(target_of(path)) {}

NewFile::~NewFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void NewFile::fail(int error) {
  error_ = error;
  fail_to_write(path_, error);
}

void NewFile::flush() {
  if (error_ != 0) fail(error_);
  // Not before there is much to write, so that a process that is killed rarely leaves a part of a file.
  if (descriptor_ < 0 && (descriptor_ = create_beside(path_, temporary_)) < 0) fail(errno);
  if (const int error = write_all(descriptor_, buffer_); error != 0) fail(error);
  written_ += buffer_.size();
  buffer_.clear();
}

void NewFile::write(std::string_view bytes) {
  constexpr std::size_t kBuffer = 1 << 20;
  if (buffer_.size() + bytes.size() > kBuffer) flush();
  if (bytes.size() <= kBuffer) {
    buffer_ += bytes;
    return;
  }
  if (const int error = write_all(descriptor_, bytes); error != 0) fail(error);
  written_ += bytes.size();
}

void NewFile::seek(std::uint64_t position) {
  flush();
  if (::lseek(descriptor_, static_cast<off_t>(position), SEEK_SET) < 0) fail(errno);
  written_ = position;
}

void NewFile::finish() {
  flush();
  struct stat before {};
  if (::stat(path_.c_str(), &before) == 0) ::fchmod(descriptor_, before.st_mode & 0777);
  int error = ::fsync(descriptor_) == 0 ? 0 : errno;
  if (::close(std::exchange(descriptor_, -1)) != 0 && error == 0) error = errno;
  if (error == 0 && std::rename(temporary_.c_str(), path_.c_str()) != 0) error = errno;
  if (error != 0) fail(error);
  temporary_.clear();
  flush_folder(path_);
}

void write_file_atomically(const std::string& path, const std::string& contents) {
  on_first_rank([&] {
    NewFile file(path);
    file.write(contents);
    file.finish();
  });
}

void remove_temporaries(const std::string& folder) {
  std::error_code error;
  for (std::filesystem::directory_iterator file(folder, error), end; !error && file != end; file.increment(error))
    if (is_temporary(file->path().filename().string()) && is_abandoned(file->path().string())) {
      std::error_code ignored;
      std::filesystem::remove(*file, ignored);
    }
}

std::optional<std::string> read_regular_file(const std::string& path, std::string& problem) {
  if (rank_count() == 1) return read_here(path, problem);
  constexpr char kRead = 'r', kProblem = 'p';
  std::string answer = from_first_rank([&] {
    const std::optional<std::string> contents = read_here(path, problem);
    return contents ? kRead + *contents : kProblem + problem;
  });
  const bool read = answer[0] == kRead;
  answer.erase(0, 1);
  problem = read ? "" : answer;
  if (!read) return std::nullopt;
  return answer;
}

bool is_regular_file(const std::string& path, std::string& problem) {
  std::size_t size = 0;
  const int descriptor = open_regular_file(path, size, problem);
  if (descriptor >= 0) ::close(descriptor);
  return descriptor >= 0;
}

bool file_exists(const std::string& path) {
  return !from_first_rank([&]() -> std::string { return std::filesystem::exists(path) ? "yes" : ""; }).empty();
}

std::string checksum(std::string_view contents) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const unsigned char c : contents) hash = (hash ^ c) * 0x100000001b3u;
  return fmt::format("{:016x}", hash);
}

}  // namespace isochron
