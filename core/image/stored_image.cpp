#include "core/image/stored_image.h"

#include <cmath>
#include <limits>

namespace isochron {

StoredImage::StoredImage(const GatedImage& image)
    : StoredImage(image.width, image.height, image.gates, image.channels) {
  std::vector<Entry> entries;
  for (int pixel = 0; pixel < pixels(); ++pixel) {
    entries.clear();
    const double* const values = &image.data[image.index(pixel, 0)];
    for (std::uint32_t i = 0; i < values_of_pixel(); ++i)
      if (values[i] != 0) entries.push_back({i, static_cast<float>(values[i])});
    set(pixel, entries);
  }
}

void StoredImage::set(int pixel, const std::vector<Entry>& entries) {
  Row& row = rows_[pixel];
  row.few.clear();
  row.all.clear();
  if (2 * entries.size() <= values_of_pixel()) {  // with their places they take twice the memory
    row.few.assign(entries.begin(), entries.end());
    return;
  }
  row.all.assign(values_of_pixel(), 0.0f);
  for (const Entry& entry : entries) row.all[entry.place] = entry.value;
}

float StoredImage::at(int pixel, int gate, int channel) const {
  const auto place = static_cast<std::uint32_t>(gate * channels + channel);
  float found = 0;
  for_each(pixel, place, place + 1, [&](std::uint32_t, float value) { found = value; });
  return found;
}

GatedImage StoredImage::to_gated() const {
  GatedImage image(width, height, gates, channels);
  for (int pixel = 0; pixel < pixels(); ++pixel) {
    double* const values = &image.data[image.index(pixel, 0)];
    for_each(pixel, [&](std::uint32_t i, float value) { values[i] = value; });
  }
  return image;
}

void StoredImage::pack(int pixel, Packer& packer) const {
  packer.put(rows_[pixel].few);
  packer.put(rows_[pixel].all);
}

void StoredImage::unpack(int pixel, Unpacker& unpacker) {
  unpacker.get(rows_[pixel].few);
  unpacker.get(rows_[pixel].all);
}

void require_finite(const StoredImage& image, const std::string& what) {
  std::size_t wrong = 0;
  for (int pixel = 0; pixel < image.pixels(); ++pixel)
    image.for_each(
        pixel, [&](std::uint32_t, float value) { wrong += !(std::abs(value) <= std::numeric_limits<float>::max()); });
  require_none_wrong(wrong, image.values_of_pixel() * image.pixels(), what);
}

}  // namespace isochron
