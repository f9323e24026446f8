// A loaded experiment, and the functions that Python calls. All functions must hold the interpreter's lock, and release it while
// they work.
#pragma once
#include <pybind11/pybind11.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/python/arrays.h"
#include "optim/problem/problem.h"

namespace isochron {

class Session {
 public:
  Session(const std::string& file, const std::vector<std::string>& overrides);

  /// Of all unknowns: a dictionary for each parameter.
  pybind11::list parameters() const;
  /// Of its images: gates, and a capture's sensor points and spots.
  pybind11::dict coordinates() const;
  /// Gates, rows, columns and channels of its images.
  pybind11::tuple shape() const;
  std::string name() const { return problem_->experiment().name; }

  using Samples = std::optional<int>;
  using Seed = std::optional<std::uint64_t>;
  pybind11::array render(const Array& theta, Samples samples, Seed seed, std::uint32_t iteration);
  pybind11::array jvp(const Array& theta, const Array& tangent, Samples samples, Seed seed, std::uint32_t iteration);
  /// `adjoint` is [row, column, gate, channel].
  pybind11::array vjp(const Array& theta, const Array& adjoint, Samples samples, Seed seed, std::uint32_t iteration);
  /// What optimisers evaluate.
  pybind11::dict evaluate(const Array& theta, std::uint32_t iteration);
  /// What the command `gradient` estimates.
  pybind11::dict gradient(const Array& theta, Samples samples, Seed seed);
  /// As a run's target.exr holds it.
  pybind11::array target();

  /// An optimisation in a folder (empty: that of the command), which is returned. `row` is called after every row of the log.
  /// `loss` is None, or what is minimised in place of the experiment's loss: of an image, its value and its derivative
  /// by the image [row, column, gate, channel]. `loss_name` is for messages.
  std::string run(const std::string& folder, const std::optional<Array>& start, const pybind11::object& row, bool force,
                  const pybind11::object& loss, const std::string& loss_name);

 private:
  /// Throws InputError where theta has another size or leaves its bounds.
  std::vector<double> point(const Array& theta) const;
  /// Throws InputError where coordinates are too large.
  void require_renderable(const std::vector<double>& theta) const;
  /// Throws InputError where a parameter lacks the target value that a target is rendered with.
  void require_target() const;
  /// The target of optimisations, computed when first asked for. Only for tasks of run_work, which take turns.
  std::shared_ptr<const GatedImage> shared_target();
  /// Sets samples, seed and how many evaluations they are for.
  void choose(Samples samples, Seed seed, int evaluations);
  /// As the experiment says, for an optimisation.
  void choose_own() { choose({}, {}, own_evaluations_); }

  Experiment experiment_;  ///< with its overrides
  int own_evaluations_;
  std::unique_ptr<Problem> problem_;
  std::shared_ptr<const GatedImage> target_;
  std::string no_target_;  ///< why there is none: a parameter without a target value; empty where there is one
};

/// Finds the surface behind a capture's counts; its run's folder, or none where there is no signal. `row` as of Session::run.
std::optional<std::string> reconstruct_session(const std::string& capture, const std::string& response,
                                               const std::string& folder, double seconds, std::uint64_t seed,
                                               bool force, const pybind11::object& row);

/// Goes on with the run in a folder. `loss` as of Session::run.
void resume_session(const std::string& folder, const pybind11::object& row, const pybind11::object& loss,
                    const std::string& loss_name);

}  // namespace isochron
