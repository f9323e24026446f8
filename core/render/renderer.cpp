#include "core/render/renderer.h"

#include <cmath>
#include <numeric>
#include <stdexcept>

#include "core/base/partition_sum.h"
#include "core/films/breakdown_sinks.h"
#include "core/render/passes.h"
#include "core/render/replicated.h"

namespace isochron {
namespace {

void add_to(std::vector<double>& sum, const std::vector<double>& other) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += other[i];
}

}  // namespace

struct Renderer::Impl : Passes {
  using Passes::Passes;

  GatedImage blank() const {
    return GatedImage(scene.camera.width, scene.camera.height, gates.size(), scene.scene.grey ? 1 : 3);
  }

  /// Whether there are enough of them for partitions that have their pixels for themselves.
  bool has_many_pixels() const { return Partition::blocks(scene.pixels()) >= kFewestPartitions; }

  /// run(partition) of every partition, whose samples add only to pixels of its own, and so need no sums.
  template <class Run>
  void run_in_pixels(PassKind kind, std::span<GatedImage> images, Run&& run) const {
    const int count = Partition{0, kMostPartitions}.pixel_parts(scene.pixels());
    SharedPartitions shared(count, partition_costs(kind, count));
    shared.run([&](int partition) { run(Partition{partition, count}); });
    const auto exchange = [&](int partition, auto&& values_of_pixel) {
      for_each_pixel({partition, count}, scene.pixels(), [&](int pixel) {
        for (GatedImage& image : images) {
          const std::size_t values = image.data.size() / static_cast<std::size_t>(image.pixels());
          values_of_pixel(&image.data[pixel * values], values);
        }
      });
    };
    all_gather_parts(
        shared.parts,
        [&](Packer& packer, int partition) {
          packer.put(shared.costs[partition]);
          exchange(partition, [&](const double* values, std::size_t n) { packer.put(values, n); });
        },
        [&](Unpacker& unpacker, int partition) {
          unpacker.get(shared.costs[partition]);
          exchange(partition, [&](double* values, std::size_t n) { unpacker.get(values, n); });
        });
    shared.keep_costs();
  }

  /// Of a gradient. Partitions take turns at blocks of pixels.
  static int part_of(int pixel) { return pixel / kPixelsPerBlock % kGradientParts; }

  /// The background of a pixel, and its degree of freedom.
  std::pair<double, int> background_of(int pixel) const {
    const Detector& detector = scene.scene.detector;
    const int i = detector.background_of(scene.scene.capture, pixel);
    return {detector.background[i], scene.layout.background(i)};
  }
  /// f(pixel, background of the pixel, its degree of freedom)
  template <class F>
  void for_each_background(F&& f) const {
    for (int pixel = 0; pixel < scene.pixels(); ++pixel) {
      const auto [value, dof] = background_of(pixel);
      f(pixel, value, dof);
    }
  }
  void add_background(GatedImage& image) const {
    const std::size_t values = image.data.size() / static_cast<std::size_t>(image.pixels());
    for_each_background([&](int pixel, double background, int) {
      for (std::size_t i = 0; background != 0 && i < values; ++i) image.data[pixel * values + i] += background;
    });
  }
  /// Of the background, which counts in the interior term.
  void add_background_derivative(std::vector<GatedImage>& images) const {
    for_each_background([&](int pixel, double, int dof) {
      for (int e = basis->row_begin[dof]; e < basis->row_begin[dof + 1]; ++e) {
        GatedImage& image = images[basis->entries[e].column];
        const std::size_t values = image.data.size() / static_cast<std::size_t>(image.pixels());
        for (std::size_t i = 0; i < values; ++i) image.data[pixel * values + i] += basis->entries[e].coefficient;
      }
    });
  }
  void add_background_gradient(const GatedImage& adjoint, std::vector<double>& dof_gradient,
                               std::vector<std::vector<double>>* parts) const {
    const auto values = static_cast<std::ptrdiff_t>(adjoint.data.size()) / adjoint.pixels();
    for_each_background([&](int pixel, double, int dof) {
      if (!basis->differentiates(dof)) return;
      const auto begin = adjoint.data.begin() + pixel * values;
      const double sum = std::accumulate(begin, begin + values, 0.0);
      dof_gradient[dof] += sum;
      for (int e = basis->row_begin[dof]; parts && e < basis->row_begin[dof + 1]; ++e)
        (*parts)[part_of(pixel)][basis->entries[e].column] += basis->entries[e].coefficient * sum;
    });
  }
};

