#pragma once
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace isochron {

/// A stack of gated images. Layout [row][column][gate][channel], row 0 at the top, double precision.
struct GatedImage {
  int width = 0, height = 0, gates = 0, channels = 0;  ///< channels: 1 (grey) or 3 (rgb)
  std::vector<double> data;

  GatedImage() = default;
  GatedImage(int w, int h, int g, int c)
      : width(w), height(h), gates(g), channels(c), data(static_cast<std::size_t>(w) * h * g * c, 0.0) {}
  int pixels() const { return width * height; }
  std::size_t index(int pixel, int gate, int channel = 0) const {
    return (static_cast<std::size_t>(pixel) * gates + gate) * channels + channel;
  }
  double& at(int pixel, int gate, int channel = 0) { return data[index(pixel, gate, channel)]; }
  double at(int pixel, int gate, int channel = 0) const { return data[index(pixel, gate, channel)]; }
  /// Average over pixels and channels of one gate.
  double mean(int gate) const;
  bool same_shape(const GatedImage& other) const {
    return width == other.width && height == other.height && gates == other.gates && channels == other.channels;
  }
};

/// Throws std::runtime_error where a value is not finite, or would not be as a 32-bit float; `what` says of which image.
void require_finite(const GatedImage& image, const std::string& what);
/// The same where `wrong` values of so many are not.
void require_none_wrong(std::size_t wrong, std::size_t values, const std::string& what);

/// Texts by name for the header of an EXR file.
using ExrNotes = std::vector<std::pair<std::string, std::string>>;

/// Writes 32-bit float channels `gateNNN.R/G/B` (three channels) or `gateNNN.Y` (one), by temporary name and rename, a
/// part at a time. Throws InputError when the file cannot be written.
void write_exr(const std::string& file, const GatedImage& image, const ExrNotes& notes = {});

/// Writes derivative images: channels `COMPONENT.gateNNN.Y`, each the average over the image's channels.
void write_exr_components(const std::string& file, const std::vector<std::string>& components,
                          const std::vector<GatedImage>& images, const ExrNotes& notes = {});

/// Reads what `write_exr` writes (any compression). Throws InputError naming the file and the first thing amiss.
GatedImage read_exr(const std::string& file);

}  // namespace isochron
