#include "optim/reconstruct/reconstruction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <functional>

#include "core/base/clock.h"
#include "core/base/description.h"
#include "core/base/error.h"
#include "core/base/file.h"
#include "core/base/progress.h"
#include "core/gates/gate_description.h"
#include "core/image/npy.h"
#include "core/scene/mesh_writer.h"
#include "optim/problem/goodness_of_fit.h"
#include "optim/problem/vector_math.h"
#include "optim/reconstruct/fit_settings.h"
#include "optim/reconstruct/start_surface.h"
#include "optim/remesh/surface.h"

namespace isochron {
namespace {

namespace fs = std::filesystem;

std::string quoted_path(const std::string& file) {
  return yaml_text(fs::weakly_canonical(fs::absolute(file)).string());
}

/// Names of experiments are made of letters, digits, _ and -, which those of files need not be.
std::string name_of(const std::string& file) {
  std::string name = fs::path(file).stem().string();
  const auto usable = [](unsigned char c) { return c < 0x80 && (std::isalnum(c) || c == '_' || c == '-'); };
  std::replace_if(name.begin(), name.end(), std::not_fn(usable), '_');
  if (name.starts_with('-')) name[0] = '_';
  return name;
}

/// Without a response gates would jump at the ends of bins, and a term of derivatives be needed for that, which is far more work. A
/// triangle of half a bin adds an eighth to the variance that bins have themselves.
std::string response_text(const ReconstructionSpec& spec, double bin) {
  if (!spec.response.empty()) return ", response: " + quoted_path(spec.response);
  if (bin == 0) return "";
  const double quarter = 0.25e12 * bin / kSpeedOfLight;
  return fmt::format(", response: {{offsets: [{:.6g}, 0, {:.6g}], values: [0, 1, 0]}}", -quarter, quarter);
}

std::string experiment_text(const ReconstructionSpec& spec, const FitSettings& set, bool masked) {
  return fmt::format(
      R"(# The surface that a capture's light came from; written by isochron reconstruct.
name: {name}
scene: scene.yaml
max_bounces: 1
seed: {seed}
gates: {{kind: bins, unit: ps, scene_unit_m: 1{response}}}   # bins: those of the capture
parameters:
  - name: shape
    type: vertices
    shape: surface
    direction: free
    initial: 0
    scale: {edge:.4g}   # so that steps of adam are shares of the edges
    smoothing: {{bending: {bending}, variation: {bending}, slopes: {motion:.4g}, evidence: true}}
    remesh: {{levels: {levels}, more_levels: {more}, coarse_levels: {coarse}, coarse_histograms: {histograms}, adam: {{iterations: {steps}, last: {last_steps}, learning_rate: {rate}, slopes: {free:.4g}}}, edge_length: {edge:.4g}, outline: {{albedo: {share}, slopes: {slopes:.4g}}}}}
  - name: albedo            # what is known is gain * albedo, so that 1 is no bound of nature
    type: albedo
    shape: surface
    per: vertex
    initial: 0.25
    scale: 0.03
    smoothing: {{slopes: {albedo:.4g}, evidence: true}}
  - {{name: gain, type: gain, initial: {gain:.6g}, lower: {low:.6g}, upper: {high:.6g}}}
  - {{name: background, type: background{per}, scale: 0.01}}
target:
  capture: {capture}
  window: [{first:.6g}, {last:.6g}]   # light of the surface and some time before and after{mask}
samples: {{primal: {primal}, interior: {interior}, visibility: 0, path_length: 0}}
loss: {{kind: poisson}}
optimizer: {{method: quasi_newton, iterations: 2, inner_iterations: 10}}   # of each level
output: {{histogram_samples: {primal}, frames: 0}}
)",
      fmt::arg("name", name_of(spec.capture)), fmt::arg("seed", spec.seed),
      fmt::arg("response", response_text(spec, set.bin)), fmt::arg("bending", set.bending),
      fmt::arg("motion", set.motion), fmt::arg("levels", set.levels), fmt::arg("more", set.more_levels),
      fmt::arg("coarse", set.coarse_levels), fmt::arg("histograms", set.coarse_histograms),
      fmt::arg("steps", set.adam_iterations), fmt::arg("last_steps", set.adam_last), fmt::arg("rate", set.adam_rate),
      fmt::arg("free", set.adam_motion), fmt::arg("share", set.outline_share), fmt::arg("slopes", set.outline_slopes),
      fmt::arg("edge", set.edge_length), fmt::arg("albedo", set.albedo), fmt::arg("gain", set.gain),
      fmt::arg("low", 0.999 * set.gain), fmt::arg("high", 1.001 * set.gain),
      fmt::arg("per", set.background_per_point ? ", per: pixel, initial: 1" : ""),
      fmt::arg("capture", quoted_path(spec.capture)), fmt::arg("first", set.window.first),
      fmt::arg("last", set.window.last), fmt::arg("mask", masked ? "\n  mask: mask.npy" : ""),
      fmt::arg("primal", set.samples), fmt::arg("interior", std::max(2, set.samples / 2)));
}

std::string scene_text(const std::string& capture) {
  return fmt::format(
      "# Lengths in metres; start.ply is in the coordinates of the capture.\n"
      "capture: {{file: {}}}\n"
      "materials:\n"
      "  surface: {{type: diffuse, albedo: 0.25}}\n"
      "shapes:\n"
      "  - {{name: surface, file: start.ply, material: surface}}\n",
      capture);
}

std::string ply(const Mesh& mesh, const std::vector<double>& albedo = {}) {
  const Scene scene = scene_of(mesh);
  std::vector<VertexProperty> properties;
  if (!albedo.empty()) properties.push_back({"albedo", albedo});
  return to_ply(scene, scene.shapes[0], properties);
}

DetectorResponse response_of(GateSpec gates, const CaptureFile& capture) {
  gates.set_bins(capture.t_start, capture.delta_t, capture.counts.gates);
  const GateSet set = make_gates(gates);
  const LinearDensity& response = set.shape().response();
  return response.upper() > response.lower() ? DetectorResponse(response) : std::nullopt;
}

/// From so many counts of the median point on one that counts nothing is dead: with a tenth of its light it would be so once in 22000.
constexpr double kNeverSilent = 100;

/// One number per sensor point, zero for dead ones; empty: none is. Values of these are no counts under some spot, not finite or below zero, or
/// they count nothing where others do. Throws InputError where most of the points with finite values have some below zero.
std::vector<std::uint8_t> usable_points(const CaptureFile& capture, const std::string& file) {
  const std::size_t points = capture.geometry.sensor.size();
  std::vector<std::uint8_t> finite(points, 1), used(points, 1);
  std::vector<double> counted(points, 0.0);
  for (int pixel = 0; pixel < capture.counts.pixels(); ++pixel)
    for (int g = 0; g < capture.counts.gates; ++g) {
      const double value = capture.counts.at(pixel, g);
      const std::size_t point = pixel % points;
      if (!std::isfinite(value)) finite[point] = used[point] = 0;
      if (value < 0) used[point] = 0;
      counted[point] += value;
    }
  const auto left = [](const std::vector<std::uint8_t>& of) { return std::ranges::count(of, 1); };
  if (2 * left(used) < left(finite))
    throw InputError(fmt::format(
        "{}: {} of {} points have values below zero, which are no counts (allowed: photons as they were counted, dark "
        "counts among them)",
        file, left(finite) - left(used), points));
  std::vector<double> sums;
  for (std::size_t p = 0; p < points; ++p)
    if (used[p]) sums.push_back(counted[p]);
  if (!sums.empty() && median(sums) >= kNeverSilent)
    for (std::size_t p = 0; p < points; ++p)
      if (counted[p] == 0) used[p] = 0;
  if (left(used) == std::ssize(used)) used.clear();
  return used;
}

/// Of the points that are used, under all spots.
Readings readings_of(const GatedImage& counts, const std::vector<std::uint8_t>& used) {
  Readings readings;
  while (!used.empty() && std::ssize(readings.pixel) < counts.pixels())
    readings.pixel.insert(readings.pixel.end(), used.begin(), used.end());
  return readings;
}

BackProjection back_projected(const CaptureFile& capture, const DetectorResponse& response,
                              const std::vector<std::uint8_t>& used, const std::string& file) {
  const ProgressStage stage("back-projection", 1);
  try {
    return back_project(capture, response, used);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", file, error.what()));
  }
}

/// See Reconstruction::photons_needed. z standard deviations above the background of the bins that a filter takes.
double photons_needed(const CaptureFile& capture, const BackProjection& volume) {
  const std::size_t readings = capture.counts.data.size();
  double sum = 0;
  for (const float value : capture.counts.data) sum += std::isfinite(value) ? value : 0;
  const double histograms = static_cast<double>(readings) / capture.counts.gates;
  const double bins = std::max(1.0, volume.filter.width / capture.delta_t);
  const double background = sum / static_cast<double>(readings) * bins * histograms, z = volume.least_significance;
  return 0.5 * z * (z + std::sqrt(z * z + 4 * background));
}

std::string start_yaml(const BackProjection& volume, const FirstSurface& first, double seconds) {
  const double greatest =
      volume.significance.empty() ? 0 : *std::max_element(volume.significance.begin(), volume.significance.end());
  return fmt::format(
      "start: {{method: back_projection, seconds: {:.4g}, significance: {:.4g}, least_significance: {:.4g}, "
      "depth_resolution: {:.4g}, lateral_resolution: {:.4g}, vertices: {}}}\n",
      seconds, greatest, volume.least_significance, volume.depth_resolution, volume.lateral_resolution,
      first.mesh.positions.size());
}

}  // namespace

