// Sums over many degrees of freedom, of which a pass may touch few.
#pragma once
#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/render/parallel.h"

namespace isochron {

/// A long vector of sums that start at zero. Memory is cleared in blocks on first use: untouched ones cost nothing.
class SparseSum {
 public:
  SparseSum() = default;
  explicit SparseSum(std::size_t size)
      : values_(std::make_unique_for_overwrite<double[]>((size + kBlock - 1) / kBlock * kBlock)),
        touched_((size + kBlock - 1) / kBlock, 0) {}

  void add(std::size_t i, double value) {
    const std::size_t block = i / kBlock;
    if (!touched_[block]) {
      std::fill_n(&values_[block * kBlock], kBlock, 0.0);
      touched_[block] = 1;
    }
    values_[i] += value;
  }

  /// sum[i] += parts[0][i] + parts[1][i] + ... in that order, with parts of the size of `sum`.
  friend void merge(const std::vector<SparseSum>& parts, std::span<double> sum) {
    constexpr std::size_t kChunk = 256;  // blocks
    const std::size_t blocks = (sum.size() + kBlock - 1) / kBlock;
    parallel(static_cast<int>((blocks + kChunk - 1) / kChunk), [&](int chunk) {
      const std::size_t first = chunk * kChunk, last = std::min(blocks, first + kChunk);
      for (const SparseSum& part : parts)
        for (std::size_t block = first; block < last; ++block) {
          if (!part.touched_[block]) continue;
          const std::size_t end = std::min(sum.size(), (block + 1) * kBlock);
          for (std::size_t i = block * kBlock; i < end; ++i) sum[i] += part.values_[i];
        }
    });
  }

 private:
  static constexpr std::size_t kBlock = 64;
  std::unique_ptr<double[]> values_;
  std::vector<std::uint8_t> touched_;  ///< per block
};

}  // namespace isochron
