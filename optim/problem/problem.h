// A loaded experiment: scene, gates and parameters, and the functions that optimisers evaluate.
#pragma once
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/base/progress.h"
#include "core/gates/gate.h"
#include "core/image/image.h"
#include "core/render/measure_mix.h"
#include "core/render/scene_cache.h"
#include "core/scene/scene.h"
#include "optim/experiment/experiment.h"
#include "optim/problem/loss.h"
#include "optim/problem/objective.h"
#include "optim/problem/parameters.h"
#include "optim/problem/penalties.h"
#include "optim/problem/readings.h"
#include "optim/problem/smoothing.h"

namespace isochron {

/// Random streams (Stream::pass). Each estimate has its own, so that residual and derivative are independent.
enum class Pass : std::uint32_t {
  primal = 0,
  interior = 1,
  visibility = 2,
  path_length = 3,
  target = 4,
  finite_difference = 5,
  photon_noise = 6,
  mix = 7,
  other_side = 8,  ///< of a finite difference, where its images take random numbers of their own
  probe = 9,
  histograms = 10,  ///< of final.h5
  render = 11       ///< images by themselves: targets of other runs, whose noise must not be that of these
};

/// Part `index` of `parts` equal parts of an estimate's samples; parts are independent of each other.
struct Share {
  int index = 0, parts = 1;
  SampleRange of(int samples) const {
    const auto cut = [&](int i) { return static_cast<int>(static_cast<long long>(samples) * i / parts); };
    return {cut(index), cut(index + 1)};
  }
};

class Problem {
 public:
  /// Loads the scene and binds the parameters. Throws InputError. `warning` receives one line where shapes
  /// lie on each other at the initial or the target values.
  explicit Problem(Experiment experiment, const std::function<void(const std::string&)>& warning = {});
  /// Its parameters and kept scenes refer to its scene: it stays where it is.
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;

  const Experiment& experiment() const { return experiment_; }
  const Scene& scene() const { return scene_; }
  const GateSet& gates() const { return gates_; }
  const Parameters& parameters() const { return *parameters_; }
  const Preconditioner& preconditioner() const { return preconditioner_; }
  const QuadraticPenalty& penalty() const { return penalty_; }
  /// See prior_of. Made when it is asked for, which is at the end of a run.
  QuadraticPenalty prior() const { return prior_of(experiment_.parameters, *parameters_, scene_); }
  /// Of slopes: the target's mean square; of priors: one over the number of readings, as the loss is a mean. 0 where
  /// there is no penalty.
  PenaltyScale penalty_scale(const GatedImage& target) const;

  /// The experiment's options with the mix of techniques that automatic sampling chooses, once for all values of the parameters:
  /// by a trial at their initial values, whose work is in proportion to the work that the choice is for. For gradients that is a
  /// whole optimisation with the experiment's iterations and its target, so that a resumed run chooses alike; for derivative
  /// images (Purpose::images) it is the experiment's samples once.
  const EstimatorOptions& estimator(Purpose purpose = Purpose::gradients) const;
  /// The same to render the experiment's images once, and nothing else.
  const EstimatorOptions& image_estimator() const;
  /// That gradients at so many points are wanted, not an optimisation: for the work of that trial. To be called before any.
  void set_evaluations(int evaluations) { evaluations_ = evaluations; }

  /// Takes the place of the experiment's numbers of samples; what automatic sampling has settled on stays.
  void set_samples(const SampleSpec& samples) { experiment_.samples = samples; }

  /// From now on as if the experiment's file had these samples and this seed, and set_evaluations had been called. Automatic
  /// sampling makes a trial for each such setting, and remembers the results of some.
  void choose(const SampleSpec& samples, std::uint64_t seed, int evaluations);

  /// Throws InputError when the experiment has no parameters: nothing to differentiate.
  void require_parameters() const;

  Stream stream(Pass pass, std::uint32_t iteration = 0) const {
    return {experiment_.seed, iteration, pass_number(pass)};
  }

