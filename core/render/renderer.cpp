#include "core/render/renderer.h"

#include <atomic>
#include <mutex>
#include <stdexcept>

#include "core/render/ellipsoidal.h"
#include "core/render/ledger.h"
#include "core/render/parallel.h"
#include "core/render/primary_boundary.h"
#include "core/render/progress.h"
#include "core/render/sample_points.h"
#include "core/render/secondary_boundary.h"

namespace isochron {
namespace {

/// Work is cut into strands, each worked through in order with accumulators of its own, and merged in order: results
/// do not depend on which thread takes which strand. Their number depends on the accumulators' size alone.
constexpr int kMostStrands = 32, kFewestStrands = 8;
constexpr int kSharedStrands = 256;                           // where strands need no accumulators of their own
constexpr std::size_t kStrandBudget = std::size_t{64} << 20;  // bytes, all strands together
constexpr int kPixelsPerBlock = 8;

/// The pass that guiding learns from: its own random numbers; with fewer searches by each technique it would teach noise.
constexpr Stream kLearningStream{0x6c6561726e696e67u, 0, 0};
constexpr long long kFewestLearningRounds = 64;

int strand_count(std::size_t accumulator_doubles) {
  const std::size_t fitting = kStrandBudget / (sizeof(double) * std::max<std::size_t>(accumulator_doubles, 1));
  return static_cast<int>(std::clamp<std::size_t>(fitting, kFewestStrands, kMostStrands));
}

}  // namespace

const char* name(Term term) {
  switch (term) {
    case Term::interior:
      return "interior";
    case Term::visibility:
      return "visibility";
    case Term::path_length:
      return "path_length";
  }
  return "";
}

SamplingMix sampling_mix(const EstimatorOptions& options, const GateSet& gates) {
  // Narrow gates: below this share of the path length, standard sampling throws too many paths away.
  constexpr double kNarrow = 0.02;
  const double width = gates.relative_width();
  if (std::isinf(width) || options.sampling == Sampling::standard) return {0, 0};
  if (options.sampling == Sampling::ellipsoidal) return {1, 1};
  if (options.mix) return *options.mix;
  return width < kNarrow ? SamplingMix{1, 1} : SamplingMix{0, 0};
}

struct Renderer::Impl {
  using Guide = BoundaryGuide;

  const GateSet& gates;
  EstimatorOptions options;
  const TangentBasis* basis;
  PreparedScene scene;
  SamplingMix mix;
  double pair_gain = 1;
  GatePick every_gate;
  mutable std::atomic<long long> rays{0}, arcs{0};
  mutable std::once_flag learned;
  mutable std::optional<BoundaryEdges> edges;  ///< only the visibility term asks for them
  mutable std::optional<Guide> guide;          ///< likewise

  Impl(const Scene& source, const GateSet& gate_set, const EstimatorOptions& estimator, const TangentBasis* tangent)
      : gates(gate_set),
        options(estimator),
        basis(tangent),
        scene(source, tangent, {estimator.follow_radius, estimator.follow}),
        every_gate(gate_set) {
    const double width = gates.relative_width();
    mix = sampling_mix(options, gates);
    // The two sides of a pair cancel the better the closer they are: by about this factor coupling lowers the variance
    // (measured on the cube and the box, 0.1 % to 10 %).
    if (options.antithetic) pair_gain = 1 + 0.1 / width;
  }

  GatedImage blank() const {
    return GatedImage(scene.camera.width, scene.camera.height, gates.size(), scene.scene.grey ? 1 : 3);
  }

  /// Runs f(pixel) for the pixels of one strand, in a fixed order.
  template <class F>
  void for_each_pixel(int strand, int strands, F&& f) const {
    const int pixels = scene.camera.pixels();
    for (int block = strand * kPixelsPerBlock; block < pixels; block += strands * kPixelsPerBlock)
      for (int pixel = block; pixel < std::min(block + kPixelsPerBlock, pixels); ++pixel) f(pixel);
  }

  template <class Sink>
  void count(const Worker<Sink>& worker) const {
    rays += worker.rays;
    arcs += worker.arcs;
  }

