// Loops on several threads, from several threads.
#include "core/base/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace isochron {
namespace {

/// Another number of threads, while one thread is in the middle of a loop, counts for the loops that begin then. (As many as
/// before would wait for the first loop's threads.)
TEST(Parallel, ThreadCountChangesUnderALoop) {
  for (int round = 0; round < 20; ++round) {
    set_thread_count(2);
    std::atomic<bool> began = false, changed = false;
    std::atomic<int> outer = 0, inner = 0;
    std::thread other([&] {
      while (!began) std::this_thread::yield();
      set_thread_count(round % 2 == 0 ? 1 : 3);
      parallel(50, [&](int) { ++inner; });
      changed = true;
    });
    parallel(50, [&](int) {
      began = true;
      while (!changed) std::this_thread::yield();
      ++outer;
    });
    other.join();
    EXPECT_EQ(outer, 50);
    EXPECT_EQ(inner, 50);
  }
  set_thread_count(0);
}

TEST(Parallel, RangesTogetherAreAll) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{1} << 15, (std::size_t{1} << 17) + 3}) {
    std::vector<int> visits(count, 0);
    parallel_ranges(count, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++visits[i];
    });
    EXPECT_EQ(std::ranges::count(visits, 1), std::ssize(visits)) << count;
  }
}

}  // namespace
}  // namespace isochron
