#include "core/base/parallel.h"

#include <malloc.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "core/base/progress.h"

namespace isochron {
namespace {

int thread_count = 0;

template <class F>
void run(int count, const F& f) {
  tbb::task_arena arena(thread_count > 0 ? thread_count : tbb::task_arena::automatic);
  arena.execute([&] {
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

void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the most that the GNU library takes
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
}

void parallel(int count, const std::function<void(int)>& f) {
  begin_parts(count);
  run(count, [&](int i) {
    throw_if_stopped();
    f(i);
    count_part();
  });
}

}  // namespace isochron
