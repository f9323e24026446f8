// Small helpers for output folders and for numbers written without loss; files are written by core/base/file.h.
#pragma once
#include <optional>
#include <string>

#include "core/base/file.h"

namespace isochron {

/// Whole content of a file; empty when it cannot be read or is no regular file.
std::optional<std::string> read_file(const std::string& file);

/// Makes the folder (and its parents) and checks that files can be made in it. Throws InputError.
void make_output_folder(const std::string& folder);

/// Shortest decimal text that reads back as the same double; `nan`, `inf`, `-inf` for those.
std::string exact(double value);

}  // namespace isochron
