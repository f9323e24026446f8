#include "app/python/session.h"

#include <fmt/format.h>

#include <cmath>

#include "app/experiment_source.h"
#include "app/python/work.h"
#include "core/base/error.h"
#include "optim/problem/darkness.h"
#include "optim/problem/estimates.h"
#include "optim/problem/memory.h"
#include "optim/problem/rendered_objective.h"

namespace py = pybind11;

namespace isochron {
namespace {

void require_all_finite(const std::vector<double>& values, const std::string& what) {
  for (const double value : values)
    if (!std::isfinite(value)) throw InputError(fmt::format("{}: {} is not finite", what, value));
}

}  // namespace

Session::Session(const std::string& file, const std::vector<std::string>& overrides) {
  std::vector<std::string> warnings;
  run_work([&](Work&) {
    // What only renders needs no target values: they are missed where they are needed.
    try {
      experiment_ = read_experiment({file, overrides, {}, {}});
    } catch (const InputError& error) {
      experiment_ = read_experiment({file, overrides, {}, {}}, false);
      no_target_ = error.what();
    }
    problem_ = std::make_unique<Problem>(experiment_, [&](const std::string& text) { warnings.push_back(text); });
  });
  own_evaluations_ = std::max(1, experiment_.optimizer.iterations);
  warn_python(warnings);
}

std::vector<double> Session::point(const Array& theta) const {
  const Parameters& parameters = problem_->parameters();
  if (theta.size() != parameters.size())
    throw InputError(fmt::format("theta: {} values are given (allowed: {})", theta.size(), parameters.size()));
  const std::vector<double> values = to_vector(theta);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!(values[i] >= parameters.lower()[i] && values[i] <= parameters.upper()[i] && std::isfinite(values[i])))
      throw InputError(fmt::format("theta: {}: {} is out of bounds (allowed: {} to {})",
                                   parameters.component_names()[i], values[i], parameters.lower()[i],
                                   parameters.upper()[i]));
  return values;
}

void Session::require_renderable(const std::vector<double>& theta) const {
  if (!problem_->can_render(theta))
    throw InputError(
        fmt::format("theta: puts a vertex too far away (allowed: coordinates of at most {})", kLargestCoordinate));
}

void Session::choose(Samples samples, Seed seed, int evaluations) {
  SampleSpec spec = experiment_.samples;
  if (samples) {
    if (*samples < 1 || *samples > 1 << 30)
      throw InputError(fmt::format("samples: {} is out of range (allowed: 1 to {})", *samples, 1 << 30));
    spec.set_all(*samples);
  }
  problem_->choose(spec, seed.value_or(experiment_.seed), evaluations);
}

py::array Session::render(const Array& array, Samples samples, Seed seed, std::uint32_t iteration) {
  const std::vector<double> theta = point(array);
  std::string dark;
  GatedImage found = run_work_for([&] {
    choose(samples, seed, own_evaluations_);
    require_renderable(theta);
    require_memory(*problem_, image_memory(*problem_));
    const ImageEstimate estimate = estimate_image(*problem_, theta, iteration);
    require_finite(estimate.image, "the image");
    dark = darkness_warning(*problem_, theta, estimate.gates.mean, "the image");
    return estimate.image.to_gated();
  });
  if (!dark.empty()) warn_python({dark});
  return to_array(std::move(found));
}

py::array Session::jvp(const Array& array, const Array& tangent, Samples samples, Seed seed, std::uint32_t iteration) {
  const std::vector<double> theta = point(array), direction = to_vector(tangent);
  require_all_finite(direction, "tangent");
  if (direction.size() != theta.size())
    throw InputError(fmt::format("tangent: {} values are given (allowed: {})", direction.size(), theta.size()));
  return to_array(run_work_for([&] {
    choose(samples, seed, own_evaluations_);
    require_renderable(theta);
    problem_->require_parameters();
    require_memory(*problem_, derivative_memory(*problem_, 1));
    const StoredImage image = std::move(estimate_tangent(*problem_, theta, direction, iteration)[0].images[0]);
    require_finite(image, "the derivative");
    return image.to_gated();
  }));
}

py::array Session::vjp(const Array& array, const Array& adjoint, Samples samples, Seed seed, std::uint32_t iteration) {
  const std::vector<double> theta = point(array);
  const GatedImage image = to_image(adjoint, problem_->blank());
  require_all_finite(image.data, "adjoint");
  return to_array(run_work_for([&] {
    choose(samples, seed, own_evaluations_);
    require_renderable(theta);
    problem_->require_parameters();
    return problem_->transpose_apply(theta, image, iteration);
  }));
}

py::dict Session::evaluate(const Array& array, std::uint32_t iteration) {
  const std::vector<double> theta = point(array);
  Evaluation found = run_work_for([&] {
    const std::shared_ptr<const GatedImage> target = shared_target();
    choose_own();
    problem_->require_parameters();
    require_two_samples(*problem_);
    return RenderedObjective(*problem_, *target).evaluate(theta, iteration);
  });
  py::dict result;
  result["loss"] = found.loss;
  result["loss_noise"] = found.loss_noise;
  result["mean_squared_error"] = found.mean_squared_error;
  result["gradient"] = to_array(std::move(found.gradient));
  result["image"] = to_array(std::move(found.image));
  return result;
}

py::dict Session::gradient(const Array& array, Samples samples, Seed seed) {
  const std::vector<double> theta = point(array);
  Statistics found = run_work_for([&] {
    require_target();
    choose(samples, seed, 1);
    require_renderable(theta);
    problem_->require_parameters();
    gradient_repeats(*problem_);  // too few samples must show before the target is rendered
    return estimate_gradient(*problem_, theta, problem_->make_target()).gradient;
  });
  py::dict result;
  result["gradient"] = to_array(std::move(found.mean));
  result["standard_error"] = to_array(std::move(found.standard_error));
  result["degrees_of_freedom"] = to_array(std::move(found.degrees));
  return result;
}

void Session::require_target() const {
  if (!no_target_.empty()) throw InputError(no_target_);
}

std::shared_ptr<const GatedImage> Session::shared_target() {
  require_target();
  if (!target_) {
    choose_own();
    GatedImage image = problem_->make_target();
    require_finite(image, "the target");
    // Runs read it from a file of such numbers.
    for (double& value : image.data) value = static_cast<float>(value);
    target_ = std::make_shared<const GatedImage>(std::move(image));
  }
  return target_;
}

py::array Session::target() {
  return to_array(*run_work_for([&] { return shared_target(); }));
}

}  // namespace isochron
