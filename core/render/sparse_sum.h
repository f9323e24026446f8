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

  /// sum[i] += (parts[0][i] + parts[1][i] + ...), in that order, with parts of the size of `sum`.
  friend void merge(const std::vector<SparseSum>& parts, std::span<double> sum) {
    constexpr std::size_t kChunk = 256;  // blocks
    const std::size_t blocks = (sum.size() + kBlock - 1) / kBlock;
    parallel(static_cast<int>((blocks + kChunk - 1) / kChunk), [&](int chunk) {
      const std::size_t first = chunk * kChunk, last = std::min(blocks, first + kChunk);
      for (std::size_t block = first; block < last; ++block) {
        double total[kBlock] = {};
        bool touched = false;
        for (const SparseSum& part : parts) {
          if (!part.touched_[block]) continue;
          touched = true;
          for (std::size_t i = 0; i < kBlock; ++i) total[i] += part.values_[block * kBlock + i];
        }
        if (!touched) continue;
        const std::size_t begin = block * kBlock, count = std::min(kBlock, sum.size() - begin);
        for (std::size_t i = 0; i < count; ++i) sum[begin + i] += total[i];
      }
    });
  }

 private:
  static constexpr std::size_t kBlock = 64;
  std::unique_ptr<double[]> values_;
  std::vector<std::uint8_t> touched_;  ///< per block
};

}  // namespace isochron
