// Blocks of an EXR file of which most values are zero, such as those of many narrow gates: compressed in a time that goes with
// the values that are not.
#pragma once
#include <cstdint>
#include <span>
#include <string>

namespace isochron {

struct SparseValue {
  std::uint32_t place;  ///< among the values of the block
  float value;
};

/// What ZIP_COMPRESSION of OpenEXR makes of a block of `size` 32-bit floats, at least one, that are zero but for `values`, which
/// are sorted by their places: bytes that any reader inflates, as OpenEXR's own, though not the same.
std::string compressed_block(std::size_t size, std::span<const SparseValue> values);
/// The block as it is: for values that compression makes larger.
std::string plain_block(std::size_t size, std::span<const SparseValue> values);

}  // namespace isochron
