#include "core/render/passes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/base/error.h"
#include "core/base/partition_sum.h"
#include "core/base/progress.h"
#include "core/techniques/ellipsoidal.h"
#include "core/techniques/light_subpaths.h"
#include "core/techniques/primary_boundary.h"
#include "core/techniques/sample_points.h"
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
  if (gates.shape().is_dirac()) check_dirac();
  // The two sides of a pair cancel the better the closer they are: by about this factor coupling lowers the variance
  // (measured on the cube and the box, 0.1 % to 10 %).
  if (options.antithetic) pair_coupling_gain_ = 1 + 0.1 / gates.relative_width();
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
  GatePass lengths;
  lengths.value = true;
  run_paths(worker, mix.image, {}, mix.image_light, lengths, pass, partition);
  count(worker);
}

void Passes::run_term(Term term, const Pass& pass, Partition partition, const GatePick& pick, Sink& sink) const {
  Worker worker(scene, gates, options, pick, sink);
  GatePass lengths;
  if (term == Term::interior) {
    lengths.value = true;
    lengths.pairs = interior_pairs();
    if (lengths.pairs) lengths.use = kValueOnly;
    run_paths(worker, mix.interior, mix.interior_rates, mix.interior_light, lengths, pass, partition);
  } else if (term == Term::path_length) {
    lengths.pairs = true;
    lengths.part = PairPart::dirac;
    lengths.coupled = options.antithetic;
    run_paths(worker, 1, mix.path_length_rates, mix.interior_light, lengths, pass, partition);
  } else {
    run_visibility(worker, pass, partition);
  }
  count(worker);
}

bool Passes::interior_pairs() const {
  return mix.interior > 0 && options.antithetic && scene.differentiable.lengths && any_slope();
}

void Passes::run_paths(Worker& worker, double share, const ConnectionRates& rates, double light,
                       const GatePass& lengths, const Pass& pass, Partition partition) const {
  const double scale = scene.scene.detector.gain / pass.range.count(), splat_scale = scale / scene.camera.pixels();
  const ConnectionRates used = share == 1 ? rates : ConnectionRates{};
  worker.balance.rates = {share, used, light / (1 - light), light > 0 ? 1.0 : 0.0, pair_coupling_gain_};
  GatePass single_lengths = lengths, pairs = lengths;
  single_lengths.pairs = false;
  pairs.value = false;
  const GatePass& of_walks = mix.keep_length ? single_lengths : lengths;
  EllipsoidalConnections connections(worker, of_walks), camera_lengths(worker, single_lengths),
      camera_pairs(worker, pairs);
  StandardPaths standard(worker, lengths.pairs);
  LightSubpaths light_subpaths(worker, lengths.pairs);
  const SamplePoints points(pass.stream, pass.range, options.numbers, partition.samples(scene.camera.pixels()));
  const PointSet of_lengths = points.of_image(Technique::camera_lengths);
  const PointSet of_pairs = points.of_image(Technique::camera_pairs);
  for_each_pixel(partition, scene.camera.pixels(), [&](int pixel) {
    const bool from_camera = !scene.captures();
    if (lengths.value && from_camera)
      points.in_image(of_lengths, pixel, share * used.camera_lengths,
                      [&](Rng& rng) { camera_lengths.sample_from_camera(splat_scale / used.camera_lengths, rng); });
    if (lengths.pairs && from_camera)
      points.in_image(of_pairs, pixel, share * used.camera_pairs,
                      [&](Rng& rng) { camera_pairs.sample_from_camera(splat_scale / used.camera_pairs, rng); });
    const double rate = worker.pick.rate(pixel), walks = rate * used.walk;
    if (of_walks.value || of_walks.pairs)
      points.in_pixel(Technique::walk, pixel, walks * share,
                      [&](Rng& rng) { connections.sample_walk(pixel, scale / walks, rng); });
    // Weights are per standard sample.
    const double others = 1 - share, standard_rate = rate * (1 - light);
    points.in_pixel(Technique::standard, pixel, standard_rate * others,
                    [&](Rng& rng) { standard.start(pixel, scale / standard_rate, rng); });
    points.in_pixel(Technique::light_subpath, pixel, rate * light * others, [&](Rng& rng) {
      light_subpaths.sample(pixel, scale / standard_rate, splat_scale / (1 - light), rng);
    });
  });
  standard.finish();
}

