#include "core/render/measure_mix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/render/light_trial.h"
#include "core/render/technique_trial.h"

namespace isochron {
namespace {

/// Widths of gates, relative to the path length, between which a trial decides. Outside one technique is far better in every
/// scene measured. Gates that together cover less than the lower one are hit by standard sampling so rarely that it looks too
/// quiet in a trial.
struct TrialWidths {
  double below_is_ellipsoidal, above_is_standard;
};
constexpr TrialWidths kImage{0.002, 0.1}, kInterior{0.008, 0.2};

constexpr int kTrialSamples = 2;  ///< per pixel, batch and technique
/// Before images are larger. Sums over blocks vary together, so that only batches say more about them.
constexpr int kMostBatches = 32, kFewestBatches = 4, kFewestBatchesOfSums = 16;
/// At most, and, where the job is small, at least: where pixels are larger, connections from the camera look better.
constexpr int kPixels = 4096, kFewestPixels = 576;
/// Of the sums that a trial keeps.
constexpr double kMostValues = 1 << 23;
constexpr int kTinyPixels = 144;  ///< of a first batch, which tells what connections take
constexpr int kBlocks = 4;        ///< across the image
/// By what low-discrepancy numbers lower the variance of pixels under standard sampling, where trials do without: about 2 on the
/// cube, 0.8 in the Cornell box (isochron_technique_trial: costs of trials against those of 64 samples).
constexpr double kGainOfStandard = 1.3;
/// The work of all trials is this part of that of the job at most; that of light subpaths takes its part of it.
constexpr double kTrialPart = 0.1, kLightTrialPart = 0.04;
/// To prepare a scene takes about as long as so many samples per triangle (70 000 triangles: 90 ms).
constexpr double kSamplesPerTriangle = 0.3;
/// Samples of standard sampling whose work a first batch may take: where one by connections takes 25 times as much.
constexpr double kFewestBudget = 8000;
/// Paths of the trial of light subpaths at most and, where the job is small, at least, what each takes in paths by standard
/// sampling (one without and one with light subpaths and all their joints).
constexpr double kLightPaths = 16384, kFewestLightPaths = 400, kLightWork = 6;

double pixels_of(const Scene& scene) {
  return double{1} * scene.camera.width * scene.camera.height;
}

/// The camera's image in at most so many pixels, without background, which does not vary.
Scene reduced(const Scene& scene, double pixels) {
  Scene small = scene;
  small.detector.background.assign(small.detector.background.size(), 0.0);
  const double factor = std::sqrt(pixels / pixels_of(scene));
  if (factor < 1) {
    // Whole pixels, so that the fields of view still agree across the width; the height may lose part of a
    // pixel.
    small.camera.width = std::max(1, static_cast<int>(factor * scene.camera.width));
    small.camera.height = std::max(1, scene.camera.height * small.camera.width / scene.camera.width);
  }
  return small;
}

/// One direction: the sum of all columns of the basis with random signs.
TangentBasis combined(const TangentBasis& basis, const Stream& stream) {
  std::vector<double> sign;
  Rng rng(stream, 0, 0);
  for (int column = 0; column < basis.columns; ++column) sign.push_back(rng.uniform() < 0.5 ? -1 : 1);
  return basis.combined(sign);
}

/// Decides between standard sampling and connections.
struct TechniqueChoice {
  const Scene& scene;
  const GateSet& gates;
  EstimatorOptions options;
  const TangentBasis* column;  ///< of the interior term; null: of images
  bool sums;                   ///< over blocks of pixels count, not pixels
  double job;                  ///< samples per pixel that it decides about
  double part;                 ///< of the job's work, at most

  int block_of(const Scene& small) const { return sums ? std::max(1, small.camera.width / kBlocks) : 1; }

  /// Batches of standard sampling and of connections, each within a work of its own. `work` grows by what they took.
  std::array<TrialBatches, 2> run(const Scene& small, int batches, const std::array<double, 2>& most,
                                  const Stream& stream, double& work) const {
    const TechniqueTrial trial{small, gates, options, column, block_of(small), kTrialSamples};
    SceneCache cache(small, CasterUpdate::rebuild);
    std::array<TrialBatches, 2> found;
    for (const int t : {0, 1}) {
      found[t] = run_trial(trial, t == 1, batches, most[t], stream, cache);
      work += found[t].work * found[t].count;
    }
    return found;
  }

