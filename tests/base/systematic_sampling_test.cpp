#include "core/base/systematic_sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/random.h"

namespace isochron {
namespace {

struct Entry {
  int id;
  double weight, inverse_probability;
};

/// Weights over many orders of magnitude.
std::vector<Entry> entries(int n, int set) {
  Rng rng(Stream{11, 0, 0}, static_cast<std::uint64_t>(set), 0);
  std::vector<Entry> result;
  for (int i = 0; i < n; ++i) result.push_back({i, std::exp(4 * set * (rng.uniform() - 0.5)), 1.0 + i % 3});
  return result;
}

// Over evenly spaced numbers u an entry of probability p is kept in a part of them that is off by one number at most, so
// that the mean of the inverse probability is known to 1 / (p numbers).
TEST(SystematicSampling, KeepsEachAsOftenAsItsInverseProbabilitySays) {
  constexpr int kNumbers = 1 << 14;
  for (const int n : {2, 7, 40})
    for (int set = 0; set < 4; ++set)
      for (const int kept : {1, 3, 16}) {
        if (kept >= n) continue;
        const std::vector<Entry> all = entries(n, set);
        std::vector<double> mean(all.size()), inverse(all.size());
        double heaviest_left_out = 0, lightest_certain = 1e300;
        for (int k = 0; k < kNumbers; ++k) {
          std::vector<Entry> some = all;
          const int count = sample_systematically(some.data(), n, kept, (k + 0.5) / kNumbers);
          ASSERT_GE(count, 1);
          ASSERT_LE(std::abs(count - kept), 1);
          for (int i = 0; i < count; ++i) {
            const auto id = static_cast<std::size_t>(some[i].id);
            const double factor = some[i].inverse_probability / all[id].inverse_probability;
            ASSERT_GE(factor, 1);
            ASSERT_NEAR(some[i].weight, all[id].weight * factor, 1e-12 * some[i].weight);
            inverse[id] = factor;
            mean[id] += factor / kNumbers;
          }
        }
        for (std::size_t i = 0; i < all.size(); ++i) {
          if (inverse[i] == 0) continue;  // too light for so few numbers
          EXPECT_NEAR(mean[i], 1, 1.01 * inverse[i] / kNumbers + 1e-9) << n << " entries, " << kept << " kept, " << i;
          if (inverse[i] == 1)
            lightest_certain = std::min(lightest_certain, all[i].weight);
          else
            heaviest_left_out = std::max(heaviest_left_out, all[i].weight);
        }
        EXPECT_LE(heaviest_left_out, lightest_certain);
      }
}

}  // namespace
}  // namespace isochron
