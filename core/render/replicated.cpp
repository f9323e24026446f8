#include "core/render/replicated.h"

namespace isochron {

void ReplicatedPasses::share(const RankParts& parts, std::vector<ReplicatedImage>& images) const {
  const auto for_each_row = [&](int partition, auto&& f) {
    Passes::for_each_pixel({partition, count_}, pixels_, [&](int pixel) {
      for (ReplicatedImage& image : images) f(image.mean, pixel);
    });
  };
  all_gather_parts(
      parts,
      [&](Packer& packer, int partition) {
        for_each_row(partition, [&](const StoredImage& image, int pixel) { image.pack(pixel, packer); });
      },
      [&](Unpacker& unpacker, int partition) {
        for_each_row(partition, [&](StoredImage& image, int pixel) { image.unpack(pixel, unpacker); });
      });
}

void ReplicatedPasses::Sums::add(const Sums& other) {
  for (std::size_t i = 0; i < of.size(); ++i) of[i].add(other.of[i]);
}

void ReplicatedPasses::Sums::pack(Packer& packer) const {
  packer.put(of.size());
  for (const GateSums& each : of) each.pack(packer);
}

void ReplicatedPasses::Sums::unpack(Unpacker& unpacker) {
  std::size_t count = 0;
  unpacker.get(count);
  of.resize(count);
  for (GateSums& each : of) each.unpack(unpacker);
}

}  // namespace isochron
