// Passes over the samples: how the techniques share the samples of images and of each term of the derivative. What they
// find goes to a sink.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <mutex>
#include <optional>
#include <span>

#include "core/base/partition_sum.h"
#include "core/base/random.h"
#include "core/base/ranks.h"
#include "core/films/sinks.h"
#include "core/paths/options.h"
#include "core/render/scene_cache.h"
#include "core/techniques/boundary_guide.h"
#include "core/techniques/gate_pick.h"
#include "core/techniques/sample_points.h"
#include "core/techniques/target_lengths.h"
#include "core/techniques/worker.h"

namespace isochron {

/// One of `count` partitions of the work of a pass, a power of two. Blocks of pixels are dealt out to them in turn; where
/// there are fewer blocks than partitions, several share a block, each with a part of its pixels' samples.
struct Partition {
  int index, count;

  static int blocks(int pixels) { return (pixels + kPixelsPerBlock - 1) / kPixelsPerBlock; }
  /// How many parts, sets of blocks, the image is divided into: a power of two, not more than there are partitions.
  int pixel_parts(int pixels) const {
    return std::min(count, static_cast<int>(std::bit_ceil(static_cast<unsigned>(blocks(pixels)))));
  }
  int pixel_part(int pixels) const { return index % pixel_parts(pixels); }
  SamplePart samples(int pixels) const { return {index / pixel_parts(pixels), count / pixel_parts(pixels)}; }
};

/// A pass over samples [range) of every pixel.
struct Pass {
  const Stream& stream;
  SampleRange range;
};

/// A technique as a pass uses it.
struct TechniqueUse {
  Technique technique;
  double rate;  ///< samples per pixel and sample of the pass, on average; 0: none
  bool
      in_pixel;  ///< samples start in a pixel, which gets GatePick::rate times as many; else their points cover the whole image
  /// One sample, which starts in `pixel` or comes with it; contributions are scaled by `scale`.
  std::function<void(int pixel, double scale, Rng& rng)> sample;
};

/// The passes over a prepared scene. Safe to share between threads.
class Passes {
 public:
  /// `basis` says what moves; null or empty: nothing does. What this refers to must outlive it.
  Passes(const Scene& source, const GateSet& gate_set, const EstimatorOptions& estimator, const TangentBasis* tangent,
         SceneCache* cache);

  /// Number of partitions of a pass where each partition has so many sums of its own.
  int partitions_for(SampleRange range, std::size_t values) const;

  /// Whether the term can be other than zero, so that a pass over it is worth while.
  bool has(Term term) const;
  /// Whether every sample of images or of the term adds to its own pixel only, and pixels are statistically independent.
  bool stays_in_pixels() const { return mix.image_stays_in_pixels() || scene.captures(); }
  bool stays_in_pixels(Term term) const {
    return (term == Term::interior && mix.interior_stays_in_pixels()) || scene.captures();
  }

  /// Whether the term draws lengths from the gates.
  bool draws_lengths(Term term) const { return term == Term::path_length || mix.interior_connections; }

  /// To be called before a term is run: the visibility term needs its edges, and its guiding learns. What is learned depends
  /// on scene, gates, basis and options alone.
  void prepare(Term term) const;

  /// One partition of the images. `sink` is not differential.
  void run_images(const Pass& pass, Partition partition, Sink& sink) const;
  /// One partition of a term of the derivative, which was prepared; gates and pixels by `pick`. `sink` is differential.
  void run_term(Term term, const Pass& pass, Partition partition, const GatePick& pick, Sink& sink) const;

  const GateSet gates;  ///< as the detector's time offset shifts them
  const EstimatorOptions options;
  const TangentBasis* const basis;
  const SamplingMix mix;  ///< what the options resolve to
  const std::shared_ptr<ReadyScene> ready;
  const PreparedScene& scene;
  const GatePick every_gate;  ///< all gates and pixels alike

