#include "core/base/sparse_sum.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"

namespace isochron {
namespace {

// Against a plain vector; sizes about a multiple of the blocks, entries that lie in few of them and in all.
TEST(SparseSum, AddsLikeAVector) {
  for (const std::size_t size : {1u, 63u, 64u, 65u, 40000u})
    for (const int additions : {0, 3, 5000}) {
      Rng rng(Stream{.seed = 5}, size, static_cast<std::uint32_t>(additions));
      SparseSum whole(size);
      std::vector<double> expected(size, 1.0), sum = expected;
      for (int part = 0; part < 3; ++part) {
        SparseSum sparse(size);
        for (int i = 0; i < additions; ++i) {
          const auto at = static_cast<std::size_t>(rng.uniform() * static_cast<double>(size));
          const double value = std::round(1000 * rng.uniform());  // sums are exact
          sparse.add(at, value);
          expected[at] += value;
        }
        whole.add(sparse);
      }
      whole.for_each(0, size, [&](std::size_t i, double value) { sum[i] += value; });
      EXPECT_EQ(sum, expected) << size << ", " << additions;
    }
}

TEST(SparseSum, GivesNeighboursAcrossBlocks) {
  SparseSum sum(200);
  for (int i = 0; i < 3; ++i) sum.at(62, 3)[i] += i + 1;
  sum.add(64, 10);
  std::vector<double> found(200, 0.0), expected(200, 0.0);
  sum.for_each(0, 200, [&](std::size_t i, double value) { found[i] = value; });
  expected[62] = 1, expected[63] = 2, expected[64] = 13;
  EXPECT_EQ(found, expected);
}

}  // namespace
}  // namespace isochron
