#include "core/base/progress.h"

#include <algorithm>
#include <mutex>
#include <vector>

#include "core/base/clock.h"

namespace isochron {
namespace {

struct Stage {
  std::string name;
  int steps, done = 0;
};

std::mutex mutex;  // of what follows, up to the atomics
std::vector<Stage> stages;
Clock::time_point start;
double highest = 0;

std::atomic<int> parts{0}, parts_done{0};

}  // namespace

ProgressStage::ProgressStage(const std::string& name, int steps) {
  const std::lock_guard lock(mutex);
  if (stages.empty()) start = Clock::now(), highest = 0;
  stages.push_back({name, std::max(steps, 1)});
  parts = 0;
}

ProgressStage::~ProgressStage() {
  const std::lock_guard lock(mutex);
  stages.pop_back();
  parts = 0;
}

void ProgressStage::advance() {
  const std::lock_guard lock(mutex);
  ++stages.back().done;
  parts = 0;
}

std::optional<WorkProgress> work_progress() {
  const std::lock_guard lock(mutex);
  if (stages.empty()) return {};
  const int count = parts;
  double fraction = count > 0 ? std::min(1.0, static_cast<double>(parts_done) / count) : 0;
  for (auto stage = stages.rbegin(); stage != stages.rend(); ++stage)
    fraction = std::min(1.0, (stage->done + fraction) / stage->steps);
  // A step may hold several loops, each of which counts from zero.
  highest = std::max(highest, fraction);
  return WorkProgress{stages.front().name, highest, seconds_since(start)};
}

void begin_parts(int count) {
  parts_done = 0;
  parts = count;
}

void count_part() {
  parts_done.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace isochron