  /// Camera paths: `share` of the samples by ellipsoidal connections, the others by standard sampling. `rates` hold where
  /// there are no others.
  template <class Sink>
  void run_paths(Worker<Sink>& worker, double share, const ConnectionRates& rates, const GatePass& pass, int strand,
                 int strands, const Stream& stream, SampleRange range) const {
    const double scale = 1.0 / range.count(), splat_scale = scale / scene.camera.pixels();
    const ConnectionRates& used = worker.rates = share == 1 ? rates : ConnectionRates{};
    worker.ellipsoidal_share = share;
    worker.pair_gain = pair_gain;
    GatePass lengths = pass, pairs = pass;
    lengths.pairs = false;
    pairs.value = false;
    EllipsoidalConnections connections(worker, pass), camera_lengths(worker, lengths), camera_pairs(worker, pairs);
    StandardPaths standard(worker, pass.pairs);
    const SamplePoints points(stream, range, options.numbers);
    const PointSet of_lengths = points.of_image(Technique::camera_lengths);
    const PointSet of_pairs = points.of_image(Technique::camera_pairs);
    for_each_pixel(strand, strands, [&](int pixel) {
      if (pass.value)
        points.in_image(of_lengths, pixel, share * used.camera_lengths,
                        [&](Rng& rng) { camera_lengths.sample_from_camera(splat_scale / used.camera_lengths, rng); });
      if (pass.pairs)
        points.in_image(of_pairs, pixel, share * used.camera_pairs,
                        [&](Rng& rng) { camera_pairs.sample_from_camera(splat_scale / used.camera_pairs, rng); });
      const double rate = worker.pick.rate(pixel), walks = rate * used.walk;
      points.in_pixel(Technique::walk, pixel, walks * share,
                      [&](Rng& rng) { connections.sample_walk(pixel, scale / walks, rng); });
      points.in_pixel(Technique::standard, pixel, rate * (1 - share),
                      [&](Rng& rng) { standard.start(pixel, scale / rate, rng); });
    });
    standard.finish();
    count(worker);
  }

  /// Whether the term can be other than zero, so that a pass over it is worth while.
  bool has(Term term) const {
    if (!scene.moving.any || scene.emitters.empty()) return false;
    if (term == Term::interior) return true;
    if (term == Term::visibility) return scene.moving.geometry;
    return scene.moving.lengths && gates.shape().pair_mass(jump_part()) > 0;
  }
  /// Whether the interior term takes the smooth part of dW in pairs.
  bool interior_pairs() const { return mix.interior > 0 && options.antithetic && scene.moving.lengths; }
  PairPart jump_part() const { return interior_pairs() ? PairPart::jumps : PairPart::atoms; }

  /// Before the visibility term is run. What is learned depends on scene, gates, basis and options alone.
  void learn() const {
    std::call_once(learned, [this] {
      edges.emplace(scene, options.boundary.wedge);
      Guide::Each<bool> possible;
      possible[Guide::primary] = edges->has_primary();
      possible[Guide::pixel_border] = scene.flows.camera_possible();
      possible[Guide::from_edge] = edges->has_secondary();
      possible[Guide::from_camera] = edges->has_secondary() && options.boundary.from_camera;
      const Guide& unguided = guide.emplace(possible);
      const auto searches = std::count(possible.begin(), possible.end(), true);
      if (searches == 0) return;
      const long long rounds =
          std::llround(options.guiding_samples * scene.camera.pixels() / static_cast<double>(searches));
      if (rounds < kFewestLearningRounds) return;
      std::vector<std::vector<GuideRecord>> records(kMostStrands);
      std::vector<Guide::Each<double>> costs(kMostStrands);
      parallel(kMostStrands, [&](int strand) {
        Worker worker(scene, gates, options, every_gate, GuideSink(gates, scene.layout, *basis));
        auto& cost = costs[strand];
        cost.fill(0);
        const auto run = [&](Guide::Technique technique, auto&& search) {
          if (!possible[technique]) return;
          const double before = worker.work();
          search();
          cost[technique] += worker.work() - before;
        };
        PrimaryBoundary primary(worker, *edges, unguided, mix.interior == 1);
        SecondaryBoundary secondary(worker, *edges, unguided, mix.interior == 1);
        const double splat_scale = 1.0 / scene.camera.pixels();
        for (long long i = strand; i < rounds; i += kMostStrands) {
          throw_if_stopped();
          const int pixel = static_cast<int>(i * scene.camera.pixels() / rounds) % scene.camera.pixels();
          Rng rng(kLearningStream, static_cast<std::uint64_t>(i), 0);
          run(Guide::primary, [&] { primary.sample(splat_scale, rng); });
          run(Guide::pixel_border, [&] { primary.sample_pixel_border(splat_scale, rng); });
          run(Guide::from_edge, [&] { secondary.sample_from_edge(splat_scale, rng); });
          run(Guide::from_camera, [&] { secondary.sample_from_camera(pixel, 1, rng); });
        }
        records[strand] = std::move(worker.sink.records);
        count(worker);
      });
      std::vector<GuideRecord> all;
      Guide::Each<double> cost{};
      for (int strand = 0; strand < kMostStrands; ++strand) {
        all.insert(all.end(), records[strand].begin(), records[strand].end());
        for (int t = 0; t < Guide::kTechniques; ++t) cost[t] += costs[strand][t];
      }
      guide.emplace(possible, all, cost);
    });
  }