  /// Whether theta leaves all coordinates at sizes that can be rendered (kLargestCoordinate).
  bool can_render(const std::vector<double>& theta) const;
  /// What `evaluate` gives where it does not: infinite loss, an image and a gradient of NaN.
  Evaluation no_evaluation(const GatedImage& target) const;

  /// A black image of the experiment's shape.
  GatedImage blank() const;
  /// Gated images at theta. Throws InputError where it cannot be rendered.
  GatedImage render(const std::vector<double>& theta, const Stream& stream, SampleRange range) const;

  /// The same of many samples with options of its own, in parts, so that a request to stop does not wait for all of them.
  GatedImage render_in_parts(const std::vector<double>& theta, const EstimatorOptions& options, const Stream& stream,
                             int samples, const std::string& stage) const;

  /// The same in two halves, where there are two samples.
  SplitImage render_halves_in_parts(const std::vector<double>& theta, const EstimatorOptions& options,
                                    const Stream& stream, int samples, const std::string& stage) const;

  /// A renderer of a scene that parameters() made. Scene and basis must outlive it.
  Renderer renderer(const Scene& scene, const EstimatorOptions& options, const TangentBasis* basis = nullptr) const;

  /// The images that the optimisation aims at: rendered at the target values, with photon noise where it is
  /// asked for, or read from a file. Throws InputError when the file's shape is not that of this experiment's
  /// images.
  GatedImage make_target() const;
  /// Reads a target image and checks its shape against this experiment's, and whether the loss has a use for it.
  GatedImage read_target(const std::string& file) const;

  /// The experiment's options for a renderer that will take so many visibility samples per pixel: guiding learns from
  /// a small share of their number.
  EstimatorOptions estimator(int visibility_samples, Purpose purpose = Purpose::gradients) const;

  /// Rays traced so far, those of target and expected counts aside.
  long long rays() const { return cache_->rays(); }
  /// What its renderers' passes took so far, likewise.
  const PassTimes& times() const { return cache_->times(); }

  /// Which of a target's readings count.
  const Readings& readings() const { return readings_; }
  /// Whether `evaluate` takes as many others in each iteration: adam averages over its iterations, so that all histograms count.
  bool redraws_histograms() const;
  /// Throws InputError, which begins with `what`, where the loss has no use for a target.
  void require_usable(const GatedImage& target, const std::string& what) const;

  /// The experiment's loss, made absolute by the root mean square of a typical pixel of the target, for counts by its mean, so
  /// that single hot pixels count for nothing. Squared where the target is black.
  ReadingLoss reading_loss(const GatedImage& target) const;

  /// Loss of an image rendered at theta, the penalty included.
  LossEstimate loss(const SplitImage& image, const GatedImage& target, const std::vector<double>& theta) const;

  /// Image, loss and gradient at theta from the random numbers of one iteration, unbiased (robust losses: as loss.h
  /// says). The loss is NaN where the share has a single sample of the image.
  /// `parts`, where asked for, becomes what terms and sets of pixels contribute to the gradient, the penalty aside:
  /// [part][unknown], the same terms and pixels whatever the share.
  Evaluation evaluate(const std::vector<double>& theta, const GatedImage& target, std::uint32_t iteration,
                      Share share = {}, std::vector<std::vector<double>>* parts = nullptr) const;

  /// Products of the transposed Jacobian of the images at theta, as `evaluate` samples it, with images, which share its samples. theta must
  /// be one that can_render() accepts.
  std::vector<std::vector<double>> transpose_apply(const std::vector<double>& theta, std::span<const GatedImage> images,
                                                   std::uint32_t iteration) const;
  std::vector<double> transpose_apply(const std::vector<double>& theta, const GatedImage& image,
                                      std::uint32_t iteration) const {
    return std::move(transpose_apply(theta, {&image, 1}, iteration)[0]);
  }

