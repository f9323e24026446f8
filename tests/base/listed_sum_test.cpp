#include "core/base/listed_sum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/random.h"

namespace isochron {
namespace {

constexpr std::size_t kSize = 400'000;  // more than are kept as all from the start

/// Adds numbers of many magnitudes, so that another order of additions would have other bits, to runs of a few sums; of `spread`
/// sums, so that some are met often.
template <class Sum>
void fill(Sum& sum, std::size_t size, int additions, std::size_t spread, std::uint32_t part) {
  Rng rng(Stream{.seed = 9}, size, part);
  for (int i = 0; i < additions; ++i) {
    const int count = std::min(1 + i % 3, static_cast<int>(size));
    const std::size_t at = static_cast<std::size_t>(rng.uniform() * static_cast<double>(spread)) * (size / spread);
    double* const values = sum.at(std::min(at, size - count), count);
    for (int k = 0; k < count; ++k) values[k] += (rng.uniform() - 0.3) * std::pow(10.0, 12 * rng.uniform());
  }
}

template <class Sum>
std::vector<double> values_of(const Sum& sum, std::size_t size) {
  std::vector<double> values(size, 0.0);
  sum.for_each(0, size, [&](std::size_t i, double value) { values[i] += value; });
  return values;
}

struct ListCase {
  std::size_t size;
  int additions;
  std::size_t spread;
};

// The bits of a vector of all sums, whether few are listed, many (1500 additions and more are sorted on the way), or all kept.
TEST(ListedSum, HasTheBitsOfAVectorOfAll) {
  for (const ListCase& c :
       {ListCase{1, 5, 1}, ListCase{1000, 50, 100}, ListCase{kSize, 0, 1}, ListCase{kSize, 20, 7},
        ListCase{kSize, 5000, 300}, ListCase{kSize, 30'000, 100'000}, ListCase{kSize, 400'000, 200'000}}) {
    ListedSum listed(c.size);
    SparseSum all(c.size);
    listed.finish();
    for (std::uint32_t part = 0; part < 3; ++part) {
      // Unequal parts: lists are added to all and all to lists.
      const int additions = part == 1 ? c.additions / 10 : c.additions;
      ListedSum more(c.size);
      SparseSum more_of_all(c.size);
      fill(more, c.size, additions, c.spread, part);
      fill(more_of_all, c.size, additions, c.spread, part);
      more.finish();
      listed.add(more);
      all.add(more_of_all);
    }
    EXPECT_EQ(values_of(listed, c.size), values_of(all, c.size)) << c.size << ", " << c.additions;
    Packer packer;
    listed.pack(packer);
    ListedSum copy;
    Unpacker unpacker(packer.bytes);
    copy.unpack(unpacker);
    EXPECT_EQ(values_of(copy, c.size), values_of(all, c.size)) << c.size << ", " << c.additions;
  }
}

TEST(ListedSum, TakesTheMemoryOfWhatIsTouched) {
  ListedSum few(kSize), many(kSize);
  fill(few, kSize, 1000, 1000, 0);
  fill(many, kSize, 400'000, 200'000, 0);
  few.finish();
  many.finish();
  EXPECT_LE(few.bytes(), std::size_t{16} * 3 * 1000);
  EXPECT_EQ(many.bytes(), sizeof(double) * kSize);
}

TEST(ListedSum, GoesThroughARangeInOrder) {
  ListedSum sum(kSize);
  for (const std::size_t i : {300'000u, 5u, 77u, 6u}) *sum.at(i, 1) += static_cast<double>(i);
  sum.finish();
  std::string found;
  sum.for_each(6, 300'000, [&](std::size_t i, double value) {
    EXPECT_EQ(value, static_cast<double>(i));
    found += std::to_string(i) + " ";
  });
  EXPECT_EQ(found, "6 77 ");
}

}  // namespace
}  // namespace isochron
