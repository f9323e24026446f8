// Small helpers for files that must survive a kill at any moment, and for numbers written without loss.
#pragma once
#include <optional>
#include <string>

namespace isochron {

/// Replaces `file` by `text` so that a reader sees the old text or the new one, also after a crash: temporary
/// file, fsync, rename, fsync of the folder. Throws std::runtime_error.
void write_file_atomically(const std::string& file, const std::string& text);

/// Whole content of a file; empty when it cannot be read.
std::optional<std::string> read_file(const std::string& file);

/// Makes the folder (and its parents) and checks that files can be made in it. Throws InputError.
void make_output_folder(const std::string& folder);

/// Shortest decimal text that reads back as the same double; `nan`, `inf`, `-inf` for those.
std::string exact(double value);

}  // namespace isochron
