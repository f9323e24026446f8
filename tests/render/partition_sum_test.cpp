// Sums over partitions: the same bits for any number of threads, in the order of a binary tree, and how many there are.
#include "core/base/partition_sum.h"

#include <gtest/gtest.h>

#include <cmath>

namespace isochron {
namespace {

struct Number {
  double value = 0;
  void add(const Number& other) { value += other.value; }
  void pack(Packer& packer) const { packer.put(value); }
  void unpack(Unpacker& unpacker) { unpacker.get(value); }
};

double term(int i) {
  return std::sin(i + 1.0) * std::pow(10.0, i % 17);
}

double tree(int begin, int count) {
  return count == 1 ? term(begin) : tree(begin, count / 2) + tree(begin + count / 2, count / 2);
}

TEST(PartitionSum, AddsAlongATreeForAnyNumberOfThreads) {
  for (const int count : {1, 2, 64, 256})
    for (const int threads : {1, 2, 7}) {
      set_thread_count(threads);
      for (int repeat = 0; repeat < 20; ++repeat)
        ASSERT_EQ(sum_of_partitions<Number>(count, [](int i) { return Number{term(i)}; }).value, tree(0, count))
            << count << " " << threads;
    }
  set_thread_count(0);
}

TEST(PartitionSum, ManyPartitionsHoweverLargeTheSums) {
  EXPECT_EQ(partition_count(64 * 64 * 64, 64 * 64), 256);
  EXPECT_EQ(partition_count(64 * 64, 64 * 64), 64) << "a pass of one sample: 64 images of sums are 64 ns a pixel";
  // A Jacobian of 100 columns and 40 gates had eight, for eight threads at most.
  EXPECT_EQ(partition_count(64 * 64 * 4, std::size_t{64} * 64 * 4000), 32);
}

}  // namespace
}  // namespace isochron
