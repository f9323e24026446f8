#include "core/render/measure_mix.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/render/technique_trial.h"

namespace isochron {
namespace {

/// Widths of gates, relative to the path length, between which standard sampling and connections are both tried. Outside one of
/// them is far better in every scene measured. Gates that together cover less than the lower one are hit by standard sampling so rarely that it
/// looks too quiet in a trial.
struct TrialWidths {
  double below_is_ellipsoidal, above_is_standard;
};
constexpr TrialWidths kImage{0.002, 0.1}, kInterior{0.008, 0.2};

constexpr double kNone = std::numeric_limits<double>::infinity();

/// Per pixel and batch. What low-discrepancy numbers gain in a pixel grows with the samples, in standard sampling above all, which takes
/// least: on the cube under gates of 10 % sixteen vary five to seven times less than as many independent ones. In sums techniques
/// whose points cover the whole image gain as much with few.
constexpr int kSamples = 2, kSamplesOfStandard = 16;
/// Before images are larger. Sums over blocks vary together, so that only batches say more about them.
constexpr int kMostBatches = 32, kFewestBatches = 4, kFewestBatchesOfSums = 16;
/// At most, and, where the job is small, at least: where pixels are larger, connections from the camera look better.
constexpr int kPixels = 4096, kFewestPixels = 576;
/// Of a first batch, which tells what each mix takes, and at least where there are no connections.
constexpr int kTinyPixels = 144;
/// Of the sums that a trial keeps.
constexpr double kMostValues = 1 << 23;
constexpr int kBlocks = 4;  ///< across the image
/// The part of the samples with light subpaths, where standard sampling uses them: of shares from 0.2 to 0.8 the best costs a fifth
/// less at most (isochron_light_share).
constexpr double kLightShare = 0.5;
/// The work of a trial is this part of that of the job at most.
constexpr double kTrialPart = 0.1;
/// To prepare a scene takes about as long as so many samples per triangle (70 000 triangles: 90 ms).
constexpr double kSamplesPerTriangle = 0.3;
/// Samples of standard sampling whose work a first batch may take, for each pair of mixes and each term: where one by connections
/// takes 25 times as much.
constexpr double kFewestBudget = 8000;

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

/// Decides what images or derivatives are found by.
struct MixChoice {
  const Scene& scene;
  const GateSet& gates;
  const EstimatorOptions& options;
  const TangentBasis* column;  ///< of the derivative; null: of images
  bool sums;                   ///< over blocks of pixels count, not pixels
  double samples;              ///< per pixel that it decides about
  const Job& job;

  /// What one sample of each term took, by each mix: of images, `paths` alone.
  struct Found {
    TrialBatches paths, jumps, boundaries;
  };

  int block_of(const Scene& small) const { return sums ? std::max(1, small.camera.width / kBlocks) : 1; }
  int samples_of(const PathMix& mix, const Scene& small) const {
    return mix.connections || block_of(small) > 1 ? kSamples : kSamplesOfStandard;
  }

  /// So many batches by each. `work` grows by what they took.
  std::vector<Found> run(const Scene& small, std::span<const PathMix> mixes, int batches, const Stream& stream,
                         double& work) const {
    const int block = block_of(small);
    SceneCache cache(small, CasterUpdate::rebuild);
    std::vector<Found> found(mixes.size());
    for (std::size_t i = 0; i < mixes.size(); ++i) {
      const int per_batch = batches > 1 ? samples_of(mixes[i], small) : kSamples;
      const TechniqueTrial trial{small, gates, options, column, block, per_batch};
      const auto batches_of = [&](Term term) {
        const TrialBatches result = run_trial(trial, mixes[i], term, batches, stream, cache);
        work += result.learning + batches * trial.samples * result.work;
        return result;
      };
      found[i].paths = batches_of(Term::interior);
      if (column && job.path_length > 0) found[i].jumps = batches_of(Term::path_length);
      if (!column || !(job.visibility > 0)) continue;
      // One estimate for all: searches for boundaries are much the same whatever finds the paths, and their rare large contributions must
      // not decide between mixes.
      found[i].boundaries = i > 0 ? found[0].boundaries : batches_of(Term::visibility);
    }
    return found;
  }

  /// What a sample of the job takes, and its variance.
  double work_of(const Found& found) const {
    return found.paths.work + job.path_length * found.jumps.work + job.visibility * found.boundaries.work;
  }
  double variance_of(const Found& found, double of_paths) const {
    const auto part = [](const TrialBatches& of, double rate) { return rate > 0 ? of.variance / rate : 0; };
    return of_paths + part(found.jumps, job.path_length) + part(found.boundaries, job.visibility);
  }

