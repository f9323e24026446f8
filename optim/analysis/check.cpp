#include "optim/analysis/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/bounds.h"
#include "core/base/error.h"
#include "optim/problem/estimates.h"
#include "optim/problem/gate_columns.h"
#include "optim/problem/student.h"

namespace isochron {
namespace {

constexpr double kRelativeLength = 0.01;  ///< of the scene's extent
constexpr double kRelativeWidth = 0.5;    ///< of the length that gates change over; Richardson's error is then
                                          ///< below 0.1 % even where a path lengthens by twice the step
constexpr double kMostDegrees = 1;
constexpr double kRelativeValue = 0.05;
constexpr double kRoundings = 4;  ///< extrapolation weighs the smallest step's by 64 / 45, and three of them add up

bool moves_geometry(ParameterType type) {
  using enum ParameterType;
  return type == translation || type == rotation || type == vertices || type == camera_translation ||
         type == camera_rotation || type == time_offset;
}

ParameterType type_of(const Problem& problem, int component) {
  const auto& blocks = problem.parameters().blocks();
  for (std::size_t b = 0; b < blocks.size(); ++b)
    if (component < blocks[b].begin + blocks[b].count) return problem.experiment().parameters[b].type;
  throw std::logic_error("no such component");
}

/// Diagonal of the box around all vertices.
double extent(const Scene& scene) {
  Bounds box;
  for (const Vec3& p : scene.positions) box.add(p);
  return length(box.high - box.low);
}

/// Speed of the fastest vertex or light, or of all lengths, scene units per unit of the unknown.
double top_speed(const Problem& problem, const std::vector<double>& theta, int component) {
  const TangentBasis basis = select_columns(problem.parameters().tangent(theta), component, 1);
  const DofLayout layout(problem.scene());
  const auto speed = [&](int dof, int count) {
    double square = 0;
    for (int e = basis.row_begin[dof]; e < basis.row_begin[dof + count]; ++e)
      square += basis.entries[e].coefficient * basis.entries[e].coefficient;
    return std::sqrt(square);
  };
  double fastest = 0;
  for (int i = 0; i < layout.time_offsets; ++i) fastest = std::max(fastest, speed(layout.time_offset(i), 1));
  for (int v = 0; v < layout.vertices; ++v) fastest = std::max(fastest, speed(layout.vertex(v, 0), 3));
  for (int i = 0; i < layout.lights; ++i) fastest = std::max(fastest, speed(layout.light_position(i, 0), 3));
  return fastest;
}

/// Extrapolated derivative of the gates' means, and what rounding of the images can add to its error.
struct DifferenceEstimate {
  Statistics gates;
  std::vector<double> rounding;
};

DifferenceEstimate estimate_difference(const Problem& problem, const std::vector<double>& theta, int component) {
  const double step = check_step(problem, theta, component);
  const int samples = problem.experiment().samples.primal;
  const EstimatorOptions& options = problem.image_estimator();
  constexpr std::array<double, 3> kSteps = {1, 0.5, 0.25};
  std::vector<Scene> scenes;  // above and below, step by step
  std::array<double, 3> distances;
  for (std::size_t s = 0; s < kSteps.size(); ++s) {
    std::vector<double> above = theta, below = theta;
    above[component] += kSteps[s] * step;
    below[component] -= kSteps[s] * step;
    distances[s] = above[component] - below[component];  // as rounded
    scenes.push_back(problem.parameters().apply(above));
    scenes.push_back(problem.parameters().apply(below));
  }
  std::vector<std::unique_ptr<Renderer>> renderers;
  for (const Scene& scene : scenes) renderers.push_back(std::make_unique<Renderer>(scene, problem.gates(), options));

  const int gates = problem.gates().size();
  const Stream stream = problem.stream(Pass::finite_difference);
  const Camera& camera = problem.scene().camera;
  const bool independent = renderers[0]->pixels_are_independent();
  const int replicates = replicate_count(samples, camera.width * camera.height, independent, kMostCheckReplicates);
  ImageStatistics statistics(independent);
  DifferenceEstimate result;
  result.rounding.assign(gates, 0.0);
  ProgressStage stage("rendering finite differences", replicates);
  for (int r = 0; r < replicates; ++r) {
    const SampleRange range = Share{r, replicates}.of(samples);
    std::array<GatedImage, 3> differences;
    for (std::size_t s = 0; s < kSteps.size(); ++s) {
      GatedImage above = renderers[2 * s]->render(stream, range);
      const GatedImage below = renderers[2 * s + 1]->render(stream, range);
      for (int g = 0; g < gates; ++g) {
        const double rounding = std::numeric_limits<double>::epsilon() * std::abs(above.mean(g)) / distances[s];
        result.rounding[g] = std::max(result.rounding[g], rounding);
      }
      for (std::size_t i = 0; i < above.data.size(); ++i)
        above.data[i] = (above.data[i] - below.data[i]) / distances[s];
      differences[s] = std::move(above);
    }
    GatedImage& image = differences[0];
    for (std::size_t i = 0; i < image.data.size(); ++i)
      image.data[i] = extrapolate(image.data[i], differences[1].data[i], differences[2].data[i]);
    statistics.add(std::move(image), range.count());
    stage.advance();
  }
  result.gates = statistics.gates();
  return result;
}

}  // namespace

double z_score(double a, double error_a, double b, double error_b) {
  return a == b ? 0 : (a - b) / std::hypot(error_a, error_b);
}

double false_alarm_limit(int comparisons, double degrees, double rate) {
  return student_quantile(rate / std::max(comparisons, 1), degrees);
}

bool disagrees(const Comparison& row, int comparisons) {
  return !(std::abs(row.z) <= false_alarm_limit(comparisons, row.degrees));
}

Finding finding(const Comparison& row, int comparisons) {
  const double difference = std::abs(row.finite_difference), error = row.finite_difference_error;
  if (row.total == 0 && row.standard_error == 0 && difference == 0 && error == 0) return Finding::nothing;
  if (!disagrees(row, comparisons)) return Finding::agrees;
  const double rounding = kRoundings * row.rounding;
  return difference <= rounding && error <= rounding ? Finding::difference_saw_nothing : Finding::differs;
}

double extrapolate(double whole, double half, double quarter) {
  return (64 * quarter - 20 * half + whole) / 45;
}

Experiment check_experiment(Experiment experiment, std::vector<std::string>& notes) {
  SampleSpec& spec = experiment.samples;
  const int samples = std::max({spec.primal, spec.interior, spec.visibility, spec.path_length});
  if (samples < 2)
    throw InputError(fmt::format("samples: {} is too few for a standard error (allowed: at least 2)", samples));
  const bool motion = std::any_of(experiment.parameters.begin(), experiment.parameters.end(),
                                  [](const ParameterSpec& p) { return moves_geometry(p.type); });
  const bool jumps = experiment.gates.needs_bins() ||  // which the target's file tells later
                     make_gates(experiment.gates).shape().pair_mass(PairPart::dirac) > 0;
  const auto set = [&](int& term, const char* name, bool needed) {
    if (term == 0 && needed)
      notes.push_back(fmt::format("the experiment leaves out the {} term; checked with {} samples", name, samples));
    term = needed ? samples : 0;
  };
  set(spec.primal, "primal", true);
  set(spec.interior, "interior", true);
  set(spec.visibility, "visibility", motion);
  set(spec.path_length, "path_length", motion && jumps);
  experiment.gradient.method = GradientMethod::analytic;
  return experiment;
}

double check_step(const Problem& problem, const std::vector<double>& theta, int component) {
  const Experiment& experiment = problem.experiment();
  const ParameterType type = type_of(problem, component);
  double step = experiment.gradient.step;
  if (moves_geometry(type)) {
    // Bounds of motions are the optimiser's; images exist beyond them.
    if (experiment.gradient.step_given) return step;
    const GateShape& gate = problem.gates().shape();
    double distance = kRelativeLength * extent(problem.scene());
    if (!gate.is_dirac()) distance = std::min(distance, kRelativeWidth * gate.detail());
    const double speed = top_speed(problem, theta, component);
    const double most = type == ParameterType::rotation || type == ParameterType::camera_rotation
                            ? kMostDegrees
                            : std::numeric_limits<double>::max();
    return speed > 0 ? std::min(distance / speed, most) : std::min(distance, most);
  }
  if (!experiment.gradient.step_given) step = kRelativeValue * std::abs(theta[component]);
  const Parameters& parameters = problem.parameters();
  const double room =
      std::min(theta[component] - parameters.lower()[component], parameters.upper()[component] - theta[component]);
  if (!(room > 0))
    throw InputError(fmt::format("--at: {} = {} lies on a bound, where there is no central difference",
                                 parameters.component_names()[component], theta[component]));
  return std::min(step, room);
}

std::vector<Comparison> check_derivative(const Problem& problem, const std::vector<double>& theta, int component) {
  ProgressStage stage("comparing derivatives", 2);
  const auto analytic = estimate_derivatives(problem, theta, component, 1, kMostCheckReplicates);
  stage.advance();
  const DifferenceEstimate difference = estimate_difference(problem, theta, component);
  std::vector<Comparison> rows;
  for (int g = 0; g < problem.gates().size(); ++g) {
    Comparison row;
    row.parameter = problem.parameters().component_names()[component];
    row.gate = g;
    row.total = analytic.front().gates[0].mean[g];
    row.standard_error = analytic.front().gates[0].standard_error[g];
    for (const DerivativeEstimate& estimate : analytic)
      for (Term term : kTerms)
        if (estimate.component == name(term)) row.terms[static_cast<int>(term)] = estimate.gates[0].mean[g];
    row.finite_difference = difference.gates.mean[g];
    row.rounding = difference.rounding[g];
    row.finite_difference_error = std::hypot(difference.gates.standard_error[g], row.rounding);
    row.z = z_score(row.total, row.standard_error, row.finite_difference, row.finite_difference_error);
    const Statistics& ours = analytic.front().gates[0];
    const double all = std::hypot(row.standard_error, row.finite_difference_error);
    if (all > 0)
      row.degrees = 1 / (std::pow(row.standard_error / all, 4) / ours.degrees[g] +
                         std::pow(difference.gates.standard_error[g] / all, 4) / difference.gates.degrees[g]);
    row.effective_count = std::min(ours.effective_count[g], difference.gates.effective_count[g]);
    rows.push_back(row);
  }
  return rows;
}

std::string check_csv(const Problem& problem, const std::vector<Comparison>& table) {
  std::string text =
      "parameter,gate,interior,visibility,path_length,total,standard_error,finite_difference,"
      "finite_difference_error,z,limit,degrees_of_freedom,effective_count" +
      gate_column_names(problem.experiment().gates) + "\n";
  for (const Comparison& row : table)
    text +=
        fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}{}\n", row.parameter, row.gate, row.terms[0], row.terms[1],
                    row.terms[2], row.total, row.standard_error, row.finite_difference, row.finite_difference_error,
                    row.z, false_alarm_limit(static_cast<int>(table.size()), row.degrees), row.degrees,
                    row.effective_count, gate_column_values(problem, row.gate));
  return text;
}

}  // namespace isochron
