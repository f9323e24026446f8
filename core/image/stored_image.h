// Gated images as results are kept and written: in single precision, as files hold no more. While few values of a pixel are not
// zero, only those are kept: of a thousand time bins a few samples fill hardly any.
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/base/ranks.h"
#include "core/image/image.h"

namespace isochron {

class StoredImage {
 public:
  /// A value of a pixel at its place [gate][channel].
  struct Entry {
    std::uint32_t place;
    float value;
  };

  StoredImage() = default;
  /// Black.
  StoredImage(int w, int h, int g, int c)
      : width(w), height(h), gates(g), channels(c), rows_(static_cast<std::size_t>(w) * h) {}
  explicit StoredImage(const GatedImage& image);

  int pixels() const { return width * height; }
  std::size_t values_of_pixel() const { return static_cast<std::size_t>(gates) * channels; }
  bool same_shape(const StoredImage& other) const {
    return width == other.width && height == other.height && gates == other.gates && channels == other.channels;
  }

  /// Sets the values of a pixel; `entries` are sorted by place, and all others zero. Different pixels may be set at a time.
  void set(int pixel, const std::vector<Entry>& entries);
  /// f(place, value) for the values of a pixel in [begin, end) that can be other than zero, in order.
  template <class F>
  void for_each(int pixel, std::uint32_t begin, std::uint32_t end, F&& f) const {
    const Row& row = rows_[pixel];
    if (!row.all.empty()) {
      for (std::uint32_t i = begin; i < end; ++i) f(i, row.all[i]);
      return;
    }
    auto at = std::lower_bound(row.few.begin(), row.few.end(), begin,
                               [](const Entry& entry, std::uint32_t place) { return entry.place < place; });
    for (; at != row.few.end() && at->place < end; ++at) f(at->place, at->value);
  }
  /// The same for all values of a pixel.
  template <class F>
  void for_each(int pixel, F&& f) const {
    for_each(pixel, 0, static_cast<std::uint32_t>(values_of_pixel()), f);
  }
  float at(int pixel, int gate, int channel = 0) const;
  GatedImage to_gated() const;

  /// A pixel, to other ranks.
  void pack(int pixel, Packer& packer) const;
  void unpack(int pixel, Unpacker& unpacker);

  int width = 0, height = 0, gates = 0, channels = 0;

 private:
  struct Row {
    std::vector<Entry> few;
    std::vector<float> all;  ///< where they are not few
  };
  std::vector<Row> rows_;  ///< one per pixel
};

/// As of a gated image.
void require_finite(const StoredImage& image, const std::string& what);
void write_exr(const std::string& file, const StoredImage& image, const ExrNotes& notes = {});
void write_exr_components(const std::string& file, const std::vector<std::string>& components,
                          const std::vector<StoredImage>& images, const ExrNotes& notes = {});

/// Values of a pixel that are added up, of which few are touched at a time.
class RowSum {
 public:
  explicit RowSum(std::size_t size) : values_(size, 0.0), touched_(size, 0) {}
  void add(std::size_t place, double value) {
    if (!touched_[place]) {
      touched_[place] = 1;
      places_.push_back(static_cast<std::uint32_t>(place));
    }
    values_[place] += value;
  }
  /// f(place, sum) for those that were touched, in order; all are zero afterwards.
  template <class F>
  void take(F&& f) {
    std::sort(places_.begin(), places_.end());
    for (const std::uint32_t place : places_) {
      f(place, values_[place]);
      values_[place] = 0;
      touched_[place] = 0;
    }
    places_.clear();
  }

 private:
  std::vector<double> values_;
  std::vector<std::uint8_t> touched_;
  std::vector<std::uint32_t> places_;
};

}  // namespace isochron
