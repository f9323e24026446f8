// The extension isochron._core. What users see is Python, in isochron/experiment.py; this is what it stands on.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>

#include "app/python/back_projection.h"
#include "app/python/session.h"
#include "app/python/work.h"
#include "core/base/error.h"
#include "optim/experiment/experiment.h"

namespace py = pybind11;

namespace isochron {
namespace {

void translate_errors() {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      std::string line = error.what();
      std::replace(line.begin(), line.end(), '\n', ' ');
      PyErr_SetString(py::module_::import("isochron.errors").attr("InputError").ptr(), line.c_str());
    }
  });
}

}  // namespace

}  // namespace isochron

PYBIND11_MODULE(_core, module) {
  using namespace isochron;
  using namespace pybind11::literals;
  translate_errors();
  share_hdf5();
  module.def("version", program_version);
  module.def("use_threads", use_threads, "count"_a);
  module.def("used_threads", used_threads);
  module.def("watch_progress", watch_progress, "watcher"_a);
  module.def("reconstruct", reconstruct_session, "capture"_a, "response"_a, "folder"_a, "seconds"_a, "seed"_a,
             "force"_a, "row"_a);
  module.def("resume", resume_session, "folder"_a, "row"_a, "loss"_a, "loss_name"_a);
  module.def("back_project", back_project_arrays, "counts"_a, "points"_a, "normals"_a, "laser"_a, "delta_t"_a,
             "t_start"_a, "origins"_a, "response"_a, "used"_a, "false_alarms"_a);
  py::class_<Session>(module, "Session")
      .def(py::init<const std::string&, const std::vector<std::string>&>(), "file"_a, "overrides"_a)
      .def("name", &Session::name)
      .def("parameters", &Session::parameters)
      .def("shape", &Session::shape)
      .def("coordinates", &Session::coordinates)
      .def("render", &Session::render, "theta"_a, "samples"_a, "seed"_a, "iteration"_a)
      .def("jvp", &Session::jvp, "theta"_a, "tangent"_a, "samples"_a, "seed"_a, "iteration"_a)
      .def("vjp", &Session::vjp, "theta"_a, "adjoint"_a, "samples"_a, "seed"_a, "iteration"_a)
      .def("evaluate", &Session::evaluate, "theta"_a, "iteration"_a)
      .def("gradient", &Session::gradient, "theta"_a, "samples"_a, "seed"_a)
      .def("target", &Session::target)
      .def("run", &Session::run, "folder"_a, "start"_a, "row"_a, "force"_a, "loss"_a, "loss_name"_a);
}
