#include "optim/problem/readings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/image/npy.h"

namespace isochron {

double Readings::pixels(const GatedImage& image) const {
  return pixel.empty() ? image.pixels() : static_cast<double>(pixel.size() - std::count(pixel.begin(), pixel.end(), 0));
}

std::vector<char> Readings::left_out() const {
  std::vector<char> others = pixel;
  for (char& each : others) each = !each;
  return others;
}

double Readings::count(const GatedImage& image) const {
  const auto gates =
      gate.empty() ? image.gates : static_cast<double>(gate.size() - std::count(gate.begin(), gate.end(), 0));
  return pixels(image) * gates * image.channels;
}

void parallel_pixels(const GatedImage& image, const std::function<void(int)>& f) {
  constexpr int kReadings =
      1 << 15;  // of a chunk: many beside what it takes to share one out, few beside an image; not tuned
  const int pixels = image.pixels(), chunk = std::max(1, kReadings / std::max(1, image.gates * image.channels));
  parallel_ranges(pixels, chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) f(static_cast<int>(p));
  });
}

Readings make_readings(const Experiment& experiment, const GateSet& gates, int width, int height, int spots) {
  const TargetSpec& target = experiment.target;
  Readings readings;
  if (target.windowed()) {
    const auto [start, stop] = target.window;
    if (gates.shape().is_steady())
      throw InputError(experiment.file + ": target.window: the steady sensor has no gates to choose from");
    for (int g = 0; g < gates.size(); ++g) readings.gate.push_back(gates.center(g) >= start && gates.center(g) <= stop);
    if (std::count(readings.gate.begin(), readings.gate.end(), 1) == 0)
      throw InputError(
          fmt::format("{}: target.window: no gate has its centre within {} to {} (they lie at {:.4g} to "
                      "{:.4g} scene units)",
                      experiment.file, start, stop, gates.center(0), gates.center(gates.size() - 1)));
  }
  if (!target.mask.empty()) {
    const NumberArray mask = read_npy(target.mask);
    const auto rows = static_cast<std::size_t>(height / spots), columns = static_cast<std::size_t>(width);
    if (mask.shape != std::vector<std::size_t>{columns, rows})
      throw InputError(fmt::format("{}: an array of [{}] (allowed: [{}, {}], columns and rows of the {})", target.mask,
                                   fmt::join(mask.shape, ", "), columns, rows,
                                   spots > 1 ? "images of one spot" : "images"));
    for (std::size_t y = 0; y < rows * spots; ++y)
      for (std::size_t x = 0; x < columns; ++x) readings.pixel.push_back(mask.values[x * rows + y % rows] != 0);
    if (std::count(readings.pixel.begin(), readings.pixel.end(), 1) == 0)
      throw InputError(target.mask + ": leaves no pixel (at least one entry other than zero)");
  }
  return readings;
}

double choose_pixels(Readings& readings, int pixels, int count, std::uint32_t number) {
  std::vector<int> used;
  for (int p = 0; p < pixels; ++p)
    if (readings.uses_pixel(p)) used.push_back(p);
  if (std::ssize(used) <= count) return 1;
  readings.pixel.assign(pixels, 0);
  const auto fraction = [](double x) { return x - std::floor(x); };
  // Powers of one over the plastic number, which neither each other nor the golden ratio below keep step with.
  const double turn = number * 0.7548776662466927, shift = fraction(number * 0.5698402909980532);
  const auto shifted = static_cast<std::size_t>(shift * static_cast<double>(used.size()));
  // One of each run of neighbours, at places within these that fill the plane evenly where rows have many runs. Runs may differ in length
  // by one, so that they begin elsewhere for each number.
  const auto first_of = [&](int run) { return used.size() * static_cast<std::size_t>(run) / count; };
  for (int i = 0; i < count; ++i) {
    const std::size_t first = first_of(i), length = first_of(i + 1) - first;
    const double within = fraction(i * std::numbers::phi + turn) * static_cast<double>(length);
    readings.pixel[used[(first + static_cast<std::size_t>(within) + shifted) % used.size()]] = 1;
  }
  return static_cast<double>(count) / static_cast<double>(used.size());
}

void require_counts(const GatedImage& target, const Readings& readings, const std::string& what) {
  for (int pixel = 0; pixel < target.pixels(); ++pixel)
    for_each_reading(target, readings, pixel, [&](std::size_t i) {
      if (const double value = target.data[i]; !(value >= 0) || !std::isfinite(value))
        throw InputError(
            fmt::format("{}: {} at column {}, row {}, gate {} is no count (loss.kind: poisson needs numbers "
                        "of at least 0; target.mask and target.window leave readings out, scripts/import_capture.py "
                        "--mask writes a mask of such points)",
                        what, value, pixel % target.width, pixel / target.width, i / target.channels % target.gates));
    });
}

void settle_unused(GatedImage& target, const Readings& readings, const std::string& what) {
  for (int pixel = 0; pixel < target.pixels(); ++pixel)
    for_each_reading(target, readings, pixel, [&](std::size_t i) {
      if (!std::isfinite(target.data[i]))
        throw InputError(fmt::format(
            "{}: {} at column {}, row {}, gate {} (target.mask and target.window leave readings "
            "out; scripts/import_capture.py --mask writes a mask of dead points)",
            what, target.data[i], pixel % target.width, pixel / target.width, i / target.channels % target.gates));
    });
  for (double& value : target.data)
    if (!std::isfinite(value)) value = 0;
}

}  // namespace isochron
