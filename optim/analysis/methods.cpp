#include "optim/analysis/methods.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/cpu_time.h"
#include "optim/analysis/check.h"
#include "optim/experiment/technique_names.h"
#include "optim/problem/loss.h"

namespace isochron {
namespace {

constexpr int kFewBounces = 3;

/// Adds an image of one gate to gate g of `all`.
void add_to_gate(GatedImage& all, int g, const GatedImage& image) {
  for (int pixel = 0; pixel < all.pixels(); ++pixel)
    for (int c = 0; c < all.channels; ++c) all.at(pixel, g, c) += image.at(pixel, 0, c);
}

void set_automatic(Experiment& experiment) {
  experiment.estimator.sampling = Sampling::automatic;
  experiment.estimator.antithetic = true;
  experiment.estimator.pick = ArcPick::contribution;
  experiment.estimator.numbers = Numbers::low_discrepancy;
  experiment.estimator.keep_length.reset();
  experiment.estimator.light.reset();
  experiment.gradient.method = GradientMethod::analytic;
}

Method with_sampling(const std::string& name, Sampling sampling, bool antithetic) {
  return {name, [=](Experiment& experiment) {
            set_automatic(experiment);
            experiment.estimator.sampling = sampling;
            experiment.estimator.antithetic = antithetic;
            experiment.estimator.keep_length = false;
            experiment.estimator.light = 0;
          }};
}

/// Central differences of images as auto.
Method differences(const std::string& name, double step, bool common_numbers) {
  return {name,
          [=](Experiment& e) {
            set_automatic(e);
            e.gradient.method = GradientMethod::finite_difference;
            e.gradient.step = step;
            e.gradient.common_numbers = common_numbers;
          },
          Method::Gradient::finite_difference};
}

Experiment changed(Experiment experiment, const Method& method) {
  method.change(experiment);
  return experiment;
}

}  // namespace

Method automatic_method() {
  return {"auto", set_automatic};
}

std::vector<Method> methods_for(const Experiment& experiment, const std::vector<double>& steps,
                                std::vector<std::string>& notes) {
  std::vector<Method> methods{with_sampling("standard", Sampling::standard, true)};
  if (experiment.gates.unbounded()) {
    notes.push_back(experiment.gates.kind + " gates: no ellipsoidal sampling");
  } else {
    methods.push_back(with_sampling("ellipsoidal_uncoupled", Sampling::ellipsoidal, false));
    methods.push_back(with_sampling("ellipsoidal_coupled", Sampling::ellipsoidal, true));
  }
  methods.push_back(automatic_method());
  for (double step : steps) methods.push_back(differences(fmt::format("finite_difference_{:.3g}", step), step, true));
  if (experiment.estimator.max_bounces > kFewBounces)
    methods.push_back({fmt::format("{}_bounces", kFewBounces), [](Experiment& e) {
                         set_automatic(e);
                         e.estimator.max_bounces = kFewBounces;
                       }});
  else
    notes.push_back(
        fmt::format("max_bounces is {}: no method with {} bounces", experiment.estimator.max_bounces, kFewBounces));
  methods.push_back({"paper",
                     [](Experiment& e) {
                       set_automatic(e);
                       e.estimator.keep_length = false;
                       e.estimator.light = 0;
                       e.estimator.sampling = Sampling::ellipsoidal;
                       e.estimator.pick = ArcPick::uniform;
                       e.estimator.numbers = Numbers::independent;
                     },
                     Method::Gradient::forward});
  return methods;
}

std::vector<Method> methods_without(const Experiment& experiment) {
  std::vector<Method> methods{automatic_method()};
  const GateShape shape = make_gates(experiment.gates).shape();
  // Only standard sampling finds paths of any length, only connections those of one.
  const bool either_finds_paths = !shape.is_unbounded() && !shape.is_dirac();
  for (const std::string& technique : used_techniques(changed(experiment, methods[0]).estimator)) {
    if (!either_finds_paths && (technique == "standard" || technique == "ellipsoidal")) continue;
    methods.push_back({"without_" + technique, [technique](Experiment& e) {
                         set_automatic(e);
                         leave_out(technique, e.estimator);
                       }});
  }
  return methods;
}

Method independent_differences(double step) {
  return differences(fmt::format("finite_difference_{:.3g}_independent", step), step, false);
}

std::vector<double> default_steps(const Problem& problem, const std::vector<double>& theta) {
  const GradientSpec& spec = problem.experiment().gradient;
  double step = spec.step;
  if (!spec.step_given) {
    step = INFINITY;
    for (const Parameters::Block& block : problem.parameters().blocks())
      step = std::min(step, check_step(problem, theta, block.begin));
  }
  return {4 * step, step, step / 4};
}

std::vector<int> spread_components(int n, int most) {
  const int count = std::min(n, most);
  std::vector<int> components;
  // The middles of equal parts.
  for (int i = 0; i < count; ++i)
    components.push_back(static_cast<int>((2 * i + 1) * static_cast<long long>(n) / (2 * count)));
  return components;
}

MethodRun::MethodRun(Experiment experiment, const Method& method)
    : kind_(method.gradient),
      problem_(changed(std::move(experiment), method)),
      samples_(problem_.experiment().samples),
      components_(problem_.parameters().size()) {
  std::iota(components_.begin(), components_.end(), 0);
  problem_.estimator();  // its trial is no part of a gradient's time
}

bool MethodRun::same_as(const MethodRun& other) const {
  if (kind_ != Method::Gradient::adjoint || other.kind_ != kind_) return false;
  const auto settled = [](const Problem& problem) {
    EstimatorOptions options = problem.estimator();
    options.mix = sampling_mix(options, problem.gates(), problem.scene());
    options.sampling = Sampling::automatic;
    options.keep_length.reset();
    options.light.reset();
    return options;
  };
  return settled(problem_) == settled(other.problem_);
}

std::vector<std::size_t> first_alike(const std::deque<MethodRun>& runs, const std::vector<Method>& methods,
                                     const std::string& where, std::vector<std::string>& notes) {
  std::vector<std::size_t> first;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::size_t j = 0;
    while (j < i && !runs[i].same_as(runs[j])) ++j;
    first.push_back(j);
    if (j < i)
      notes.push_back(fmt::format("{}{} comes down to {}: measured once", where, methods[i].name, methods[j].name));
  }
  return first;
}

