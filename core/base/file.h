#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace isochron {

// Files are those of rank 0 (ranks.h), which tells the others what it found.

/// Writes a whole file or nothing: to a temporary file beside it, which is flushed to the disk and then
/// renamed. A reader, or a run after a crash, sees the old contents or the new. Leaves no temporary file behind
/// where it fails, and throws with path and reason: InputError where the path is at fault (no such folder, no
/// permission, a folder of that name), else, as on a full disk, std::runtime_error.
void write_file_atomically(const std::string& path, const std::string& contents);

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