Renderer::Renderer(const Scene& scene, const GateSet& gates, const EstimatorOptions& options, const TangentBasis* basis,
                   SceneCache* cache)
    : impl_(std::make_unique<Impl>(scene, gates, options, basis, cache)) {}
Renderer::~Renderer() = default;

bool Renderer::has(Term term) const {
  return impl_->has(term);
}
const SamplingMix& Renderer::mix() const {
  return impl_->mix;
}
long long Renderer::rays() const {
  return impl_->rays();
}
double Renderer::work() const {
  return impl_->work();
}

double Renderer::work_of(Technique technique) const {
  return impl_->work_of(technique);
}

bool Renderer::pixels_are_independent() const {
  return impl_->stays_in_pixels();
}
bool Renderer::pixels_are_independent(Term term) const {
  return impl_->stays_in_pixels(term);
}

GatedImage Renderer::render(const Stream& stream, SampleRange range) const {
  GatedImage image = impl_->blank();
  render_light(image, stream, range);
  impl_->add_background(image);
  return image;
}

void Renderer::render_light(GatedImage& image, const Stream& stream, SampleRange range) const {
  const PassTimes::Timed timed(impl_->times(), PassKind::primal);
  if (impl_->scene.emitters.empty()) return;  // no lamp, or one that the parameters have flattened
  const auto run = [&](const Film& film, Partition partition) {
    PrimalSink sink(impl_->gates, film);
    impl_->run_images({stream, range}, partition, sink);
  };
  if (pixels_are_independent() && impl_->has_many_pixels()) {
    impl_->run_in_pixels(PassKind::primal, {&image, 1}, [&](Partition partition) { run(image, partition); });
    return;
  }
  const int partitions = impl_->partitions_for(range, image.data.size());
  const auto sum = impl_->sum_of<ListedSum>(PassKind::primal, partitions, [&](int partition) {
    ListedSum own(image.data.size());
    run({image.gates, image.channels, own, 0}, {partition, partitions});
    own.finish();
    return own;
  });
  sum.for_each(0, image.data.size(), [&](std::size_t i, double value) { image.data[i] += value; });
}

std::vector<GatedImage> Renderer::derive(Term term, const Stream& stream, SampleRange range) const {
  if (!impl_->basis) throw std::logic_error("derive: the renderer was made without a tangent basis");
  const int columns = impl_->basis->columns;
  std::vector<GatedImage> images(columns, impl_->blank());
  if (term == Term::interior) impl_->add_background_derivative(images);
  if (!impl_->has(term) || columns == 0) return images;
  impl_->prepare(term);
  const PassTimes::Timed timed(impl_->times(), pass_kind(term));
  const auto run = [&](const std::vector<Film>& films, Partition partition) {
    TangentSink sink(impl_->gates, impl_->scene.layout, *impl_->basis, films);
    impl_->run_term(term, {stream, range}, partition, impl_->every_gate, sink);
  };
  if (pixels_are_independent(term) && impl_->has_many_pixels()) {
    const std::vector<Film> films(images.begin(), images.end());
    impl_->run_in_pixels(pass_kind(term), images, [&](Partition partition) { run(films, partition); });
    return images;
  }
  const std::size_t size = images[0].data.size(), values = size * columns;
  const int partitions = impl_->partitions_for(range, values);
  const auto sum = impl_->sum_of<ListedSum>(pass_kind(term), partitions, [&](int partition) {
    ListedSum own(values);
    std::vector<Film> films;
    for (int column = 0; column < columns; ++column)
      films.emplace_back(images[0].gates, images[0].channels, own, column * size);
    run(films, {partition, partitions});
    own.finish();
    return own;
  });
  sum.for_each(0, values, [&](std::size_t i, double value) { images[i / size].data[i % size] += value; });
  return images;
}

