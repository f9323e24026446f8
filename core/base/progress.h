// How far long work has come, for display, and how it is stopped. Both belong to the whole process, as its threads
// do: work is announced in stages by the thread that controls it, the parallel loops within count by themselves.
#pragma once
#include <atomic>
#include <optional>
#include <string>

namespace isochron {

/// Thrown after a stop was requested, out of the work that it ends.
struct Interrupted {};

inline std::atomic<bool> stop_flag{false};

/// Ends what is under way as soon as can be. Safe to call from a signal handler.
inline void request_stop() {
  static_assert(std::atomic<bool>::is_always_lock_free);
  stop_flag.store(true, std::memory_order_relaxed);
}
inline bool stop_requested() {
  return stop_flag.load(std::memory_order_relaxed);
}
/// Lets work go on after a request.
inline void clear_stop_request() {
  stop_flag.store(false, std::memory_order_relaxed);
}
/// For every sample of long loops: throws Interrupted after a request.
inline void throw_if_stopped() {
  if (stop_requested()) throw Interrupted{};
}

/// Work of so many equal steps, from construction to destruction. Stages nest: one is a step of the stage around it.
class ProgressStage {
 public:
  /// Only the `name` of the outermost stage is shown; steps >= 1.
  explicit ProgressStage(const std::string& name, int steps);
  ~ProgressStage();
  ProgressStage(const ProgressStage&) = delete;
  ProgressStage& operator=(const ProgressStage&) = delete;
  /// Another step is done.
  void advance();
};

struct WorkProgress {
  std::string name;
  double fraction = 0;  ///< in [0, 1], never falls within an outermost stage
  double seconds = 0;   ///< since the outermost stage began
};

/// Of the outermost stage; none outside of stages. From any thread.
std::optional<WorkProgress> work_progress();

/// For parallel loops: begins to count so many parts of the innermost stage's step, and counts one.
void begin_parts(int count);
void count_part();

}  // namespace isochron
