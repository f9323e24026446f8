// Sums over many degrees of freedom, of which a pass may touch few.
#pragma once
#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/ranks.h"

namespace isochron {

/// A long vector of sums that start at zero. Memory is cleared in blocks on first use: untouched ones cost nothing.
class SparseSum {
 public:
  SparseSum() = default;
  explicit SparseSum(std::size_t size)
      : values_(std::make_unique_for_overwrite<double[]>((size + kBlock - 1) / kBlock * kBlock)),
        touched_((size + kBlock - 1) / kBlock, 0) {}

  void add(std::size_t i, double value) {
    touch(i / kBlock);
    values_[i] += value;
  }
  /// The sums i ... i + count - 1, to be added to; count is at most 64.
  double* at(std::size_t i, int count) {
    touch(i / kBlock);
    touch((i + count - 1) / kBlock);
    return &values_[i];
  }

  /// Adds another vector of the same size.
  void add(const SparseSum& other) {
    for (std::size_t block = 0; block < touched_.size(); ++block) {
      if (!other.touched_[block]) continue;
      touch(block);
      for (std::size_t i = block * kBlock; i < (block + 1) * kBlock; ++i) values_[i] += other.values_[i];
    }
  }

  /// f(i, value) for the sums of all touched blocks in [begin, end), in order.
  template <class F>
  void for_each(std::size_t begin, std::size_t end, F&& f) const {
    for (std::size_t block = begin / kBlock; block * kBlock < end && block < touched_.size(); ++block)
      if (touched_[block])
        for (std::size_t i = std::max(begin, block * kBlock); i < std::min(end, (block + 1) * kBlock); ++i)
          f(i, values_[i]);
  }

  /// Only touched blocks.
  void pack(Packer& packer) const {
    packer.put(touched_);
    for (std::size_t block = 0; block < touched_.size(); ++block)
      if (touched_[block]) packer.put(&values_[block * kBlock], kBlock);
  }
  void unpack(Unpacker& unpacker) {
    std::vector<std::uint8_t> touched;
    unpacker.get(touched);
    *this = SparseSum(touched.size() * kBlock);
    touched_ = std::move(touched);
    for (std::size_t block = 0; block < touched_.size(); ++block)
      if (touched_[block]) unpacker.get(&values_[block * kBlock], kBlock);
  }

 private:
  static constexpr std::size_t kBlock = 64;

  void touch(std::size_t block) {
    if (touched_[block]) return;
    std::fill_n(&values_[block * kBlock], kBlock, 0.0);
    touched_[block] = 1;
  }

  std::unique_ptr<double[]> values_;
  std::vector<std::uint8_t> touched_;  ///< per block
};

}  // namespace isochron