  /// Whether connections cost less, or `by_width` where trials cannot tell.
  bool connections(bool by_width, const Stream& stream, double& work) const {
    const double samples =
        part * pixels_of(scene) * job - 2 * kSamplesPerTriangle * static_cast<double>(scene.triangles.size());
    if (!(samples >= kFewestBudget)) return by_width;
    // What connections take differs between scenes: a tiny image tells.
    const Scene tiny = reduced(scene, kTinyPixels);
    const auto first = run(tiny, 1, {0, 0}, stream, work);
    const double both = first[0].work + first[1].work, least = std::min(first[0].work, first[1].work);
    const double budget = samples * least / (kTrialSamples * pixels_of(tiny)) - both;
    const double affordable = budget / both * pixels_of(tiny);  // pixels times batches
    const double fewest = std::min<double>(kFewestPixels, pixels_of(scene));
    if (!(affordable >= 2 * fewest)) return by_width;
    const double most = std::min<double>(kPixels, kMostValues / (gates.size() * (scene.grey ? 1.0 : 3.0)));
    const int wanted = sums ? kFewestBatchesOfSums : kFewestBatches;
    const Scene small = reduced(scene, std::clamp(affordable / wanted, fewest, std::max(fewest, most)));
    const auto batches = static_cast<int>(std::min<double>(kMostBatches, affordable / pixels_of(small)));
    const auto [standard, by_connections] =
        run(small, batches, {budget * first[0].work / both, budget * first[1].work / both}, stream, work);
    if (standard.count < 2 || by_connections.count < 2) return by_width;
    if (standard.has_others) return false;
    // Nothing seen says nothing: a technique that never hit the gates is no good one.
    constexpr double kNone = std::numeric_limits<double>::infinity();
    const auto cost = [](const TrialBatches& of) { return of.variance > 0 ? of.variance * of.work : kNone; };
    const bool loses_evenness = block_of(small) == 1 && options.numbers == Numbers::low_discrepancy;
    const double of_standard = cost(standard) / (loses_evenness ? kGainOfStandard : 1),
                 of_connections = cost(by_connections);
    return std::min(of_standard, of_connections) == kNone ? by_width : of_connections < of_standard;
  }
};

}  // namespace

SamplingMix measure_mix(const Scene& scene, const GateSet& gates, const EstimatorOptions& options,
                        const TangentBasis* basis, const Stream& stream, Purpose purpose, const Job& job,
                        double* trial_work) {
  double own_work = 0;
  double& work = trial_work ? *trial_work : own_work;
  work = 0;
  if (options.sampling != Sampling::automatic || gates.shape().is_dirac() || scene.capture)
    return sampling_mix(options, gates, scene);
  const bool any_length = gates.shape().is_unbounded();
  const double width = any_length ? 1 : gates.relative_width(), coverage = any_length ? 1 : gates.relative_coverage();
  EstimatorOptions plain = options;
  plain.mix.reset();
  const SamplingMix by_width = sampling_mix(plain, gates, scene);
  SamplingMix best;
  // Next-event estimation finds light of one bounce.
  const bool light_is_open = !options.light && options.max_bounces > 1;
  const double part = kTrialPart - (light_is_open ? kLightTrialPart : 0);
  const auto choose_light = [&](const TrialWidths& widths, double samples, const TangentBasis* column) {
    const double budget = kLightTrialPart * pixels_of(scene) * samples -
                          kSamplesPerTriangle * static_cast<double>(scene.triangles.size());
    const double paths = std::min(kLightPaths, budget / kLightWork);
    if (!light_is_open || coverage < widths.below_is_ellipsoidal || !(paths >= kFewestLightPaths)) return 0.0;
    const Scene small = reduced(scene, std::min<double>(paths, kPixels));
    return light_subpaths_pay(small, gates, options, column, stream, paths, work) ? kLightShare : 0.0;
  };
  const auto choose = [&](const TrialWidths& widths, bool otherwise, double samples, const TangentBasis* column) {
    if (coverage < widths.below_is_ellipsoidal) return true;
    if (width > widths.above_is_standard) return false;
    EstimatorOptions trial = options;
    if (!trial.light) trial.light = column ? best.interior_light : best.image_light;
    const bool sums = column && purpose == Purpose::gradients;
    return TechniqueChoice{scene, gates, trial, column, sums, samples, part}.connections(otherwise, stream, work);
  };
  best.image_light = choose_light(kImage, job.image, nullptr);
  best.image_connections = choose(kImage, by_width.image_connections, job.image, nullptr);
  if (!basis || basis->columns == 0) return best;
  const TangentBasis one = combined(*basis, stream);
  best.interior_light = choose_light(kInterior, job.interior, &one);
  best.interior_connections = choose(kInterior, by_width.interior_connections, job.interior, &one);
  return best;
}

}  // namespace isochron
