// Long work for Python: without the interpreter's lock, and ended by signals such as Ctrl-C.
#pragma once
#include <pybind11/pybind11.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace isochron {

/// What a running task can ask of Python.
class Work {
 public:
  virtual ~Work() = default;
  /// Runs f in the thread that Python called from, with the interpreter's lock, and waits for it. Throws Interrupted where f
  /// raised an exception, which Python then gets.
  virtual void call(const std::function<void()>& f) = 0;
};

/// Runs the task in a thread of its own while the calling one, which must hold the interpreter's lock and releases it,
/// handles signals: where one of their handlers raises an exception, such as KeyboardInterrupt, the task is stopped and the
/// exception raised. Tasks of several threads wait for each other: each uses all cores, and requests to stop, like progress,
/// are the process's. What a task's call() calls may run tasks in its turn.
void run_work(const std::function<void(Work&)>& task);

/// The same, with a result.
template <class F>
auto run_work_for(F&& task) {
  std::optional<decltype(task())> result;
  run_work([&](Work&) { result.emplace(task()); });
  return std::move(*result);
}

/// While tasks run that this thread starts, watcher(name, fraction, seconds) is called in it about ten times a second: of the
/// work under way, its part that is done, in [0, 1], and the time since it began. None: nothing is called. What it raises ends
/// the task. The caller keeps a reference. Returns the watcher before.
pybind11::object watch_progress(const pybind11::object& watcher);

/// Makes tasks read and write HDF5 in the thread that Python called from, with the interpreter's lock and h5py's, where that is
/// loaded: both may stand on the same library, which serves one thread at a time.
void share_hdf5();

/// Gives each line to Python's module `warnings`, as of who called the package's function that is running.
void warn_python(const std::vector<std::string>& lines);

/// Threads that renderers use from now on; 0: all cores. Waits for tasks under way.
void use_threads(int threads);
int used_threads();

}  // namespace isochron