ReplicatedImage Renderer::render_replicates(const Stream& stream, const std::vector<SampleRange>& ranges) const {
  const PassTimes::Timed timed(impl_->times(), PassKind::primal);
  const ReplicatedPasses passes(*impl_, {.kind = PassKind::primal,
                                         .columns = 1,
                                         .stream = stream,
                                         .ranges = ranges,
                                         .lit = !impl_->scene.emitters.empty(),
                                         .stay_in_pixels = pixels_are_independent() && impl_->has_many_pixels()});
  std::vector<ReplicatedImage> images = passes.render(
      [&](const Pass& pass, const std::vector<Film>& films, Partition partition) {
        PrimalSink sink(impl_->gates, films[0]);
        impl_->run_images(pass, partition, sink);
      },
      [&](int, int pixel) { return impl_->background_of(pixel).first; });
  return std::move(images[0]);
}

std::vector<ReplicatedImage> Renderer::derive_replicates(Term term, const Stream& stream,
                                                         const std::vector<SampleRange>& ranges) const {
  if (!impl_->basis) throw std::logic_error("derive_replicates: the renderer was made without a tangent basis");
  const TangentBasis& basis = *impl_->basis;
  if (basis.columns == 0) return {};
  const bool lit = impl_->has(term);
  if (lit) impl_->prepare(term);
  const PassTimes::Timed timed(impl_->times(), pass_kind(term));
  const ReplicatedPasses passes(*impl_, {.kind = pass_kind(term),
                                         .columns = basis.columns,
                                         .stream = stream,
                                         .ranges = ranges,
                                         .lit = lit,
                                         .stay_in_pixels = pixels_are_independent(term) && impl_->has_many_pixels()});
  return passes.render(
      [&](const Pass& pass, const std::vector<Film>& films, Partition partition) {
        TangentSink sink(impl_->gates, impl_->scene.layout, basis, films);
        impl_->run_term(term, pass, partition, impl_->every_gate, sink);
      },
      [&](int column, int pixel) {
        double sum = 0;
        if (term != Term::interior) return sum;
        const int dof = impl_->background_of(pixel).second;
        for (int e = basis.row_begin[dof]; e < basis.row_begin[dof + 1]; ++e)
          if (basis.entries[e].column == column) sum += basis.entries[e].coefficient;
        return sum;
      });
}

void Renderer::add_gradient(Term term, const GatedImage& adjoint, const Stream& stream, SampleRange range,
                            std::vector<double>& dof_gradient, std::vector<std::vector<double>>* parts) const {
  if (!impl_->basis) throw std::logic_error("add_gradient: the renderer was made without a tangent basis");
  const TangentBasis& basis = *impl_->basis;
  if (parts) parts->assign(kGradientParts, std::vector<double>(basis.columns, 0.0));
  if (term == Term::interior) impl_->add_background_gradient(adjoint, dof_gradient, parts);
  if (!impl_->has(term)) return;
  impl_->prepare(term);
  const PassTimes::Timed timed(impl_->times(), pass_kind(term));
  const GatePick pick(impl_->gates, adjoint, impl_->draws_lengths(term));
  const int partitions = impl_->partitions_for(range, basis.entries.size());  // at least as many as are touched
  std::vector<std::vector<double>> by_partition(parts ? partitions : 0, std::vector<double>(basis.columns, 0.0));
  SharedPartitions shared(partitions, impl_->partition_costs(pass_kind(term), partitions));
  const auto sum = sum_of_partitions<SparseSum>(shared, [&](int partition) {
    SparseSum own(dof_gradient.size());
    AdjointSink sink(impl_->gates, impl_->scene.layout, basis, adjoint, own);
    impl_->run_term(term, {stream, range}, {partition, partitions}, pick, sink);
    if (parts)
      own.for_each(0, dof_gradient.size(), [&](std::size_t dof, double value) {
        for (int e = basis.row_begin[dof]; e < basis.row_begin[dof + 1]; ++e)
          by_partition[partition][basis.entries[e].column] += basis.entries[e].coefficient * value;
      });
    return own;
  });
  if (parts) all_gather_parts(shared.parts, by_partition);
  sum.for_each(0, dof_gradient.size(), [&](std::size_t dof, double value) { dof_gradient[dof] += value; });
  // Whatever the number of partitions, each part is of the same pixels, see part_of.
  const int pixels = impl_->scene.pixels();
  for (int i = 0; i < static_cast<int>(by_partition.size()); ++i)
    add_to((*parts)[Partition{i, partitions}.pixel_part(pixels) % kGradientParts], by_partition[i]);
}

