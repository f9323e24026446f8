#pragma once
#include <string>

namespace isochron {

/// Writes a whole file or nothing: to a temporary file beside it, which is flushed to the disk and then
/// renamed. A reader, or a run after a crash, sees the old contents or the new. Throws InputError with path
/// and reason, and leaves no temporary file behind.
void write_file_atomically(const std::string& path, const std::string& contents);

}  // namespace isochron
