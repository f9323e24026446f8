#pragma once
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "optim/run/run.h"

namespace isochron {

/// Shows on stderr how far the work under way has come (core/base/progress.h), from construction to end(): on a terminal
/// as a bar that is redrawn in place, elsewhere as a line every few seconds. One at a time. Messages of spdlog may come at
/// any time; before other output, end() it.
class ProgressDisplay {
 public:
  explicit ProgressDisplay(bool quiet);
  ~ProgressDisplay();
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;
  /// What a run has come to: iteration, loss, parameter error, time per iteration and time left take the place of the
  /// stage's name and time.
  void show(const Progress& progress);
  /// Clears the bar and shows nothing more.
  void end();

 private:
  void watch();
  std::string line(bool bar) const;

  bool terminal_;
  bool ended_ = false;  ///< this and `run_` under `mutex_`
  std::string run_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::thread thread_;
};

/// To be called once, before the first message: messages of spdlog's default logger clear the bar that is shown.
void keep_messages_off_the_bar();

}  // namespace isochron
