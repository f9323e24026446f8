// Sums over partitions: the same bits for any number of threads and ranks, whatever part of them each takes, in the order of a
// binary tree, and how many there are.
#include "core/base/partition_sum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <numeric>
#include <thread>

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
      for (int repeat = 0; repeat < 20; ++repeat) {
        SharedPartitions shared(count, nullptr);
        ASSERT_EQ(sum_of_partitions<Number>(shared, [](int i) { return Number{term(i)}; }).value, tree(0, count))
            << count << " " << threads;
      }
    }
  set_thread_count(0);
}

/// Ranks that are threads of this process.
class ThreadRanks : public Ranks {
 public:
  int rank() const override { return own_rank; }
  int count() const override { return count_; }
  int count_here() const override { return count_; }
  bool broadcast(std::string& bytes) override {
    if (own_rank > 0) return receive(0, bytes);
    for (int to = 1; to < count_; ++to) send(to, bytes);
    return true;
  }
  bool send(int to, const std::string& bytes) override {
    const std::lock_guard lock(mutex_);
    letters_[{own_rank, to}].push_back(bytes);
    arrived_.notify_all();
    return true;
  }
  bool receive(int from, std::string& bytes) override {
    std::unique_lock lock(mutex_);
    std::deque<std::string>& letters = letters_[{from, own_rank}];
    arrived_.wait(lock, [&] { return !letters.empty(); });
    bytes = std::move(letters.front());
    letters.pop_front();
    return true;
  }
  void abort(int) override { std::abort(); }

  /// f() by each of so many, then one again.
  void run(int count, const std::function<void()>& f) {
    count_ = count;
    std::vector<std::thread> threads;
    for (int r = 0; r < count; ++r)
      threads.emplace_back([&, r] {
        own_rank = r;
        f();
      });
    for (std::thread& thread : threads) thread.join();
    count_ = 1;
    for (const auto& [way, letters] : letters_) EXPECT_TRUE(letters.empty()) << way.first << " to " << way.second;
  }

 private:
  static thread_local int own_rank;
  int count_ = 1;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<std::pair<int, int>, std::deque<std::string>> letters_;
};
thread_local int ThreadRanks::own_rank = 0;

ThreadRanks& thread_ranks() {
  static ThreadRanks ranks;
  set_ranks(ranks);
  return ranks;
}

/// Costs of partitions: alike, rising, almost all in one of them, none.
std::vector<PartitionCosts> kinds_of_costs(int count) {
  std::vector<PartitionCosts> kinds(4, PartitionCosts(count, 1.0));
  std::iota(kinds[1].begin(), kinds[1].end(), 0.0);
  kinds[2][count / 3] = 1000.0 * count;
  kinds[3].assign(count, 0.0);
  return kinds;
}

TEST(PartitionSum, HasTheSameBitsHoweverRanksShareThem) {
  set_thread_count(1);
  for (const int count : {1, 32, 256})
    for (const int ranks : {2, 3, 5, 40})
      for (const PartitionCosts& last : kinds_of_costs(count))
        thread_ranks().run(ranks, [&] {
          PartitionCosts costs = last;
          SharedPartitions shared(count, &costs);
          EXPECT_EQ(sum_of_partitions<Number>(shared, [](int i) { return Number{term(i)}; }).value, tree(0, count))
              << count << " " << ranks;
          // What each took is known to all.
          EXPECT_EQ(std::ranges::count_if(costs, [](double seconds) { return seconds > 0; }), count);
          EXPECT_EQ(of_all_ranks(costs[count / 2]), std::vector<double>(ranks, costs[count / 2]));
        });
  set_thread_count(0);
}

TEST(RankParts, CostAsEvenlyAsWholePartitionsDo) {
  for (const int count : {1, 32, 256})
    for (const int ranks : {1, 2, 3, 5, 40})
      for (const PartitionCosts& costs : kinds_of_costs(count))
        thread_ranks().run(ranks, [&] {
          const RankParts parts(count, costs);
          // What costs nothing at all counts alike.
          PartitionCosts counted = costs;
          if (*std::ranges::max_element(costs) == 0) counted.assign(count, 1.0);
          const double all = std::accumulate(counted.begin(), counted.end(), 0.0);
          const double half = *std::ranges::max_element(counted) / 2;
          double before = 0;
          int next = 0;
          for (int r = 0; r < ranks; ++r) {
            const RankPart part = parts.of(r);
            EXPECT_EQ(part.begin, next);
            for (int i = part.begin; i < part.end; ++i) EXPECT_EQ(parts.rank_of(i), r);
            before = std::accumulate(counted.begin() + part.begin, counted.begin() + part.end, before);
            // Rank 0, which passes on the sum, has one in any case.
            if (part.end > 1) {
              EXPECT_NEAR(before, all * (r + 1) / ranks, half) << count << " " << ranks << " " << r;
            } else {
              EXPECT_EQ(part.end, 1);
            }
            next = part.end;
          }
          EXPECT_EQ(next, count);
        });
}

TEST(PartitionSum, ManyPartitionsHoweverLargeTheSums) {
  EXPECT_EQ(partition_count(64 * 64 * 64, 64 * 64), 256);
  EXPECT_EQ(partition_count(64 * 64, 64 * 64), 64) << "a pass of one sample: 64 images of sums are 64 ns a pixel";
  // A Jacobian of 100 columns and 40 gates had eight, for eight threads at most.
  EXPECT_EQ(partition_count(64 * 64 * 4, std::size_t{64} * 64 * 4000), 32);
}

}  // namespace
}  // namespace isochron
