// What both optimisers that run inside Ceres share.
#pragma once
#include <glog/logging.h>

#include <exception>
#include <functional>

namespace isochron {

/// Keeps Ceres's log off the terminal: its warnings are about inner numbers, failures show in what it
/// returns.
inline void silence_ceres() {
  FLAGS_minloglevel = google::GLOG_FATAL;
}

/// Calls of the objective from within Ceres, which must see no exception: the first is kept, all later calls
/// fail at once so that the solver ends, and rethrow() after it passes the exception on (an interruption,
/// above all).
class GuardedCalls {
 public:
  /// Whether `call` returned true.
  bool operator()(const std::function<bool()>& call) const {
    if (error_) return false;
    try {
      return call();
    } catch (...) {
      error_ = std::current_exception();
      return false;
    }
  }
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  mutable std::exception_ptr error_;
};

}  // namespace isochron