double MethodRun::least_factor() const {
  int least = samples_.primal;
  if (kind_ != Method::Gradient::finite_difference)
    for (Term term : kTerms)
      if (samples_.term(term) > 0) least = std::min(least, samples_.term(term));
  return 1.0 / least;
}

void MethodRun::set_factor(double factor) {
  const auto scaled = [&](int n, double least = 1) {
    return n == 0 ? 0 : static_cast<int>(std::clamp(std::round(factor * n), least, std::ldexp(1.0, 30)));
  };
  const double halves = problem_.experiment().loss.kind == LossKind::poisson ? 2 : 1;  // its slope needs both
  problem_.set_samples({scaled(samples_.primal, halves), scaled(samples_.interior), scaled(samples_.visibility),
                        scaled(samples_.path_length)});
}

template <class F>
void MethodRun::gate_by_gate(const Scene& scene, const TangentBasis* basis, std::uint32_t iteration, F&& render) const {
  const GateSet& gates = problem_.gates();
  const auto count = static_cast<std::uint32_t>(gates.size());
  for (int g = 0; g < gates.size(); ++g) {
    const GateSet gate(gates.shape(), {gates.center(g)});
    const Renderer renderer(scene, gate, problem_.estimator(problem_.experiment().samples.visibility), basis);
    render(renderer, number_of_gate(iteration, count, static_cast<std::uint32_t>(g)), g);
  }
}

