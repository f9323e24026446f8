// What light and gradient are made of: by bounces, gates, shapes and techniques.
#include <stdexcept>

#include "core/films/breakdown_sinks.h"
#include "core/render/renderer_impl.h"

namespace isochron {

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
  std::vector<double> interleaved(entries * count);
  for (std::size_t i = 0; i < entries; ++i)
    for (std::size_t j = 0; j < count; ++j) interleaved[i * count + j] = adjoints[j].data[i];
  const GatePick pick(impl.gates, adjoints, impl.draws_lengths(term), impl.scene.share_of_pixels());
  const int partitions = impl.partitions_for(range, sum.by_bounces.size() + sum.by_gate.size() + sum.by_shape.size());
  const Sum all = impl.sum_of<Sum>(pass_kind(term), partitions, [&](int partition) {
    Sum own = sum;
    GradientBreakdownSink sink(impl.scene, impl.gates, *impl.basis, adjoints[0].channels, interleaved, own);
    impl.run_term(term, {stream, range}, {partition, partitions}, pick, sink);
    return own;
  });
  sum.add(all);
  return sum;
}

}  // namespace isochron
