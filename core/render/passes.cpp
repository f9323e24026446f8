#include "core/render/passes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/base/error.h"
#include "core/base/progress.h"
#include "core/techniques/ellipsoidal.h"
#include "core/techniques/light_subpaths.h"
#include "core/techniques/primary_boundary.h"
#include "core/techniques/secondary_boundary.h"
#include "core/techniques/standard_paths.h"

namespace isochron {
namespace {

/// The learning pass has random numbers of its own; with fewer searches by each technique it would teach noise.
constexpr Stream kLearningStream{0x6c6561726e696e67u, 0, 0};
constexpr long long kFewestLearningRounds = 64;

/// Of p from the points of a triangle, the least and the largest.
std::pair<double, double> distances(const Vec3& p, const std::array<Vec3, 3>& corners) {
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
  const Vec3 n = normalize(cross(corners[1] - corners[0], corners[2] - corners[0]));
  bool holds_foot = true;
  for (int i = 0; i < 3; ++i) {
    const Vec3 along = corners[(i + 1) % 3] - corners[i], d = p - corners[i];
    const double s = std::clamp(dot(d, along) / length_squared(along), 0.0, 1.0);
    nearest = std::min(nearest, length(d - along * s));
    farthest = std::max(farthest, length(d));
    holds_foot &= dot(cross(along, d), n) >= 0;
  }
  if (holds_foot) nearest = std::abs(dot(p - corners[0], n));
  return {nearest, farthest};
}

std::shared_ptr<ReadyScene> ready_scene(const Scene& source, const TangentBasis* basis, const FollowOptions& follow,
                                        SceneCache* cache) {
  if (cache) return cache->take(source, basis, follow);
  return std::shared_ptr<ReadyScene>(new ReadyScene{PreparedScene(source, basis, follow), std::nullopt});
}

}  // namespace

Passes::Passes(const Scene& source, const GateSet& gate_set, const EstimatorOptions& estimator,
               const TangentBasis* tangent, SceneCache* cache)
    :  // A detector delay of t equals gates shifted by -t. Offsets of single pixels are in their paths' lengths.
      gates(source.detector.time_offset.size() > 1 || source.detector.time_offset[0] == 0
                ? gate_set
                : gate_set.shifted(-source.detector.time_offset[0])),
      options(estimator),
      basis(tangent),
      mix(sampling_mix(estimator, gates, source)),
      ready(ready_scene(source, tangent, {estimator.follow_radius, estimator.follow, mix.keep_length}, cache)),
      scene(ready->scene),
      every_gate(gates),
      cache_(cache) {
  const bool derives = basis && basis->columns > 0;
  if (derives && options.keep_length == true && !mix.keep_length)
    throw InputError(
        "estimator.keep_length: paths cannot keep their lengths in captures, with lights without an extent, glass, "
        "standard sampling or "
        "gates of any length (allowed here: false)");
  if (options.light.value_or(0) > 0 && scene.captures())
    throw InputError("estimator.light: paths of captures have no light subpaths (allowed here: 0)");
  if (gates.shape().is_dirac()) check_dirac();
}

void Passes::check_dirac() const {
  if (options.sampling == Sampling::standard)
    throw InputError(
        "estimator.sampling: standard sampling finds no path of exactly the length of a dirac gate (allowed: "
        "auto, ellipsoidal)");
  if (!basis || basis->columns == 0) return;
  if (!mix.keep_length)
    throw InputError(
        "gates.kind: derivatives under dirac gates need paths that keep their lengths: a camera, emitters that are all "
        "shapes, no glass, and no `keep_length: false` (allowed here: any other kind, or gradient.method: "
        "finite_difference)");
  if (!scene.differentiable.lengths) return;
  for (const int t : scene.emitters.triangles()) {
    if (!(scene.height_over(t, scene.camera.position) > 0)) continue;
    const auto corners = scene.corners(t);
    if (scene.camera.misses_image(corners[0], corners[1], corners[2])) continue;
    const auto [nearest, farthest] = distances(scene.camera.position, corners);
    for (int g = 0; g < gates.size(); ++g)
      if (gates.center(g) >= nearest && gates.center(g) <= farthest)
        throw InputError(fmt::format(
            "gates.centers: the camera may see the emitter '{}' at the length {:.6g}, where a derivative "
            "under dirac gates is not known (allowed: lengths outside of {:.6g} to {:.6g}, or any other kind)",
            scene.shape_of(t).name, gates.center(g), nearest, farthest));
  }
}

int Passes::partitions_for(SampleRange range, std::size_t values) const {
  // A small image always gets the fewest, so that a derivative has the same bits whether rendered singly or among others.
  const unsigned blocks = Partition::blocks(scene.camera.pixels());
  const int most = std::max(kFewestPartitions, static_cast<int>(std::bit_ceil(blocks)));
  return std::min(most, partition_count(double{1} * scene.camera.pixels() * range.count(), values));
}

bool Passes::has(Term term) const {
  if (!scene.differentiable.any || scene.emitters.empty()) return false;
  if (term == Term::interior) return true;
  const bool lengths = scene.differentiable.lengths;
  if (term == Term::visibility) return scene.differentiable.geometry || (lengths && mix.keep_length);
  return lengths && gates.shape().pair_mass(PairPart::dirac) > 0 && any_slope();
}

void Passes::prepare(Term term) const {
  if (term == Term::visibility) std::call_once(learned_, [this] { learn(); });
}

void Passes::run_images(const Pass& pass, Partition partition, Sink& sink) const {
  Worker worker(scene, gates, options, every_gate, sink);
  if (mix.image_connections)
    run_connections(worker, {.value = true}, mix.image_light, pass, partition);
  else
    run_standard(worker, mix.image_light, pass, partition);
  count(worker);
}

void Passes::run_term(Term term, const Pass& pass, Partition partition, const GatePick& pick, Sink& sink) const {
  Worker worker(scene, gates, options, pick, sink);
  if (term == Term::visibility) {
    run_visibility(worker, pass, partition);
  } else if (term == Term::path_length) {
    const GatePass jumps{.pairs = true, .part = PairPart::dirac, .coupled = options.antithetic};
    run_connections(worker, jumps, mix.interior_light, pass, partition);
  } else if (mix.interior_connections) {
    const bool pairs = options.antithetic && scene.differentiable.lengths && any_slope();
    const GateUse use = pairs ? GateUse::value_only : GateUse::value_and_slope;
    run_connections(worker, {.value = true, .use = use, .pairs = pairs}, mix.interior_light, pass, partition);
  } else {
    run_standard(worker, mix.interior_light, pass, partition);
  }
  count(worker);
}

void Passes::visit(std::span<const TechniqueUse> uses, Worker& worker, const Pass& pass, Partition partition) const {
  const int pixels = scene.camera.pixels();
  const double scale = scene.scene.detector.gain / pass.range.count();
  const SamplePart part = partition.samples(pixels);
  const auto points = [&](const TechniqueUse& use, int place) {
    return PointSet(pass.stream, use.technique, place, pass.range, options.numbers);
  };
  std::vector<PointSet> of_image;
  for (const TechniqueUse& use : uses) of_image.push_back(points(use, GatePick::kImage));
  for_each_pixel(partition, pixels, [&](int pixel) {
    if (scene.leaves_out(pixel)) return;
    for (std::size_t i = 0; i < uses.size(); ++i) {
      const TechniqueUse& use = uses[i];
      const double rate = use.in_pixel ? use.rate * worker.pick.rate(pixel) : use.rate;
      if (!(rate > 0)) continue;
      const double own_scale = use.in_pixel ? scale / rate : scale / pixels / rate;
      worker.sink.note_technique(use.technique);
      const WorkCounts before = worker.counts;
      const double count = rate * pass.range.count();
      const auto sample = [&](Rng& rng) { use.sample(pixel, own_scale, rng); };
      if (use.in_pixel)
        points(use, pixel).visit(count, 0, part, sample);
      else
        of_image[i].visit(count, pixel, part, sample);
      worker.work_of[static_cast<std::size_t>(use.technique)] += worker.counts - before;
    }
  });
}

void Passes::run_standard(Worker& worker, double light, const Pass& pass, Partition partition) const {
  worker.balance.light_rate = light_rate(light);
  StandardPaths standard(worker);
  LightSubpaths light_subpaths(worker);
  const TechniqueUse uses[] = {
      {Technique::standard, 1 - light, true,
       [&](int pixel, double scale, Rng& rng) { standard.start(pixel, scale, rng); }},
      {Technique::light_subpath, light, true,
       [&](int pixel, double scale, Rng& rng) { light_subpaths.sample(pixel, scale, rng); }},
  };
  visit(uses, worker, pass, partition);
  worker.sink.note_technique(Technique::standard);
  const WorkCounts before = worker.counts;
  standard.finish();
  worker.work_of[static_cast<std::size_t>(Technique::standard)] += worker.counts - before;
}

void Passes::run_connections(Worker& worker, const GatePass& lengths, double light, const Pass& pass,
                             Partition partition) const {
  worker.balance.light_connections = light > 0 && options.max_bounces > 1;
  GatePass single_lengths = lengths, pairs = lengths;
  single_lengths.pairs = false;
  pairs.value = false;
  const GatePass& of_walks = mix.keep_length ? single_lengths : lengths;
  EllipsoidalConnections connections(worker, of_walks), camera_lengths(worker, single_lengths),
      camera_pairs(worker, pairs);
  const auto if_so = [](bool used) { return used ? 1.0 : 0.0; };
  const bool from_camera = !scene.captures();
  const TechniqueUse uses[] = {
      {Technique::camera_lengths, if_so(from_camera && lengths.value), false,
       [&](int, double scale, Rng& rng) { camera_lengths.sample_from_camera(scale, rng); }},
      {Technique::camera_pairs, if_so(from_camera && lengths.pairs), false,
       [&](int, double scale, Rng& rng) { camera_pairs.sample_from_camera(scale, rng); }},
      {Technique::walk, if_so(of_walks.value || of_walks.pairs), true,
       [&](int pixel, double scale, Rng& rng) { connections.sample_walk(pixel, scale, rng); }},
  };
  visit(uses, worker, pass, partition);
}

/// What searches for boundaries.
struct Passes::Searches {
  PrimaryBoundary primary;
  SecondaryBoundary secondary;