GatedImage MethodRun::derivative(const std::vector<double>& theta, int component, std::uint32_t iteration) const {
  const SampleSpec& samples = problem_.experiment().samples;
  if (kind_ == Method::Gradient::finite_difference)
    return problem_.finite_difference(theta, component, problem_.stream(Pass::finite_difference, iteration),
                                      {0, samples.primal});
  const Scene scene = problem_.parameters().apply(theta);
  const TangentBasis basis = select_columns(problem_.parameters().tangent(theta), component, 1);
  GatedImage sum = problem_.blank();
  gate_by_gate(scene, &basis, iteration, [&](const Renderer& renderer, std::uint32_t number, int g) {
    for (Term term : kTerms)
      if (samples.term(term) > 0)
        add_to_gate(sum, g, renderer.derive(term, problem_.stream(pass_of(term), number), {0, samples.term(term)})[0]);
  });
  return sum;
}

MethodRun::Estimate MethodRun::gradient(const std::vector<double>& theta, const GatedImage& target,
                                        std::uint32_t iteration) const {
  const double start = cpu_seconds();
  if (kind_ == Method::Gradient::adjoint) {
    const std::vector<double> all = problem_.evaluate(theta, target, iteration).gradient;
    Estimate result{{}, cpu_seconds() - start};
    for (int component : components_) result.gradient.push_back(all[component]);
    return result;
  }
  const int primal = problem_.experiment().samples.primal;
  SplitImage image;
  const Scene scene = problem_.parameters().apply(theta);
  if (kind_ == Method::Gradient::finite_difference) {
    const Renderer renderer(scene, problem_.gates(), problem_.estimator());
    image = render_halves(renderer, problem_.stream(Pass::primal, iteration), {0, primal});
  } else {
    image.image = problem_.blank();
    if (primal > 1) image.difference = image.image;
    gate_by_gate(scene, nullptr, iteration, [&](const Renderer& renderer, std::uint32_t number, int g) {
      const SplitImage gate = render_halves(renderer, problem_.stream(Pass::primal, number), {0, primal});
      image.first = gate.first;
      add_to_gate(image.image, g, gate.image);
      if (gate.halved()) add_to_gate(image.difference, g, gate.difference);
    });
  }
  const GatedImage adjoint = loss_adjoint(image, target, problem_.reading_loss(target));
  std::vector<double> penalty(theta.size(), 0.0);
  problem_.penalty().add_gradient(theta, problem_.penalty_scale(target), penalty);
  const double before_derivatives = cpu_seconds();
  Estimate result;
  for (int component : components_)
    result.gradient.push_back(inner_product(adjoint, derivative(theta, component, iteration)) + penalty[component]);
  const double share = static_cast<double>(theta.size()) / static_cast<double>(components_.size());
  result.core_seconds = before_derivatives - start + share * (cpu_seconds() - before_derivatives);
  return result;
}

double SampleTrial::factor(int step) const {
  return std::ldexp(first_factor, step);
}

int SampleTrial::last_within(double seconds, int repeats) const {
  int step = static_cast<int>(core_seconds.size()) - 1;
  while (step > 0 && repeats * core_seconds[step] > seconds) --step;
  return step;
}

SampleTrial try_samples(MethodRun& run, const std::vector<double>& theta, const GatedImage& target, int repeats,
                        double core_seconds) {
  constexpr int kMostSteps = 24;
  SampleTrial trial{std::exp2(std::ceil(std::log2(run.least_factor()))), {}};
  for (int step = 0; step < kMostSteps; ++step) {
    run.set_factor(trial.factor(step));
    trial.core_seconds.push_back(
        run.gradient(theta, target, kTrialIteration + static_cast<std::uint32_t>(step)).core_seconds);
    if (repeats * 2 * trial.core_seconds.back() > core_seconds) break;
  }
  return trial;
}

}  // namespace isochron
