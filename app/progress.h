#pragma once
#include "optim/run.h"

namespace isochron {

/// Shows iteration, loss, parameter error, time per iteration and time left on stderr: one line rewritten in
/// place on a terminal, one line per iteration elsewhere.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet);
  ~ProgressLine();  ///< ends the line
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  void show(const Progress& progress);
  /// Ends the line so that a message can follow.
  void end();

 private:
  bool quiet_, terminal_, open_ = false;
};

}  // namespace isochron
