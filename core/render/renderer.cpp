#include "core/render/renderer.h"

#include <atomic>
#include <mutex>
#include <stdexcept>

#include "core/base/partition_sum.h"
#include "core/base/progress.h"
#include "core/films/breakdown_sinks.h"
#include "core/techniques/ellipsoidal.h"
#include "core/techniques/primary_boundary.h"
#include "core/techniques/sample_points.h"
#include "core/techniques/secondary_boundary.h"

namespace isochron {
namespace {

/// Work is cut into strands (partitions), each worked through in order with sums of its own, see partition_sum.h. So many
/// where strands need no sums of their own or learn.
constexpr int kStrands = kMostPartitions;
constexpr int kPixelsPerBlock = 8;

/// The pass that guiding learns from: its own random numbers; with fewer searches by each technique it would teach noise.
constexpr Stream kLearningStream{0x6c6561726e696e67u, 0, 0};
constexpr long long kFewestLearningRounds = 64;

void add_to(std::vector<double>& sum, const std::vector<double>& other) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += other[i];
}

}  // namespace

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

  /// Strands for a pass over samples [range) of every pixel, where each has so many sums of its own.
  int strands_for(SampleRange range, std::size_t values) const {
    return partition_count(double{1} * scene.camera.pixels() * range.count(), values);
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
    return scene.moving.lengths && gates.shape().pair_mass(PairPart::atoms) > 0;
  }
  /// Whether every sample of the term adds to its own pixel alone, and has no numbers in common with those of others.
  bool stays_in_pixels(Term term) const { return term == Term::interior && mix.interior == 0; }
  /// Whether the interior term takes the continuous part of dW in pairs.
  bool interior_pairs() const { return mix.interior > 0 && options.antithetic && scene.moving.lengths; }

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
      std::vector<std::vector<GuideRecord>> records(kStrands);
      std::vector<Guide::Each<double>> costs(kStrands);
      parallel(kStrands, [&](int strand) {
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
        for (long long i = strand; i < rounds; i += kStrands) {
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
      for (int strand = 0; strand < kStrands; ++strand) {
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
      pass.part = PairPart::atoms;
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

bool Renderer::pixels_are_independent() const {
  return impl_->mix.image == 0;
}
bool Renderer::pixels_are_independent(Term term) const {
  return impl_->stays_in_pixels(term);
}

GatedImage Renderer::render(const Stream& stream, SampleRange range) const {
  GatedImage image = impl_->blank();
  if (impl_->scene.emitters.empty()) return image;  // no lamp, or one that the parameters have flattened
  GatePass pass;
  pass.value = true;
  const auto run = [&](const Film& film, int strand, int strands) {
    Worker worker(impl_->scene, impl_->gates, impl_->options, impl_->every_gate, PrimalSink(impl_->gates, film));
    impl_->run_paths(worker, impl_->mix.image, {}, pass, strand, strands, stream, range);
  };
  if (pixels_are_independent()) {  // strands have no pixel in common
    parallel(kStrands, [&](int strand) { run(image, strand, kStrands); });
    return image;
  }
  const int strands = impl_->strands_for(range, image.data.size());
  const auto sum = sum_of_partitions<SparseSum>(strands, [&](int strand) {
    SparseSum own(image.data.size());
    run({image, own, 0}, strand, strands);
    return own;
  });
  sum.for_each(image.data.size(), [&](std::size_t i, double value) { image.data[i] += value; });
  return image;
}

std::vector<GatedImage> Renderer::derive(Term term, const Stream& stream, SampleRange range) const {
  if (!impl_->basis) throw std::logic_error("derive: the renderer was made without a tangent basis");
  const int columns = impl_->basis->columns;
  std::vector<GatedImage> images(columns, impl_->blank());
  if (!impl_->has(term) || columns == 0) return images;
  if (term == Term::visibility) impl_->learn();
  const auto run = [&](const std::vector<Film>& films, int strand, int strands) {
    Worker worker(impl_->scene, impl_->gates, impl_->options, impl_->every_gate,
                  TangentSink(impl_->gates, impl_->scene.layout, *impl_->basis, films));
    impl_->run_term(term, worker, strand, strands, stream, range);
  };
  if (pixels_are_independent(term)) {
    const std::vector<Film> films(images.begin(), images.end());
    parallel(kStrands, [&](int strand) { run(films, strand, kStrands); });
    return images;
  }
  const std::size_t size = images[0].data.size(), values = size * columns;
  const int strands = impl_->strands_for(range, values);
  const auto sum = sum_of_partitions<SparseSum>(strands, [&](int strand) {
    SparseSum own(values);
    std::vector<Film> films;
    for (int column = 0; column < columns; ++column) films.emplace_back(images[column], own, column * size);
    run(films, strand, strands);
    return own;
  });
  sum.for_each(values, [&](std::size_t i, double value) { images[i / size].data[i % size] += value; });
  return images;
}

void Renderer::add_gradient(Term term, const GatedImage& adjoint, const Stream& stream, SampleRange range,
                            std::vector<double>& dof_gradient, std::vector<std::vector<double>>* parts) const {
  if (!impl_->basis) throw std::logic_error("add_gradient: the renderer was made without a tangent basis");
  const TangentBasis& basis = *impl_->basis;
  if (parts) parts->assign(kGradientParts, std::vector<double>(basis.columns, 0.0));
  if (!impl_->has(term)) return;
  if (term == Term::visibility) impl_->learn();
  const GatePick pick(impl_->gates, adjoint);
  const int strands = impl_->strands_for(range, basis.entries.size());  // at least as many as are touched
  std::vector<std::vector<double>> by_strand(parts ? strands : 0, std::vector<double>(basis.columns, 0.0));
  const auto sum = sum_of_partitions<SparseSum>(strands, [&](int strand) {
    SparseSum own(dof_gradient.size());
    Worker worker(impl_->scene, impl_->gates, impl_->options, pick,
                  AdjointSink(impl_->gates, impl_->scene.layout, basis, adjoint, own));
    impl_->run_term(term, worker, strand, strands, stream, range);
    if (parts)
      own.for_each(dof_gradient.size(), [&](std::size_t dof, double value) {
        for (int e = basis.row_begin[dof]; e < basis.row_begin[dof + 1]; ++e)
          by_strand[strand][basis.entries[e].column] += basis.entries[e].coefficient * value;
      });
    return own;
  });
  sum.for_each(dof_gradient.size(), [&](std::size_t dof, double value) { dof_gradient[dof] += value; });
  // Strands take turns at the blocks of pixels, so that of any number of them these come together from the same pixels.
  for (std::size_t strand = 0; strand < by_strand.size(); ++strand)
    add_to((*parts)[strand % kGradientParts], by_strand[strand]);
}

ImageBreakdown Renderer::render_breakdown(const Stream& stream, SampleRange range) const {
  const Impl& impl = *impl_;
  struct Sum : ImageBreakdown {
    void add(const Sum& other) {
      add_to(image.data, other.image.data);
      add_to(by_shape, other.by_shape);
    }
  };
  Sum blank;
  const GatedImage shape = impl.blank();
  blank.image = GatedImage(shape.width, shape.height, shape.gates * (impl.options.max_bounces + 1), shape.channels);
  blank.by_shape.assign(impl.scene.scene.shapes.size(), 0.0);
  if (impl.scene.emitters.empty()) return blank;
  const int strands = impl.strands_for(range, blank.image.data.size());
  return sum_of_partitions<Sum>(strands, [&](int strand) {
    Sum own = blank;
    Worker worker(impl.scene, impl.gates, impl.options, impl.every_gate,
                  ImageBreakdownSink(impl.scene, impl.gates, own));
    GatePass pass;
    pass.value = true;
    impl.run_paths(worker, impl.mix.image, {}, pass, strand, strands, stream, range);
    return own;
  });
}

GradientBreakdown Renderer::gradient_breakdown(Term term, std::span<const GatedImage> adjoints, const Stream& stream,
                                               SampleRange range) const {
  const Impl& impl = *impl_;
  if (!impl.basis) throw std::logic_error("gradient_breakdown: the renderer was made without a tangent basis");
  const std::size_t entries = adjoints[0].data.size(), count = adjoints.size();
  struct Sum : GradientBreakdown {
    void add(const Sum& other) {
      add_to(by_bounces, other.by_bounces);
      add_to(by_gate, other.by_gate);
      add_to(by_shape, other.by_shape);
    }
  };
  Sum sum;
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
  const int strands = impl.strands_for(range, sum.by_bounces.size() + sum.by_gate.size() + sum.by_shape.size());
  return sum_of_partitions<Sum>(strands, [&](int strand) {
    Sum own = sum;
    Worker worker(impl.scene, impl.gates, impl.options, pick,
                  GradientBreakdownSink(impl.scene, impl.gates, *impl.basis, largest.channels, interleaved, own));
    impl.run_term(term, worker, strand, strands, stream, range);
    return own;
  });
}

}  // namespace isochron