  Searches(const Passes& passes, Worker& worker, const BoundaryGuide& guide)
      : primary(worker, passes.edges(), guide, passes.mix.interior_connections),
        secondary(worker, passes.edges(), guide, passes.mix.interior_connections) {}

  /// Segments between surfaces or to a light: a capture's serve the pixel that they are drawn for, a camera's whichever sees
  /// them.
  std::array<TechniqueUse, BoundaryGuide::kSearches> uses(const BoundaryGuide& guide, bool captures) {
    const auto use = [&](Technique t, bool in_pixel, auto&& sample) {
      return TechniqueUse{t, guide.rate(t), in_pixel, sample};
    };
    return {use(Technique::primary_edge, false, [this](int, double scale, Rng& rng) { primary.sample(scale, rng); }),
            use(Technique::pixel_border, false,
                [this](int, double scale, Rng& rng) { primary.sample_pixel_border(scale, rng); }),
            use(Technique::from_edge, captures,
                [this](int pixel, double scale, Rng& rng) { secondary.sample_from_edge(pixel, scale, rng); }),
            use(Technique::from_light, captures,
                [this](int pixel, double scale, Rng& rng) { secondary.sample_from_light(pixel, scale, rng); }),
            use(Technique::from_camera, true,
                [this](int pixel, double scale, Rng& rng) { secondary.sample_from_camera(pixel, scale, rng); })};
  }
};

void Passes::run_visibility(Worker& worker, const Pass& pass, Partition partition) const {
  Searches searches(*this, worker, *guide_);
  visit(searches.uses(*guide_, scene.captures()), worker, pass, partition);
}

BoundaryGuide::Each<bool> Passes::possible_searches() const {
  BoundaryGuide::Each<bool> possible;
  const auto set = [&](Technique t, bool value) { possible[BoundaryGuide::table(t)] = value; };
  const bool captures = scene.captures(), secondary = edges().has_secondary();
  set(Technique::primary_edge, edges().has_primary() && !captures);
  set(Technique::pixel_border, scene.flows.camera_possible());
  set(Technique::from_edge, secondary && (!captures || options.max_bounces > 1));
  set(Technique::from_light, secondary && !scene.lights.empty() && !(scene.confocal() && options.max_bounces == 1));
  set(Technique::from_camera, secondary && (options.boundary.from_camera || captures));
  return possible;
}

void Passes::learn() const {
  const PassTimes::Timed timed(times(), PassKind::edges);
  using Guide = BoundaryGuide;
  if (ready->edges)
    ready->edges->update(scene);
  else
    ready->edges.emplace(scene, options.boundary.wedge, cache_ ? &cache_->at_first() : nullptr);
  const Guide::Each<bool> possible = possible_searches();
  const Guide& unguided = guide_.emplace(possible);
  const auto count_possible = std::count(possible.begin(), possible.end(), true);
  if (count_possible == 0) return;
  const int pixels = scene.camera.pixels();
  const long long rounds = std::llround(options.guiding_samples * pixels / static_cast<double>(count_possible));
  if (rounds < kFewestLearningRounds || scene.captures()) return;
  constexpr int kPartitions = kMostPartitions;  // their sums are few records
  std::vector<std::vector<GuideRecord>> records(kPartitions);
  std::vector<Guide::Each<double>> costs(kPartitions);
  SharedPartitions shared(kPartitions, partition_costs(PassKind::edges, kPartitions));
  shared.run([&](int partition) {
    GuideSink sink(gates, scene.layout, *basis);
    Worker worker(scene, gates, options, every_gate, sink);
    auto& cost = costs[partition];
    cost.fill(0);
    Searches searches(*this, worker, unguided);
    const auto uses = searches.uses(unguided, false);
    for (long long round = partition; round < rounds; round += kPartitions) {
      throw_if_stopped();
      const int pixel = static_cast<int>(round * pixels / rounds) % pixels;
      Rng rng(kLearningStream, static_cast<std::uint64_t>(round), 0);
      for (const TechniqueUse& use : uses) {
        if (!(use.rate > 0)) continue;
        const double before = worker.counts.in_rays();
        use.sample(pixel, use.in_pixel ? 1 : 1.0 / pixels, rng);
        cost[Guide::table(use.technique)] += worker.counts.in_rays() - before;
      }
    }
    records[partition] = std::move(sink.records);
    count(worker);
  });
  all_gather_parts(shared.parts, records, costs, shared.costs);
  shared.keep_costs();
  std::vector<GuideRecord> all;
  Guide::Each<double> cost{};
  for (int partition = 0; partition < kPartitions; ++partition) {
    all.insert(all.end(), records[partition].begin(), records[partition].end());
    for (int t = 0; t < Guide::kSearches; ++t) cost[t] += costs[partition][t];
  }
  guide_.emplace(possible, all, cost);
}

void Passes::count(const Worker& worker) const {
  if (cache_) cache_->count_rays(worker.counts.rays);
  const std::scoped_lock lock(counts_mutex_);
  counts_ += worker.counts;
  for (int t = 0; t < kTechniques; ++t) counts_of_[t] += worker.work_of[t];
}

}  // namespace isochron