Reconstruction begin_reconstruction(const ReconstructionSpec& spec, const std::string& place,
                                    const std::function<void(const std::string&)>& warning) {
  const auto begun = Clock::now();
  if (!spec.response.empty() && !file_exists(spec.response))
    throw InputError(spec.response + ": does not exist (a table of the detector's response: offsets in ps, values)");
  const std::string experiment = place + "/experiment.yaml";
  if (!(spec.seconds >= kLeastSeconds && spec.seconds <= kMostSeconds))
    throw InputError(fmt::format("seconds: {} (allowed: {} to {})", spec.seconds, kLeastSeconds, kMostSeconds));
  Reconstruction result;
  FitSettings settings;
  std::vector<std::uint8_t> used;
  const auto write_experiment = [&] {
    result.experiment = experiment_text(spec, settings, !used.empty());
    write_file_atomically(experiment, result.experiment);
  };
  write_file_atomically(place + "/scene.yaml", scene_text(quoted_path(spec.capture)));
  write_experiment();
  const CaptureFile capture = read_capture(spec.capture);
  const DetectorResponse response = response_of(load_experiment(experiment).gates, capture);
  used = usable_points(capture, spec.capture);
  if (!used.empty()) {
    const int columns = capture.geometry.columns, rows = static_cast<int>(used.size()) / columns;
    write_file_atomically(place + "/mask.npy", npy_of_pixels(columns, rows, used));
    if (warning)
      warning(fmt::format("{}: {} of {} points are left out: they count nothing, or what is no count", spec.capture,
                          std::ranges::count(used, 0), used.size()));
  }
  if (warning && !are_whole_numbers(capture.counts, readings_of(capture.counts, used)))
    warning(fmt::format(
        "{}: has values that are no whole numbers: smoothing and standard errors take them for numbers of photons all "
        "the same, and whether the surface explains them is not judged",
        spec.capture));
  const BackProjection volume = back_projected(capture, response, used, spec.capture);
  const FirstSurface first = first_surface(volume);
  const LikelyAlbedos likely = likely_albedos(volume, histograms(capture, volume.frame, used), response);
  const Mesh start = start_surface(likely);

  result.photons_needed = photons_needed(capture, volume);
  result.has_signal = !start.faces.empty();
  if (result.has_signal) {
    const auto points = static_cast<int>(capture.geometry.sensor.size());
    const auto left = used.empty() ? points : static_cast<int>(std::ranges::count(used, 1));
    settings = fit_settings(start, likely.resolution,
                            {capture.counts.pixels() / points * left, capture.geometry.confocal, spec.seconds});
    settings.bin = capture.delta_t;
    settings.background_per_point = backgrounds_differ(capture, used);
    settings.window = time_window(start, capture.geometry, response, volume.depth_resolution);
    result.files["back_projection.ply"] = ply(first.mesh, first.albedo);
    result.files["start.ply"] = ply(start);
    // Beside the run's copy of the capture.
    result.files["scene.yaml"] =
        scene_text(yaml_text("inputs/scene/elsewhere/" + fs::path(spec.capture).filename().string()));
    write_file_atomically(place + "/start.ply", result.files["start.ply"]);
    write_experiment();
    measure(experiment, start, settings, warning);
    write_experiment();
  }
  const double seconds = seconds_since(begun);
  result.files["start.yaml"] = start_yaml(volume, first, seconds);
  return result;
}

}  // namespace isochron
