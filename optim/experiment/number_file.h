#pragma once
#include <string>
#include <vector>

namespace isochron {

/// Numbers of a text file, row by row: separated by spaces, tabs or commas; `#` starts a comment; empty rows
/// are skipped. With columns > 0 every row must have that many. Throws InputError (`file:line:column: ...`).
std::vector<std::vector<double>> read_number_file(const std::string& file, int columns = 0);

}  // namespace isochron
