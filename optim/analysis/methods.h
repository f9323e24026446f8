// Ways to a gradient, to be compared on one experiment: settings of the same renderer.
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "optim/problem/problem.h"

namespace isochron {

struct Method {
  enum class Gradient {
    adjoint,            ///< one pass for all unknowns and gates
    finite_difference,  ///< two images per unknown
    forward             ///< a derivative image per unknown and gate, each from passes of its own
  };
  std::string name;
  std::function<void(Experiment&)> change;  ///< what makes it differ from the experiment
  Gradient gradient = Gradient::adjoint;
};

/// `auto`: sampling as the renderer chooses, coupled pairs, arcs by contribution, low-discrepancy numbers; analytic.
Method automatic_method();

/// standard, ellipsoidal_uncoupled, ellipsoidal_coupled, auto, finite_difference_STEP for each of the steps
/// (images as auto), 3_bounces (else auto), and `paper`: ellipsoidal coupled, uniform pick of arcs, independent
/// numbers, one gate and one unknown per pass. What makes no sense for the experiment is left out, with a line in
/// `notes`: ellipsoidal sampling under steady and modulated gates, 3_bounces where there are no more.
std::vector<Method> methods_for(const Experiment& experiment, const std::vector<double>& steps,
                                std::vector<std::string>& notes);

/// `auto`, and without_TECHNIQUE for each that it may use (experiment key `estimator.techniques`; of standard sampling and
/// connections where either finds paths).
std::vector<Method> methods_without(const Experiment& experiment);

/// finite_difference_STEP_independent: finite differences of images whose random numbers have nothing in common, as a
/// renderer without control of them gives.
Method independent_differences(double step);

/// Three steps for finite differences: 4, 1 and 1/4 times the smallest check_step of the parameters, or
/// gradient.step where the experiment gives one.
std::vector<double> default_steps(const Problem& problem, const std::vector<double>& theta);

/// At most `most` of n unknowns, evenly spread.
std::vector<int> spread_components(int n, int most);

/// One method, set up for an experiment.
class MethodRun {
 public:
  /// Throws InputError.
  MethodRun(Experiment experiment, const Method& method);

  Problem& problem() { return problem_; }
  /// Whether the two give the same estimates: adjoint gradients by estimators that come down to the same settings.
  bool same_as(const MethodRun& other) const;
  /// The smallest factor at which every term that is not left out still has a sample.
  double least_factor() const;
  /// From now on every term takes `factor` times the experiment's samples, rounded, 1 at least; images 2 at least
  /// where the loss is a likelihood, whose slope needs two halves.
  void set_factor(double factor);
  /// Unknowns whose derivative is computed; for methods whose cost grows with their number all but a few can
  /// be left out. All unless said.
  void set_components(std::vector<int> components) { components_ = std::move(components); }
  const std::vector<int>& components() const { return components_; }

  struct Estimate {
    std::vector<double> gradient;  ///< of the chosen components
    /// CPU time of a whole gradient: where components were left out, that of the derivatives scaled to all
    /// unknowns.
    double core_seconds = 0;
  };
  /// An estimate with the random numbers of one iteration.
  Estimate gradient(const std::vector<double>& theta, const GatedImage& target, std::uint32_t iteration) const;

 private:
  /// Derivative images by one unknown, of all gates.
  GatedImage derivative(const std::vector<double>& theta, int component, std::uint32_t iteration) const;
  /// Calls `render(renderer, iteration, gate)` for every gate, with a renderer and an iteration number of its own.
  template <class F>
  void gate_by_gate(const Scene& scene, const TangentBasis* basis, std::uint32_t iteration, F&& render) const;

  Method::Gradient kind_;
  Problem problem_;
  SampleSpec samples_;
  std::vector<int> components_;
};

/// For each run the first one that gives the same estimates, itself where no earlier one does. A line in `notes`, which begins
/// with `where`, for each run that an earlier one stands for.
std::vector<std::size_t> first_alike(const std::deque<MethodRun>& runs, const std::vector<Method>& methods,
                                     const std::string& where, std::vector<std::string>& notes);

/// Core-seconds of a gradient with the least number of samples, twice as many and so on.
struct SampleTrial {
  double first_factor = 1;  ///< a power of two
  std::vector<double> core_seconds;
  double factor(int step) const;
  /// The last step of which `repeats` take so long at most; 0 where even the first takes longer.
  int last_within(double seconds, int repeats) const;
};

/// Trials of try_samples() have iterations of their own, from here on.
inline constexpr std::uint32_t kTrialIteration = 0x80000000u;

/// Which random numbers one of `gates` gates takes where each is rendered by itself: gates and iterations differ as long as
/// iterations times gates stay below 2^31, those of trials from all others, too.
constexpr std::uint32_t number_of_gate(std::uint32_t iteration, std::uint32_t gates, std::uint32_t gate) {
  return (iteration & kTrialIteration) | ((iteration & ~kTrialIteration) * gates + gate);
}

/// Goes on up to where `repeats` of the next step would take more than `core_seconds`. Takes other random
/// numbers than iterations below 2^31.
SampleTrial try_samples(MethodRun& run, const std::vector<double>& theta, const GatedImage& target, int repeats,
                        double core_seconds);

}  // namespace isochron