  template <class Sink>
  void run_term(Term term, Worker<Sink>& worker, int strand, int strands, const Stream& stream,
                SampleRange range) const {
    GatePass pass;
    if (term == Term::interior) {
      pass.value = true;
      pass.pairs = interior_pairs();
      if (pass.pairs) pass.use = kValueOnly;
      run_paths(worker, mix.interior, mix.interior_rates, pass, strand, strands, stream, range);
    } else if (term == Term::path_length) {
      pass.pairs = true;
      pass.part = jump_part();
      pass.coupled = options.antithetic;
      run_paths(worker, 1, mix.path_length_rates, pass, strand, strands, stream, range);
    } else {
      const double scale = 1.0 / range.count(), splat_scale = scale / scene.camera.pixels();
      PrimaryBoundary primary(worker, *edges, *guide, mix.interior == 1);
      SecondaryBoundary secondary(worker, *edges, *guide, mix.interior == 1);
      const double edges_rate = guide->rate(Guide::primary), borders_rate = guide->rate(Guide::pixel_border),
                   from_edge_rate = guide->rate(Guide::from_edge), from_camera_rate = guide->rate(Guide::from_camera);
      const SamplePoints points(stream, range, options.numbers);
      const PointSet of_edges = points.of_image(Technique::primary_edge);
      const PointSet of_borders = points.of_image(Technique::pixel_border);
      const PointSet of_segments = points.of_image(Technique::from_edge);
      for_each_pixel(strand, strands, [&](int pixel) {
        points.in_image(of_edges, pixel, edges_rate, [&](Rng& rng) { primary.sample(splat_scale / edges_rate, rng); });
        points.in_image(of_borders, pixel, borders_rate,
                        [&](Rng& rng) { primary.sample_pixel_border(splat_scale / borders_rate, rng); });
        points.in_image(of_segments, pixel, from_edge_rate,
                        [&](Rng& rng) { secondary.sample_from_edge(splat_scale / from_edge_rate, rng); });
        const double rate = from_camera_rate * worker.pick.rate(pixel);
        points.in_pixel(Technique::from_camera, pixel, rate,
                        [&](Rng& rng) { secondary.sample_from_camera(pixel, scale / rate, rng); });
      });
      count(worker);
    }
  }
};

Renderer::Renderer(const Scene& scene, const GateSet& gates, const EstimatorOptions& options, const TangentBasis* basis)
    : impl_(std::make_unique<Impl>(scene, gates, options, basis)) {}
Renderer::~Renderer() = default;

bool Renderer::has(Term term) const {
  return impl_->has(term);
}
const SamplingMix& Renderer::mix() const {
  return impl_->mix;
}
long long Renderer::rays() const {
  return impl_->rays;
}
double Renderer::work() const {
  return isochron::work(impl_->rays, impl_->arcs);
}

GatedImage Renderer::render(const Stream& stream, SampleRange range) const {
  GatedImage image = impl_->blank();
  if (impl_->scene.emitters.empty()) return image;  // no lamp, or one that the parameters have flattened
  // Standard sampling adds to a path's own pixel alone, so that strands can share the image.
  const bool shared = impl_->mix.image == 0;
  const int strands = shared ? kSharedStrands : strand_count(image.data.size());
  std::vector<std::vector<double>> films(shared ? 0 : strands);
  parallel(strands, [&](int strand) {
    GatedImage own;
    if (!shared) own = impl_->blank();
    Worker worker(impl_->scene, impl_->gates, impl_->options, impl_->every_gate,
                  PrimalSink(impl_->gates, shared ? image : own));
    GatePass pass;
    pass.value = true;
    impl_->run_paths(worker, impl_->mix.image, {}, pass, strand, strands, stream, range);
    if (!shared) films[strand] = std::move(own.data);
  });
  if (!shared) merge(films, image.data);
  return image;
}

std::vector<GatedImage> Renderer::derive(Term term, const Stream& stream, SampleRange range) const {
  if (!impl_->basis) throw std::logic_error("derive: the renderer was made without a tangent basis");
  const int columns = impl_->basis->columns;
  std::vector<GatedImage> images(columns, impl_->blank());
  if (!impl_->has(term) || columns == 0) return images;
  if (term == Term::visibility) impl_->learn();
  const int strands = strand_count(images[0].data.size() * columns);
  std::vector<std::vector<std::vector<double>>> films(columns, std::vector<std::vector<double>>(strands));
  parallel(strands, [&](int strand) {
    std::vector<GatedImage> own(columns, impl_->blank());
    Worker worker(impl_->scene, impl_->gates, impl_->options, impl_->every_gate,
                  TangentSink(impl_->gates, impl_->scene.layout, *impl_->basis, own));
    impl_->run_term(term, worker, strand, strands, stream, range);
    for (int column = 0; column < columns; ++column) films[column][strand] = std::move(own[column].data);
  });
  for (int column = 0; column < columns; ++column) merge(films[column], images[column].data);
  return images;
}

void Renderer::add_gradient(Term term, const GatedImage& adjoint, const Stream& stream, SampleRange range,
                            std::vector<double>& dof_gradient) const {
  if (!impl_->basis) throw std::logic_error("add_gradient: the renderer was made without a tangent basis");
  if (!impl_->has(term)) return;
  if (term == Term::visibility) impl_->learn();
  const GatePick pick(impl_->gates, adjoint);
  const int strands = strand_count(impl_->basis->entries.size());  // at least as many as are touched
  std::vector<SparseSum> gradients(strands);
  parallel(strands, [&](int strand) {
    SparseSum own(dof_gradient.size());
    Worker worker(impl_->scene, impl_->gates, impl_->options, pick,
                  AdjointSink(impl_->gates, impl_->scene.layout, *impl_->basis, adjoint, own));
    impl_->run_term(term, worker, strand, strands, stream, range);
    gradients[strand] = std::move(own);
  });
  merge(gradients, dof_gradient);
}

ImageLedger Renderer::render_ledger(const Stream& stream, SampleRange range) const {
  const Impl& impl = *impl_;
  ImageLedger sum;
  const GatedImage shape = impl.blank();
  sum.image = GatedImage(shape.width, shape.height, shape.gates * (impl.options.max_bounces + 1), shape.channels);
  sum.by_shape.assign(impl.scene.scene.shapes.size(), 0.0);
  if (impl.scene.emitters.empty()) return sum;
  const ImageLedger blank = sum;
  const int strands = strand_count(sum.image.data.size());
  std::vector<std::vector<double>> films(strands), shapes(strands);
  parallel(strands, [&](int strand) {
    ImageLedger own = blank;
    Worker worker(impl.scene, impl.gates, impl.options, impl.every_gate, ImageLedgerSink(impl.scene, impl.gates, own));
    GatePass pass;
    pass.value = true;
    impl.run_paths(worker, impl.mix.image, {}, pass, strand, strands, stream, range);
    films[strand] = std::move(own.image.data);
    shapes[strand] = std::move(own.by_shape);
  });
  merge(films, sum.image.data);
  merge(shapes, sum.by_shape);
  return sum;
}

GradientLedger Renderer::gradient_ledger(Term term, std::span<const GatedImage> adjoints, const Stream& stream,
                                         SampleRange range) const {
  const Impl& impl = *impl_;
  if (!impl.basis) throw std::logic_error("gradient_ledger: the renderer was made without a tangent basis");
  const std::size_t entries = adjoints[0].data.size(), count = adjoints.size();
  GradientLedger sum;
  sum.adjoints = static_cast<int>(count);
  sum.columns = impl.basis->columns;
  const std::size_t columns = sum.columns;
  sum.by_bounces.assign((impl.options.max_bounces + 1) * columns * count, 0.0);
  sum.by_gate.assign(impl.gates.size() * columns, 0.0);
  sum.by_shape.assign(impl.scene.scene.shapes.size() * columns, 0.0);
  if (!impl.has(term) || columns == 0) return sum;
  if (term == Term::visibility) impl.learn();
  // Gates are picked by what they count for in any of the adjoints.
  std::vector<double> interleaved(entries * count);
  GatedImage largest = adjoints[0];
  for (std::size_t i = 0; i < entries; ++i) {
    double squares = 0;
    for (std::size_t j = 0; j < count; ++j) {
      const double a = interleaved[i * count + j] = adjoints[j].data[i];
      squares += a * a;
    }
    largest.data[i] = std::sqrt(squares);
  }
  const GatePick pick(impl.gates, largest);
  const GradientLedger blank = sum;
  const int strands = strand_count(blank.by_bounces.size() + blank.by_gate.size() + blank.by_shape.size());
  std::vector<std::vector<double>> bounces(strands), gates(strands), shapes(strands);
  parallel(strands, [&](int strand) {
    GradientLedger own = blank;
    Worker worker(impl.scene, impl.gates, impl.options, pick,
                  GradientLedgerSink(impl.scene, impl.gates, *impl.basis, largest.channels, interleaved, own));
    impl.run_term(term, worker, strand, strands, stream, range);
    bounces[strand] = std::move(own.by_bounces);
    gates[strand] = std::move(own.by_gate);
    shapes[strand] = std::move(own.by_shape);
  });
  merge(bounces, sum.by_bounces);
  merge(gates, sum.by_gate);
  merge(shapes, sum.by_shape);
  return sum;
}

}  // namespace isochron