  /// The mix that costs least; none where trials cannot tell. `work` is what trials of the same choice took before.
  std::optional<PathMix> best(std::span<const PathMix> mixes, const Stream& stream, double& work) const {
    const double affordable_samples =
        kTrialPart * pixels_of(scene) * samples - 2 * kSamplesPerTriangle * static_cast<double>(scene.triangles.size());
    const int terms = 1 + (column && job.path_length > 0) + (column && job.visibility > 0);
    if (!(affordable_samples >= kFewestBudget * terms * (static_cast<double>(mixes.size()) / 2))) return std::nullopt;
    // What each takes differs between scenes: a tiny image tells.
    const Scene tiny = reduced(scene, kTinyPixels);
    const int wanted = sums ? kFewestBatchesOfSums : kFewestBatches;
    double least = kNone, work_of_batch = 0;
    const std::vector<Found> first = run(tiny, mixes, 1, stream, work);
    for (std::size_t i = 0; i < mixes.size(); ++i) {
      least = std::min(least, work_of(first[i]));
      work_of_batch += samples_of(mixes[i], tiny) * (first[i].paths.work + first[i].jumps.work);
    }
    const TrialBatches& boundaries = first[0].boundaries;
    work_of_batch += samples_of(mixes[0], tiny) * boundaries.work + boundaries.learning / wanted;
    const double budget = affordable_samples * least / pixels_of(tiny) - work;
    const double affordable = budget / work_of_batch * pixels_of(tiny);  // pixels times batches
    const bool by_connections = std::ranges::any_of(mixes, &PathMix::connections);
    const double fewest = std::min<double>(by_connections ? kFewestPixels : kTinyPixels, pixels_of(scene));
    if (!(affordable >= 2 * fewest)) return std::nullopt;
    const double most = std::min<double>(kPixels, kMostValues / (gates.size() * (scene.grey ? 1.0 : 3.0)));
    const Scene small = reduced(scene, std::clamp(affordable / wanted, fewest, std::max(fewest, most)));
    // As many samples as of images of the fewest pixels, where there are not as many pixels.
    const double most_batches = std::max<double>(kMostBatches, wanted * kFewestPixels / pixels_of(small));
    const auto batches = static_cast<int>(std::min(most_batches, affordable / pixels_of(small)));
    if (batches < 2) return std::nullopt;
    const std::vector<Found> found = run(small, mixes, batches, stream, work);
    const bool others = std::ranges::any_of(found, [](const Found& f) { return f.paths.has_others; });
    double least_cost = kNone;
    std::optional<PathMix> best;
    for (std::size_t i = 0; i < mixes.size(); ++i) {
      if (others && mixes[i].connections) continue;
      double variance = found[i].paths.variance;
      // What light subpaths find is part of the second moment of standard sampling, too, even if its few samples missed it.
      if (!mixes[i].connections && mixes[i].light == 0)
        for (const Found& other : found)
          variance += std::max(0.0, other.paths.moment_without_light - found[i].paths.moment);
      // Nothing seen says nothing: a technique that never hit the gates is no good one.
      if (!(variance > 0)) continue;
      const double cost = variance_of(found[i], variance) * work_of(found[i]);
      if (cost < least_cost) {
        least_cost = cost;
        best = mixes[i];
      }
    }
    return best;
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
  const double width = gates.relative_width(), coverage = gates.relative_coverage();  // infinite for unbounded gates
  EstimatorOptions plain = options;
  plain.mix.reset();
  const SamplingMix by_width = sampling_mix(plain, gates, scene);
  // Next-event estimation finds light of one bounce.
  const bool light_is_open = !options.light && options.max_bounces > 1;
  const auto choose = [&](const TrialWidths& widths, PathMix otherwise, double samples, const TangentBasis* column) {
    const bool keeps_length = column && options.keep_length == true;  // standard sampling cannot
    std::vector<PathMix> mixes;
    for (const bool connections : {false, true}) {
      const bool open = connections ? keeps_length || width <= widths.above_is_standard
                                    : !keeps_length && coverage >= widths.below_is_ellipsoidal;
      if (!open) continue;
      mixes.push_back({connections, otherwise.light});
      if (light_is_open) mixes.push_back({connections, kLightShare});
    }
    // Where one of the two is left.
    if (!mixes.empty() && mixes.front().connections == mixes.back().connections)
      otherwise.connections = mixes.front().connections;
    const bool sums = column && purpose == Purpose::gradients;
    const MixChoice choice{scene, gates, options, column, sums, samples, job};
    double own_trials = 0;
    std::optional<PathMix> best = mixes.size() > 1 ? choice.best(mixes, stream, own_trials) : std::nullopt;
    if (!best) {
      // All mixes may take too much where those that the width of the gates leaves do not.
      const std::size_t before = mixes.size();
      std::erase_if(mixes, [&](const PathMix& mix) { return mix.connections != otherwise.connections; });
      if (mixes.size() > 1 && mixes.size() < before) best = choice.best(mixes, stream, own_trials);
    }
    work += own_trials;
    return best.value_or(otherwise);
  };
  SamplingMix best;
  const PathMix image = choose(kImage, {by_width.image_connections, by_width.image_light}, job.image, nullptr);
  best.image_connections = image.connections;
  best.image_light = image.light;
  if (!basis || basis->columns == 0) return best;
  const TangentBasis one = combined(*basis, stream);
  const PathMix interior =
      choose(kInterior, {by_width.interior_connections, by_width.interior_light}, job.interior, &one);
  best.interior_connections = interior.connections;
  best.interior_light = interior.light;
  return best;
}

}  // namespace isochron