  /// Rays traced so far by all ranks. Collective: every rank has to call it.
  long long rays() const { return sum_over_ranks(counted(counts_).rays); }
  /// Work done so far by all ranks, in rays. Collective.
  double work() const { return in_rays_over_ranks(counted(counts_)); }
  /// Of the samples of one technique so far. Collective.
  double work_of(Technique technique) const {
    return in_rays_over_ranks(counted(counts_of_[static_cast<std::size_t>(technique)]));
  }

  /// Where the time of a pass counts; null: nowhere.
  PassTimes* times() const { return cache_ ? &cache_->times() : nullptr; }

  /// What the partitions of a pass took when it was last run with as many; null: not known.
  PartitionCosts* partition_costs(PassKind kind, int partitions) const {
    return cache_ && rank_count() > 1 ? &cache_->partition_costs(kind, partitions) : nullptr;
  }

  /// The sum of what run(partition) makes of each.
  template <class Sum, class Run>
  Sum sum_of(PassKind kind, int partitions, Run&& run) const {
    SharedPartitions shared(partitions, partition_costs(kind, partitions));
    return sum_of_partitions<Sum>(shared, run);
  }

  /// The same for so many images: run(films, partition) adds to a film for each. [image][pixel].
  template <class Run>
  ListedSum sum_of_films(PassKind kind, SampleRange range, int images, Run&& run) const {
    const int channels = scene.scene.grey ? 1 : 3;
    const std::size_t size = static_cast<std::size_t>(scene.pixels()) * gates.size() * channels;
    const int partitions = partitions_for(range, size * images);
    return sum_of<ListedSum>(kind, partitions, [&](int partition) {
      ListedSum own(size * images);
      std::vector<Film> films;
      for (int image = 0; image < images; ++image) films.emplace_back(gates.size(), channels, own, image * size);
      run(films, Partition{partition, partitions});
      own.finish();
      return own;
    });
  }

  /// Runs f(pixel) for the pixels of one partition, in a fixed order.
  template <class F>
  static void for_each_pixel(Partition partition, int pixels, F&& f) {
    const int stride = partition.pixel_parts(pixels) * kPixelsPerBlock;
    for (int block = partition.pixel_part(pixels) * kPixelsPerBlock; block < pixels; block += stride)
      for (int pixel = block; pixel < std::min(block + kPixelsPerBlock, pixels); ++pixel) f(pixel);
  }

 private:
  /// Throws InputError where Dirac gates ask for what no technique finds.
  void check_dirac() const;

  /// Whether derivatives may act on the gates: where paths keep their lengths, those do by which the camera sees an emitter.
  bool any_slope() const { return !mix.keep_length || scene.emitters.seen_by_camera; }

  /// Camera paths by standard sampling and, this part of the samples, with light subpaths.
  void run_standard(Worker& worker, double light, const Pass& pass, Partition partition) const;
  /// Camera paths by ellipsoidal connections for such lengths; with light subpaths where `light` is not zero.
  void run_connections(Worker& worker, const GatePass& lengths, double light, const Pass& pass,
                       Partition partition) const;
  struct Searches;
  void run_visibility(Worker& worker, const Pass& pass, Partition partition) const;
  /// All samples of a partition by techniques; their work counts as theirs.
  void visit(std::span<const TechniqueUse> uses, Worker& worker, const Pass& pass, Partition partition) const;
  BoundaryGuide::Each<bool> possible_searches() const;

  void learn() const;

  WorkCounts counted(const WorkCounts& of) const {
    const std::scoped_lock lock(counts_mutex_);
    return of;
  }
  static double in_rays_over_ranks(const WorkCounts& of) {
    return WorkCounts{sum_over_ranks(of.rays), sum_over_ranks(of.arcs), sum_over_ranks(of.segments)}.in_rays();
  }

  /// Adds the work of a worker that has done its work.
  void count(const Worker& worker) const;

  const BoundaryEdges& edges() const { return *ready->edges; }

  SceneCache* const cache_;
  mutable std::mutex counts_mutex_;
  mutable WorkCounts counts_;
  mutable std::array<WorkCounts, kTechniques> counts_of_;
  mutable std::once_flag learned_;
  mutable std::optional<BoundaryGuide> guide_;  ///< only of the visibility term
};

}  // namespace isochron