  /// Central difference of the images along one unknown with common random numbers. Where theta +- step
  /// leaves the bounds, the difference is taken between the bound and the other side.
  GatedImage finite_difference(const std::vector<double>& theta, int component, const Stream& stream,
                               SampleRange range) const;

  /// Whether paths can change their length, gates jump, and no samples are there for that.
  bool leaves_out_jumps() const;

  /// Whether derivatives are differences of images.
  bool by_differences() const;

 private:
  /// transpose_apply() by a share of the samples, by differences of images or by the terms of derivatives. `parts`: see evaluate(), of the
  /// first image.
  std::vector<std::vector<double>> apply_differences(const std::vector<double>& theta,
                                                     std::span<const GatedImage> images, std::uint32_t iteration,
                                                     Share share, ProgressStage& stage,
                                                     std::vector<std::vector<double>>* parts = nullptr) const;
  std::vector<std::vector<double>> apply_terms(const Renderer& renderer, const TangentBasis& basis,
                                               std::span<const GatedImage> images, std::uint32_t iteration, Share share,
                                               ProgressStage& stage,
                                               std::vector<std::vector<double>>* parts = nullptr) const;
  /// Steps of a ProgressStage that a gradient is.
  int gradient_steps() const;
  EstimatorOptions guided(EstimatorOptions options, int visibility_samples) const;
  /// As `target.histograms` says, in the readings and in the scene.
  void leave_out_histograms();
  /// The histograms of an iteration that redraws them.
  Readings drawn_readings(std::uint32_t iteration) const;
  LossEstimate loss(const SplitImage& image, const GatedImage& target, const std::vector<double>& theta,
                    const ReadingLoss& rho) const;

  /// Renders `samples` in parts: use(image, samples, index of the part of so many).
  template <class F>
  void render_parts(const std::vector<double>& theta, const EstimatorOptions& options, const Stream& stream,
                    int samples, const std::string& stage, F&& use) const;

  /// The name of a light at the camera that parameters move away from it; empty where there is none.
  std::string light_that_leaves_the_camera() const;

  /// What `sampling: auto` has chosen in its trials.
  struct ChosenEstimators {
    std::array<std::optional<EstimatorOptions>, 2> estimator;  ///< per purpose
    std::optional<EstimatorOptions> image_estimator;
  };

  static std::uint32_t pass_number(Pass pass) { return static_cast<std::uint32_t>(pass); }

  Experiment experiment_;
  Scene scene_;
  std::optional<GatedImage> counts_;  ///< of the target's file; reading them may set the gates' bins
  GateSet gates_;
  Readings readings_, all_readings_;  ///< all: with the histograms that are left out
  double share_of_histograms_ = 1;    ///< that `target.histograms` leaves of those that count without it
  std::unique_ptr<Parameters> parameters_;
  CasterUpdate caster_update_;
  std::unique_ptr<SceneCache> cache_;
  Preconditioner preconditioner_;
  QuadraticPenalty penalty_;
  int evaluations_;  ///< of the loss gradient
  mutable ChosenEstimators chosen_;
  using Choice = std::tuple<std::array<int, 4>, std::uint64_t, int>;
  Choice choice_;                                     ///< samples, seed and evaluations that chosen_ belongs to
  std::map<Choice, ChosenEstimators> chosen_before_;  ///< earlier values of chosen_, by choice
};

Pass pass_of(Term term);

/// Gated images from two halves of a range, each of which is a range by itself: independent of each other, with
/// low-discrepancy numbers of their own. The first half has one sample more where their number is odd.
SplitImage render_halves(const Renderer& renderer, const Stream& stream, SampleRange range);

void set_loss(const LossEstimate& estimate, Evaluation& into);

/// Average of images weighted by their samples.
class ImageMean {
 public:
  void add(const GatedImage& image, int samples);
  GatedImage mean() const;

 private:
  GatedImage sum_;
  long long samples_ = 0;
};

}  // namespace isochron
