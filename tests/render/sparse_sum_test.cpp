#include "core/render/sparse_sum.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/math/random.h"

namespace isochron {
namespace {

// Against a plain vector; sizes about a multiple of the blocks, entries that lie in few of them and in all.
TEST(SparseSum, AddsLikeAVector) {
  for (const std::size_t size : {1u, 63u, 64u, 65u, 40000u})
    for (const int additions : {0, 3, 5000}) {
      Rng rng(Stream{.seed = 5}, size, static_cast<std::uint32_t>(additions));
      std::vector<SparseSum> parts;
      std::vector<double> expected(size, 1.0), sum = expected;
      for (int part = 0; part < 3; ++part) {
        SparseSum& sparse = parts.emplace_back(size);
        for (int i = 0; i < additions; ++i) {
          const auto at = static_cast<std::size_t>(rng.uniform() * static_cast<double>(size));
          const double value = std::round(1000 * rng.uniform());  // sums are exact
          sparse.add(at, value);
          expected[at] += value;
        }
      }
      merge(parts, sum);
      EXPECT_EQ(sum, expected) << size << ", " << additions;
    }
}

}  // namespace
}  // namespace isochron