ImageBreakdown Renderer::render_breakdown(const Stream& stream, SampleRange range) const {
  const Impl& impl = *impl_;
  struct Sum : ImageBreakdown {
    void add(const Sum& other) {
      add_to(image.data, other.image.data);
      add_to(by_shape, other.by_shape);
      add_to(by_technique, other.by_technique);
    }
    void pack(Packer& packer) const { packer.put(image.data), packer.put(by_shape), packer.put(by_technique); }
    void unpack(Unpacker& unpacker) { unpacker.get(image.data), unpacker.get(by_shape), unpacker.get(by_technique); }
  };
  Sum blank;
  const GatedImage shape = impl.blank();
  blank.image = GatedImage(shape.width, shape.height, shape.gates * (impl.options.max_bounces + 1), shape.channels);
  blank.by_shape.assign(impl.scene.scene.shapes.size(), 0.0);
  blank.by_technique.assign(kTechniques, 0.0);
  if (impl.scene.emitters.empty()) return blank;
  const int partitions = impl.partitions_for(range, blank.image.data.size());
  const Sum sum = impl.sum_of<Sum>(PassKind::primal, partitions, [&](int partition) {
    Sum own = blank;
    ImageBreakdownSink sink(impl.scene, impl.gates, own);
    impl.run_images({stream, range}, {partition, partitions}, sink);
    return own;
  });
  blank.add(sum);  // only the numbers come from another rank
  return blank;
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
      add_to(by_technique, other.by_technique);
    }
    void pack(Packer& packer) const {
      packer.put(by_bounces), packer.put(by_gate), packer.put(by_shape), packer.put(by_technique);
    }
    void unpack(Unpacker& unpacker) {
      unpacker.get(by_bounces), unpacker.get(by_gate), unpacker.get(by_shape), unpacker.get(by_technique);
    }
  };
  Sum sum;
  sum.adjoints = static_cast<int>(count);
  sum.columns = impl.basis->columns;
  const std::size_t columns = sum.columns;
  sum.by_bounces.assign((impl.options.max_bounces + 1) * columns * count, 0.0);
  sum.by_gate.assign(impl.gates.size() * columns, 0.0);
  sum.by_shape.assign(impl.scene.scene.shapes.size() * columns, 0.0);
  sum.by_technique.assign(kTechniques * columns, 0.0);
  if (!impl.has(term) || columns == 0) return sum;
  impl.prepare(term);
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
  const GatePick pick(impl.gates, largest, impl.draws_lengths(term));
  const int partitions = impl.partitions_for(range, sum.by_bounces.size() + sum.by_gate.size() + sum.by_shape.size());
  const Sum all = impl.sum_of<Sum>(pass_kind(term), partitions, [&](int partition) {
    Sum own = sum;
    GradientBreakdownSink sink(impl.scene, impl.gates, *impl.basis, largest.channels, interleaved, own);
    impl.run_term(term, {stream, range}, {partition, partitions}, pick, sink);
    return own;
  });
  sum.add(all);
  return sum;
}

}  // namespace isochron
