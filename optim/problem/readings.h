// Which readings of a target count. A reading is the value of a pixel, gate and channel.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/gates/gate.h"
#include "core/image/image.h"
#include "optim/experiment/experiment.h"

namespace isochron {

/// Those of some pixels under some gates. Everything that is a mean over readings is one over these.
struct Readings {
  std::vector<char> pixel, gate;  ///< whether they count, one entry each; empty: all do
  /// Share of the pixels that these are, where others are drawn for each estimate of a mean over all.
  double drawn = 1;

  bool uses_pixel(int p) const { return pixel.empty() || pixel[p]; }
  bool uses_gate(int g) const { return gate.empty() || gate[g]; }
  /// The other pixels, see Capture::left_out: no sample starts there.
  std::vector<char> left_out() const;
  /// How many pixels and how many readings of an image count.
  double pixels(const GatedImage& image) const;
  double count(const GatedImage& image) const;
};

/// Calls f(index into the image's data) for the pixel's readings that count, in order.
template <class F>
void for_each_reading(const GatedImage& image, const Readings& readings, int pixel, F&& f) {
  if (!readings.uses_pixel(pixel)) return;
  for (int g = 0; g < image.gates; ++g)
    if (readings.uses_gate(g))
      for (int c = 0; c < image.channels; ++c) f(image.index(pixel, g, c));
}

/// Calls f(pixel) for every pixel, in any order, on several threads.
void parallel_pixels(const GatedImage& image, const std::function<void(int)>& f);

/// As `target.window` and `target.mask` say, for images of so many pixels. The image has `spots` parts one below the other,
/// to each of which the mask applies. Throws InputError where they do not fit or leave nothing.
Readings make_readings(const Experiment& experiment, const GateSet& gates, int width, int height, int spots = 1);

/// Leaves so many of the pixels that count, of `pixels` in all, spread evenly over them; all where there are no more. Returns the share left.
/// Others for another `number`: over many, each pixel is left equally often.
double choose_pixels(Readings& readings, int pixels, int count, std::uint32_t number = 0);

/// Throws InputError, which begins with `what`, where a reading that counts is no count: negative or not finite.
void require_counts(const GatedImage& target, const Readings& readings, const std::string& what);

/// Throws InputError, which begins with `what`, where a reading that counts is not finite; those that do not count become
/// zero, so that nothing else meets them.
void settle_unused(GatedImage& target, const Readings& readings, const std::string& what);

}  // namespace isochron