void Passes::run_visibility(Worker& worker, const Pass& pass, Partition partition) const {
  const double scale = scene.scene.detector.gain / pass.range.count(), splat_scale = scale / scene.camera.pixels();
  PrimaryBoundary primary(worker, edges(), *guide_, narrow());
  SecondaryBoundary secondary(worker, edges(), *guide_, narrow());
  const double edges_rate = guide_->rate(BoundaryGuide::primary),
               borders_rate = guide_->rate(BoundaryGuide::pixel_border),
               from_edge_rate = guide_->rate(BoundaryGuide::from_edge),
               from_light_rate = guide_->rate(BoundaryGuide::from_light),
               from_camera_rate = guide_->rate(BoundaryGuide::from_camera);
  const SamplePoints points(pass.stream, pass.range, options.numbers, partition.samples(scene.camera.pixels()));
  const PointSet of_edges = points.of_image(Technique::primary_edge);
  const PointSet of_borders = points.of_image(Technique::pixel_border);
  const PointSet of_segments = points.of_image(Technique::from_edge);
  const PointSet of_light_edges = points.of_image(Technique::from_light);
  for_each_pixel(partition, scene.camera.pixels(), [&](int pixel) {
    // Segments between surfaces or to a light: a capture's serve the pixel that they are drawn for, a camera's whichever sees
    // them.
    const auto segments = [&](Technique technique, const PointSet& of_image, double rate, auto&& sample) {
      const double own_rate = rate * worker.pick.rate(pixel);
      if (scene.captures())
        points.in_pixel(technique, pixel, own_rate, [&](Rng& rng) { sample(scale / own_rate, rng); });
      else
        points.in_image(of_image, pixel, rate, [&](Rng& rng) { sample(splat_scale / rate, rng); });
    };
    points.in_image(of_edges, pixel, edges_rate, [&](Rng& rng) { primary.sample(splat_scale / edges_rate, rng); });
    points.in_image(of_borders, pixel, borders_rate,
                    [&](Rng& rng) { primary.sample_pixel_border(splat_scale / borders_rate, rng); });
    segments(Technique::from_edge, of_segments, from_edge_rate,
             [&](double share, Rng& rng) { secondary.sample_from_edge(pixel, share, rng); });
    segments(Technique::from_light, of_light_edges, from_light_rate,
             [&](double share, Rng& rng) { secondary.sample_from_light(pixel, share, rng); });
    const double rate = from_camera_rate * worker.pick.rate(pixel);
    points.in_pixel(Technique::from_camera, pixel, rate,
                    [&](Rng& rng) { secondary.sample_from_camera(pixel, scale / rate, rng); });
  });
}

void Passes::learn() const {
  const PassTimes::Timed timed(times(), PassKind::edges);
  using Guide = BoundaryGuide;
  if (ready->edges)
    ready->edges->update(scene, options.boundary.wedge);
  else
    ready->edges.emplace(scene, options.boundary.wedge, cache_ ? &cache_->at_first() : nullptr);
  Guide::Each<bool> possible;
  const bool captures = scene.captures(), secondary_edges = edges().has_secondary();
  possible[Guide::primary] = edges().has_primary() && !captures;
  possible[Guide::pixel_border] = scene.flows.camera_possible();
  possible[Guide::from_edge] = secondary_edges && (!captures || options.max_bounces > 1);
  possible[Guide::from_light] =
      secondary_edges && !scene.lights.empty() && !(scene.confocal() && options.max_bounces == 1);
  possible[Guide::from_camera] = secondary_edges && (options.boundary.from_camera || captures);
  const Guide& unguided = guide_.emplace(possible);
  const auto searches = std::count(possible.begin(), possible.end(), true);
  if (searches == 0) return;
  const long long rounds =
      std::llround(options.guiding_samples * scene.camera.pixels() / static_cast<double>(searches));
  if (rounds < kFewestLearningRounds || captures) return;
  constexpr int kPartitions = kMostPartitions;  // their sums are few records
  std::vector<std::vector<GuideRecord>> records(kPartitions);
  std::vector<Guide::Each<double>> costs(kPartitions);
  SharedPartitions shared(kPartitions, partition_costs(PassKind::edges, kPartitions));
  shared.run([&](int partition) {
    GuideSink sink(gates, scene.layout, *basis);
    Worker worker(scene, gates, options, every_gate, sink);
    auto& cost = costs[partition];
    cost.fill(0);
    const auto run = [&](Guide::Search technique, auto&& search) {
      if (!possible[technique]) return;
      const double before = worker.work();
      search();
      cost[technique] += worker.work() - before;
    };
    PrimaryBoundary primary(worker, edges(), unguided, narrow());
    SecondaryBoundary secondary(worker, edges(), unguided, narrow());
    const double splat_scale = 1.0 / scene.camera.pixels();
    for (long long round = partition; round < rounds; round += kPartitions) {
      throw_if_stopped();
      const int pixel = static_cast<int>(round * scene.camera.pixels() / rounds) % scene.camera.pixels();
      Rng rng(kLearningStream, static_cast<std::uint64_t>(round), 0);
      run(Guide::primary, [&] { primary.sample(splat_scale, rng); });
      run(Guide::pixel_border, [&] { primary.sample_pixel_border(splat_scale, rng); });
      run(Guide::from_edge, [&] { secondary.sample_from_edge(0, splat_scale, rng); });
      run(Guide::from_light, [&] { secondary.sample_from_light(0, splat_scale, rng); });
      run(Guide::from_camera, [&] { secondary.sample_from_camera(pixel, 1, rng); });
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
    for (int t = 0; t < Guide::kTechniques; ++t) cost[t] += costs[partition][t];
  }
  guide_.emplace(possible, all, cost);
}

void Passes::count(const Worker& worker) const {
  rays_ += worker.rays;
  arcs_ += worker.arcs;
  if (cache_) cache_->count_rays(worker.rays);
}

}  // namespace isochron
