#pragma once
#include <string>
#include <vector>

namespace isochron {

/// Numbers of a text file, row by row: separated by spaces, tabs or commas; `#` starts a comment; empty rows
/// are skipped. With names of columns every row must have a number for each, and the first row may be the names. Of a NumPy
/// array, a file NAME.npy, the rows are its first index; without columns all of it is one row, the last index fastest. Throws
/// InputError (`file:line:column: ...`, of arrays `file: ...`).
std::vector<std::vector<double>> read_number_file(const std::string& file,
                                                  const std::vector<std::string>& columns = {});

}  // namespace isochron
