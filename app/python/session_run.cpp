// Runs from Python.
#include "app/experiment_source.h"
#include "app/python/session.h"
#include "app/python/work.h"
#include "core/base/progress.h"
#include "optim/reconstruct/run_reconstruction.h"

namespace py = pybind11;

namespace isochron {
namespace {

/// What Python's callback gets of a row of the log.
py::dict row_of(const LogRow& row, const std::vector<double>& theta, const Evaluation& now, bool closing,
                const Progress& progress) {
  py::dict result;
  result["iteration"] = row.iteration;
  result["closing"] = closing;
  result["iterations"] = progress.iterations;
  result["level"] = progress.level;
  result["levels"] = progress.levels;
  result["seconds"] = row.seconds;
  result["loss"] = row.loss;
  result["loss_noise"] = row.loss_noise;
  result["image_rmse"] = row.image_rmse;
  result["param_rmse"] = row.param_rmse;
  result["gradient_norm"] = row.gradient_norm;
  result["theta"] = to_array(theta);
  result["gradient"] = to_array(now.gradient);
  result["image"] = to_array(now.image);
  return result;
}

struct OwnLossOfPython {
  py::object function;  ///< None: that of the experiment
  std::string name;
};

ImageLoss loss_of(Work& work, const py::object& function, const GatedImage& image) {
  ImageLoss found;
  work.call([&] {
    const py::tuple result = function(to_array(image));
    found = {result[0].cast<double>(), to_image(result[1].cast<Array>(), image)};
  });
  return found;
}

/// `row(dict)` returns whether to stop.
void execute(const std::string& folder, bool force, const py::object& row, const OwnLossOfPython& loss,
             const std::function<void(const RunOptions&)>& start) {
  std::vector<std::string> warnings;
  run_work([&](Work& work) {
    RunOptions options;
    options.folder = folder;
    options.force = force;
    options.warning = [&](const std::string& text) { warnings.push_back(text); };
    if (!loss.function.is_none()) {
      options.loss = [&](const GatedImage& image) { return loss_of(work, loss.function, image); };
      options.loss_name = loss.name;
    }
    Progress latest;
    options.progress = [&](const Progress& progress) { latest = progress; };
    if (!row.is_none())
      options.row = [&](const LogRow& values, const std::vector<double>& theta, const Evaluation& now, bool closing) {
        work.call([&] {
          const py::object stop = row(row_of(values, theta, now, closing, latest));
          if (stop.cast<bool>() && !closing) request_stop();
        });
      };
    start(options);
  });
  warn_python(warnings);
}

}  // namespace

std::string Session::run(const std::string& folder, const std::optional<Array>& start, const py::object& row,
                         bool force, const py::object& loss, const std::string& loss_name) {
  if (loss.is_none()) require_target();
  Experiment experiment = experiment_;
  if (start) start_at(point(*start), problem_->parameters(), experiment);
  const std::string output = output_folder(folder, experiment);
  execute(output, force, row, {loss, loss_name}, [&](const RunOptions& options) { start_run(experiment, options); });
  return output;
}

std::optional<std::string> reconstruct_session(const std::string& capture, const std::string& response,
                                               const std::string& folder, double seconds, std::uint64_t seed,
                                               bool force, const py::object& row) {
  const ReconstructionSpec spec{capture, response, seconds, seed};
  const std::string output = folder.empty() ? default_folder(spec) : folder;
  bool found = false;
  execute(output, force, row, {py::none(), {}},
          [&](const RunOptions& options) { found = run_reconstruction(spec, options).status.has_value(); });
  return found ? std::optional(output) : std::nullopt;
}

void resume_session(const std::string& folder, const py::object& row, const py::object& loss,
                    const std::string& loss_name) {
  execute(folder, false, row, {loss, loss_name}, [](const RunOptions& options) { resume_run(options); });
}

}  // namespace isochron
