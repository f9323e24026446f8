#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace isochron {

// Files are those of rank 0 (ranks.h), which tells the others what it found.

/// Writes a whole file or nothing: to a temporary file beside it, which is flushed to the disk and then
/// renamed. A reader, or a run after a crash, sees the old contents or the new. A file that is replaced keeps its
/// permissions, and a symbolic link goes on to stand for it. Leaves no temporary file behind
/// where it fails, and throws with path and reason: InputError where the path is at fault (no such folder, no
/// permission, a folder of that name), else, as on a full disk, std::runtime_error.
void write_file_atomically(const std::string& path, const std::string& contents);

/// The same in parts, for contents too large to be held twice. Only on rank 0 (on_first_rank). Throws as above.
class NewFile {
 public:
  explicit NewFile(const std::string& path);
  /// Without finish() nothing is left of it.
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  /// Behind what was written last, or where seek() said.
  void write(std::string_view bytes);
  void seek(std::uint64_t position);
  std::uint64_t position() const { return written_ + buffer_.size(); }
  /// Also throws an error of an earlier write that a library between caught.
  void finish();

 private:
  void flush();
  [[noreturn]] void fail(int error);

  std::string path_, temporary_, buffer_;
  int descriptor_ = -1, error_ = 0;
  std::uint64_t written_ = 0;  ///< where the buffer begins in the file
};

/// Removes what NewFile left in a folder where its process was killed.
void remove_temporaries(const std::string& folder);

/// Contents of a file. Empty where it cannot be read, with the reason in `problem`, to be put behind its name. Never
/// waits: a named pipe or a device is refused.
std::optional<std::string> read_regular_file(const std::string& path, std::string& problem);

/// Whether this rank's `read_regular_file` would open it, for libraries that read files themselves; else the reason in `problem`.
bool is_regular_file(const std::string& path, std::string& problem);

/// Whether there is a file or a folder.
bool file_exists(const std::string& path);

/// FNV-1a, 64 bits, as 16 hexadecimal digits: tells files apart that were torn or edited, no protection against
/// intent.
std::string checksum(std::string_view contents);

}  // namespace isochron
