#include "core/base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>

#include "core/base/progress.h"

namespace isochron {
namespace {

std::atomic<int> thread_count = 0;

/// Kept from call to call, as creating an arena per call would restart its threads. Callers share it, so that another number
/// of threads does not end the one that another thread works in.
std::shared_ptr<tbb::task_arena> arena() {
  static std::shared_ptr<tbb::task_arena> kept;
  static int threads_of_kept = 0;
  static std::mutex mutex;
  const int threads = thread_count;
  const std::lock_guard lock(mutex);
  if (!kept || threads_of_kept != threads) {
    const int concurrency = threads > 0 ? threads : tbb::task_arena::automatic;
    kept = std::make_shared<tbb::task_arena>(concurrency);
    threads_of_kept = threads;
  }
  return kept;
}

template <class F>
void run(int count, const F& f) {
  if (count == 1) return f(0);
  const std::shared_ptr<tbb::task_arena> shared = arena();
  shared->execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<int>(0, count, 1),
        [&](const tbb::blocked_range<int>& range) {
          for (int i = range.begin(); i < range.end(); ++i) f(i);
        },
        tbb::simple_partitioner());
  });
}

}  // namespace

void set_thread_count(int threads) {
  thread_count = threads;
}

void parallel(int count, const std::function<void(int)>& f) {
  begin_parts(count);
  run(count, [&](int i) {
    throw_if_stopped();
    f(i);
    count_part();
  });
}

void parallel_ranges(std::size_t count, const std::function<void(std::size_t, std::size_t)>& f) {
  constexpr std::size_t kRange = std::size_t{1} << 15;  // long beside what it takes to share one out; not tuned
  parallel_ranges(count, kRange, f);
}

void parallel_ranges(std::size_t count, std::size_t range, const std::function<void(std::size_t, std::size_t)>& f) {
  run(static_cast<int>((count + range - 1) / range), [&](int i) { f(i * range, std::min((i + 1) * range, count)); });
}

}  // namespace isochron
