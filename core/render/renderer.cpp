#include "core/render/renderer.h"

#include <stdexcept>

#include "core/render/renderer_impl.h"
#include "core/render/replicated.h"

namespace isochron {

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
  {
    const PassTimes::Timed timed(impl_->times(), PassKind::primal);
    if (!impl_->scene.emitters.empty())  // no lamp, or one that the parameters have flattened
      impl_->add_films(PassKind::primal, range, {&image, 1}, pixels_are_independent(),
                       [&](const std::vector<Film>& films, Partition partition) {
                         impl_->run_images({stream, range}, films, partition);
                       });
  }
  impl_->add_background(image);
  return image;
}

std::vector<GatedImage> Renderer::derive(Term term, const Stream& stream, SampleRange range) const {
  if (!impl_->basis) throw std::logic_error("derive: the renderer was made without a tangent basis");
  const int columns = impl_->basis->columns;
  std::vector<GatedImage> images(columns, impl_->blank());
  if (term == Term::interior) impl_->add_background_derivative(images);
  if (!impl_->has(term) || columns == 0) return images;
  impl_->prepare(term);
  const PassTimes::Timed timed(impl_->times(), pass_kind(term));
  impl_->add_films(pass_kind(term), range, images, pixels_are_independent(term),
                   [&](const std::vector<Film>& films, Partition partition) {
                     impl_->run_term(term, {stream, range}, films, partition);
                   });
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
        impl_->run_images(pass, films, partition);
      },
      [&](int, int pixel) { return impl_->scene.leaves_out(pixel) ? 0 : impl_->background_of(pixel).first; });
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
  return passes.render([&](const Pass& pass, const std::vector<Film>& films,
                           Partition partition) { impl_->run_term(term, pass, films, partition); },
                       [&](int column, int pixel) {
                         double sum = 0;
                         if (term != Term::interior || impl_->scene.leaves_out(pixel)) return sum;
                         const int dof = impl_->background_of(pixel).second;
                         for (int e = basis.row_begin[dof]; e < basis.row_begin[dof + 1]; ++e)
                           if (basis.entries[e].column == column) sum += basis.entries[e].coefficient;
                         return sum;
                       });
}

void Renderer::add_gradient(Term term, const GatedImage& adjoint, const Stream& stream, SampleRange range,
                            std::vector<double>& dof_gradient, std::vector<std::vector<double>>* parts) const {
  add_gradients(term, {&adjoint, 1}, stream, range, {&dof_gradient, 1}, parts);
}

void Renderer::add_gradients(Term term, std::span<const GatedImage> adjoints, const Stream& stream, SampleRange range,
                             std::span<std::vector<double>> dof_gradients,
                             std::vector<std::vector<double>>* parts) const {
  if (!impl_->basis) throw std::logic_error("add_gradient: the renderer was made without a tangent basis");
  const TangentBasis& basis = *impl_->basis;
  if (parts) parts->assign(kGradientParts, std::vector<double>(basis.columns, 0.0));
  const std::size_t count = adjoints.size(), dofs = dof_gradients[0].size();
  for (std::size_t a = 0; a < count && term == Term::interior; ++a)
    impl_->add_background_gradient(adjoints[a], dof_gradients[a], a == 0 ? parts : nullptr);
  if (!impl_->has(term)) return;
  impl_->prepare(term);
  const PassTimes::Timed timed(impl_->times(), pass_kind(term));
  const GatePick pick(impl_->gates, adjoints, impl_->draws_lengths(term), impl_->scene.share_of_pixels());
  const int partitions = impl_->partitions_for(range, basis.entries.size());  // at least as many as are touched
  std::vector<std::vector<double>> by_partition(parts ? partitions : 0, std::vector<double>(basis.columns, 0.0));
  SharedPartitions shared(partitions, impl_->partition_costs(pass_kind(term), partitions));
  const auto sum = sum_of_partitions<SparseSum>(shared, [&](int partition) {
    SparseSum own(dofs * count);
    AdjointSink sink(impl_->gates, impl_->scene.layout, basis, adjoints, own);
    impl_->run_term(term, {stream, range}, {partition, partitions}, pick, sink);
    if (parts)
      own.for_each(0, dofs * count, [&](std::size_t i, double value) {
        const std::size_t dof = i / count;
        for (int e = basis.row_begin[dof]; i % count == 0 && e < basis.row_begin[dof + 1]; ++e)
          by_partition[partition][basis.entries[e].column] += basis.entries[e].coefficient * value;
      });
    return own;
  });
  if (parts) all_gather_parts(shared.parts, by_partition);
  sum.for_each(0, dofs * count, [&](std::size_t i, double value) { dof_gradients[i % count][i / count] += value; });
  // Whatever the number of partitions, each part is of the same pixels, see part_of.
  const int pixels = impl_->scene.pixels();
  for (int i = 0; i < static_cast<int>(by_partition.size()); ++i)
    add_to((*parts)[Partition{i, partitions}.pixel_part(pixels) % kGradientParts], by_partition[i]);
}

}  // namespace isochron
