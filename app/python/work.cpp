#include "app/python/work.h"

#include <pybind11/pybind11.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/image/hdf5_file.h"

namespace py = pybind11;

namespace isochron {
namespace {

/// Between looks at whether a signal has come.
constexpr std::chrono::milliseconds kPause{20};
/// Between calls of a watcher.
constexpr std::chrono::milliseconds kShown{100};

std::timed_mutex busy;              // held by the one task that is under way
thread_local int calls_inside = 0;  // of Work::call that this thread is in: what holds `busy` waits for it
int threads = 0;
thread_local Work* current = nullptr;  // whose task this thread runs
thread_local PyObject* watcher = nullptr;

/// Runs f with the interpreter's lock; what Python raised in it.
template <class F>
std::unique_ptr<py::error_already_set> raised_by(F&& f) {
  const py::gil_scoped_acquire acquired;
  try {
    f();
    return {};
  } catch (const py::error_already_set& error) {
    return std::make_unique<py::error_already_set>(error);
  } catch (const std::exception& error) {
    PyErr_SetString(PyExc_RuntimeError, error.what());
    return std::make_unique<py::error_already_set>();
  }
}

void run_handlers_of_signals() {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

void call_watcher() {
  const std::optional<WorkProgress> now = work_progress();
  if (now) py::reinterpret_borrow<py::object>(watcher)(now->name, now->fraction, now->seconds);
}

class ThreadedWork : public Work {
 public:
  void run(const std::function<void(Work&)>& task) {
    std::exception_ptr failure;
    std::unique_ptr<py::error_already_set> raised;
    {
      const py::gil_scoped_release released;
      std::unique_lock busy_here(busy, std::defer_lock);
      while (calls_inside == 0 && !raised && !busy_here.try_lock_for(kPause))
        raised = raised_by(run_handlers_of_signals);
      if (!raised) {
        std::thread thread([&] {
          current = this;
          try {
            task(*this);
          } catch (...) {
            failure = std::current_exception();
          }
          const std::lock_guard lock(mutex_);
          ended_ = true;
          changed_.notify_all();
        });
        raised = serve();
        thread.join();
        clear_stop_request();
      }
    }
    if (raised) throw py::error_already_set(*raised);
    if (!failure) return;
    try {
      std::rethrow_exception(failure);
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
      throw py::error_already_set();
    }
  }

  void call(const std::function<void()>& f) override {
    std::unique_lock lock(mutex_);
    call_ = &f;
    changed_.notify_all();
    changed_.wait(lock, [&] { return !call_; });
    if (call_raised_) throw Interrupted{};
  }

 private:
  /// Until the task has ended.
  std::unique_ptr<py::error_already_set> serve() {
    std::unique_ptr<py::error_already_set> raised;
    auto shown = std::chrono::steady_clock::now();
    std::unique_lock lock(mutex_);
    while (!ended_) {
      changed_.wait_for(lock, kPause, [&] { return ended_ || call_; });
      if (ended_) break;
      const std::function<void()>* const call = call_;
      lock.unlock();
      std::unique_ptr<py::error_already_set> now;
      if (call) {
        ++calls_inside;
        now = raised_by(*call);
        --calls_inside;
      } else if (!raised) {
        now = raised_by(run_handlers_of_signals);
        const auto time = std::chrono::steady_clock::now();
        if (!now && watcher && time - shown >= kShown) {
          shown = time;
          now = raised_by(call_watcher);
        }
        if (now) request_stop();
      }
      if (now && !raised) raised = std::move(now);
      lock.lock();
      if (call) {
        call_ = nullptr;
        call_raised_ = raised != nullptr;
        changed_.notify_all();
      }
    }
    return raised;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  const std::function<void()>* call_ = nullptr;  ///< that waits
  bool call_raised_ = false, ended_ = false;
};

/// h5py's lock of HDF5, taken while it lives. A thread that has it may take it again.
class H5pyLock {
 public:
  H5pyLock() {
    const py::object module = py::module_::import("sys").attr("modules").attr("get")("h5py._objects");
    if (module.is_none()) return;
    lock_ = module.attr("phil");
    lock_.attr("acquire")();
  }
  ~H5pyLock() {
    if (lock_) lock_.attr("release")();
  }
  H5pyLock(const H5pyLock&) = delete;
  H5pyLock& operator=(const H5pyLock&) = delete;

 private:
  py::object lock_;
};

}  // namespace

void share_hdf5() {
  run_hdf5_by([](const std::function<void()>& work) {
    if (!current) return work();
    std::exception_ptr failure;
    current->call([&] {
      const H5pyLock lock;
      try {
        work();
      } catch (...) {
        failure = std::current_exception();
      }
    });
    if (failure) std::rethrow_exception(failure);
  });
}

void run_work(const std::function<void(Work&)>& task) {
  ThreadedWork().run(task);
}

py::object watch_progress(const py::object& next) {
  PyObject* const before = std::exchange(watcher, next.is_none() ? nullptr : next.ptr());
  return before ? py::reinterpret_borrow<py::object>(before) : py::none();
}

void warn_python(const std::vector<std::string>& lines) {
  for (const std::string& line : lines)
    if (PyErr_WarnEx(PyExc_UserWarning, line.c_str(), 2) != 0) throw py::error_already_set();
}

void use_threads(int count) {
  run_work([&](Work&) { set_thread_count(count); });
  threads = count;
}

int used_threads() {
  return threads;
}

}  // namespace isochron
