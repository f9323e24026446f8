// Arrays in NumPy's file format, .npy.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace isochron {

struct NumberArray {
  std::vector<std::size_t> shape;
  std::vector<double> values;  ///< the last index fastest, whatever the file's order
};

/// Reads booleans, integers and floats of little-endian files (versions 1 to 3 of the format). Throws InputError naming the
/// file and what is amiss.
NumberArray read_npy(const std::string& file);

/// The contents of a file [columns, rows] of bytes, which are given row by row: what masks of pixels are.
std::string npy_of_pixels(int columns, int rows, const std::vector<std::uint8_t>& values);

}  // namespace isochron
