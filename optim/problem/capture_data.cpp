#include "optim/problem/capture_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/image/capture_file.h"
#include "optim/experiment/description.h"

namespace isochron {
namespace {

/// Bins that begin or end by less than this part of their width elsewhere are the same.
constexpr double kSame = 1e-4;

double metres(const GateSpec& gates) {
  return gates.scene_unit_m > 0 ? gates.scene_unit_m : 1;
}

std::optional<BinGrid> grid_of(const GateSpec& gates) {
  return gates.needs_bins() ? std::nullopt : gates.shape->bins({length_unit(gates), gates.scene_unit_m});
}

/// Sums of `each` bins of the file from bin `first` on.
GatedImage combined(const GatedImage& counts, int first, int each, int count) {
  GatedImage sums(counts.width, counts.height, count, 1);
  for (int pixel = 0; pixel < counts.pixels(); ++pixel)
    for (int g = 0; g < count; ++g)
      for (int i = 0; i < each; ++i) sums.at(pixel, g, 0) += counts.at(pixel, first + g * each + i, 0);
  return sums;
}

/// The file's bins that the window leaves, first and number. Where it leaves none, all of them: make_readings says what is wrong.
std::pair<int, int> windowed(const TargetSpec& target, double start, double width, int bins) {
  int first = bins, last = -1;
  for (int g = 0; g < bins; ++g) {
    const double center = start + (g + 0.5) * width;
    if (center < target.window[0] - kSame * width || center > target.window[1] + kSame * width) continue;
    first = std::min(first, g);
    last = g;
  }
  return last < 0 ? std::pair{0, bins} : std::pair{first, last - first + 1};
}

}  // namespace

std::optional<GatedImage> read_counts(Experiment& experiment, const Scene& scene,
                                      const std::function<void(const std::string&)>& warning) {
  const std::string& file = experiment.target.capture;
  if (file.empty()) return std::nullopt;
  const auto fail = [&](const std::string& what, const std::string& allowed) {
    throw InputError(fmt::format("{}: {} (allowed: {})", file, what, allowed));
  };
  if (!scene.capture) fail("a capture is the target of a scene with a camera", "a scene with `capture`");
  CaptureFile capture = read_capture(file);
  if (warning)
    for (const std::string& line : capture.assumed) warning(file + ": " + line);
  const GatedImage& counts = capture.counts;
  if (counts.width != scene.camera.width || counts.height != scene.camera.height)
    fail(fmt::format("{} x {} sensor points (columns, rows times spots)", counts.width, counts.height),
         fmt::format("the scene's {} x {}", scene.camera.width, scene.camera.height));
  GateSpec& gates = experiment.gates;
  const double width = capture.delta_t / metres(gates), start = capture.t_start / metres(gates);
  if (gates.needs_bins()) {
    const auto [first, count] = windowed(experiment.target, start, width, counts.gates);
    gates.set_bins(start + first * width, width, count);
    return count == counts.gates ? std::move(capture.counts) : combined(counts, first, 1, count);
  }
  const BinGrid bins = *grid_of(gates);
  const double ratio = bins.width / width, offset = (bins.start - start) / width;
  const int each = static_cast<int>(std::lround(ratio)), first = static_cast<int>(std::lround(offset));
  const std::string has =
      fmt::format("the file's {} bins begin at {:.6g} and are {:.6g} scene units wide", counts.gates, start, width);
  if (each < 1 || std::abs(ratio - each) > kSame || std::abs(offset - first) > kSame)
    fail(fmt::format("the gates' bins, from {:.6g} on, {:.6g} wide, do not hold whole bins of the file", bins.start,
                     bins.width),
         has);
  if (first < 0 || first + static_cast<long long>(each) * bins.count > counts.gates)
    fail(fmt::format("the gates' bins reach from {:.6g} to {:.6g}, beyond those of the file", bins.start,
                     bins.start + bins.width * bins.count),
         has);
  return combined(counts, first, each, bins.count);
}

bool has_histograms(const Experiment& experiment, const Scene& scene) {
  return scene.capture && scene.grey && grid_of(experiment.gates);
}

bool write_histograms(const std::string& file, const Experiment& experiment, const Scene& scene,
                      const StoredImage& readings) {
  if (!has_histograms(experiment, scene)) return false;
  const auto bins = grid_of(experiment.gates);
  const Capture& capture = *scene.capture;
  const double unit = metres(experiment.gates);
  CaptureFile out;
  CaptureGeometry& g = out.geometry;
  g.columns = capture.columns;
  g.rows = capture.rows;
  for (const WallPoint& s : capture.sensor) {
    g.sensor.push_back(s.p * unit);
    g.sensor_normal.push_back(s.n);
  }
  g.confocal = capture.confocal();
  for (const WallPoint& l : capture.spots) {
    g.laser.push_back(l.p * unit);
    g.laser_normal.push_back(l.n);
  }
  if (capture.origin) {
    g.accounts_first_and_last = true;
    g.laser_origin = capture.origin->laser * unit;
    g.sensor_origin = capture.origin->sensor * unit;
  }
  out.delta_t = bins->width * unit;
  out.t_start = bins->start * unit;
  write_capture(file, out, readings);
  return true;
}

bool write_histograms(const std::string& file, const Experiment& experiment, const Scene& scene,
                      const GatedImage& readings) {
  return has_histograms(experiment, scene) && write_histograms(file, experiment, scene, StoredImage(readings));
}

}  // namespace isochron
