#include "optim/reconstruct/reconstruction.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>

#include "core/base/error.h"
#include "core/base/file.h"
#include "core/base/progress.h"
#include "core/base/ranks.h"
#include "core/scene/mesh_writer.h"
#include "optim/problem/dark_bins.h"
#include "optim/problem/loss.h"
#include "optim/problem/problem.h"
#include "optim/reconstruct/start_surface.h"
#include "optim/remesh/remesh.h"
#include "optim/remesh/surface.h"

namespace isochron {
namespace {

namespace fs = std::filesystem;

/// Paths that a level may trace per second of the fit: primal samples of a histogram are half as many again as derivatives', and a fit
/// takes some hundred times both. Measured on two cores of 2020 with the rabbit of scenes/rabbit.
constexpr double kSamplesPerSecond = 7000;
constexpr int kLeastSamples = 16, kMostSamples = 4096;
constexpr int kMostLevels = 3;
constexpr double kMostVertices = 20000;
constexpr double kBending =
    3;  // prior's weight at first: three nats for a curvature of 1 over the square of its radius
constexpr double kMotionSlope = 0.0625;  // expected change of offsets over the distance
constexpr double kAlbedoChange = 0.1;    // expected across the surface

std::string quoted_path(const std::string& file) {
  std::string text = "\"";
  for (const char c : fs::weakly_canonical(fs::absolute(file)).string())
    text += c == '"' || c == '\\' ? fmt::format("\\{}", c) : std::string(1, c);
  return text + "\"";
}

/// What experiment.yaml says that is measured rather than chosen.
struct Settings {
  int samples = kLeastSamples;
  int levels = 1;
  double edge_length = 1, bending = kBending, motion = 0, albedo = 0;
  double gain = 1;
  bool background_per_point = false;
  std::array<double, 2> window{0, 1};
};

std::string experiment_text(const ReconstructionSpec& spec, const std::string& name, const Settings& set) {
  const std::string response = spec.response.empty() ? "" : ", response: " + quoted_path(spec.response);
  return fmt::format(
      R"(# The surface behind the light of a capture, from what filtered back-projection shows; written by isochron reconstruct.
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
    smoothing: {{bending: {bending}, slopes: {motion:.4g}, evidence: true}}
    remesh: {{levels: {levels}, edge_length: {edge:.4g}}}
  - name: albedo            # what is known is gain * albedo
    type: albedo
    shape: surface
    per: vertex
    initial: 0.5
    smoothing: {{slopes: {albedo:.4g}, evidence: true}}
  - {{name: gain, type: gain, initial: {gain:.6g}, lower: {low:.6g}, upper: {high:.6g}}}
  - {{name: background, type: background{per}}}
target:
  capture: {capture}
  window: [{first:.6g}, {last:.6g}]   # light of the surface and some time before and after
samples: {{primal: {primal}, interior: {interior}, visibility: 0, path_length: 0}}
loss: {{kind: poisson}}
optimizer: {{method: quasi_newton, iterations: 2, inner_iterations: 10}}   # of each level
output: {{histogram_samples: {primal}}}
)",
      fmt::arg("name", name), fmt::arg("seed", spec.seed), fmt::arg("response", response),
      fmt::arg("bending", set.bending), fmt::arg("motion", set.motion), fmt::arg("levels", set.levels),
      fmt::arg("edge", set.edge_length), fmt::arg("albedo", set.albedo), fmt::arg("gain", set.gain),
      fmt::arg("low", 0.999 * set.gain), fmt::arg("high", 1.001 * set.gain),
      fmt::arg("per", set.background_per_point ? ", per: pixel, initial: 1" : ""),
      fmt::arg("capture", quoted_path(spec.capture)), fmt::arg("first", set.window[0]), fmt::arg("last", set.window[1]),
      fmt::arg("primal", set.samples), fmt::arg("interior", std::max(2, set.samples / 2)));
}

std::string scene_text(const std::string& capture) {
  return fmt::format(
      "# Lengths in metres; start.ply is in the coordinates of the capture.\n"
      "capture: {{file: {}}}\n"
      "materials:\n"
      "  surface: {{type: diffuse, albedo: 0.5}}\n"
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

struct Range {
  double least = std::numeric_limits<double>::infinity(), most = 0;
};

Range distances(const Vec3& from, const std::vector<Vec3>& places) {
  Range range;
  for (const Vec3& p : places) {
    range.least = std::min(range.least, length(p - from));
    range.most = std::max(range.most, length(p - from));
  }
  return range;
}

BackProjection back_projected(const CaptureFile& capture, const DetectorResponse& response, const std::string& file) {
  try {
    return back_project(capture, response);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", file, error.what()));
  }
}

/// Times, as optical paths, at which light of the mesh may be counted at any point, and a quarter as much before and after, for the
/// background.
std::array<double, 2> time_window(const Mesh& mesh, const CaptureGeometry& geometry, const DetectorResponse& response,
                                  double resolution) {
  const std::vector<Vec3>& spots = geometry.confocal ? geometry.sensor : geometry.laser;
  Range all;
  for (const Vec3& p : mesh.positions) {
    const Range to = distances(p, spots), from = distances(p, geometry.sensor);
    all.least = std::min(all.least, to.least + from.least);
    all.most = std::max(all.most, to.most + from.most);
  }
  if (geometry.accounts_first_and_last)
    for (const Range& way :
         {distances(geometry.laser_origin, spots), distances(geometry.sensor_origin, geometry.sensor)}) {
      all.least += way.least;
      all.most += way.most;
    }
  if (response) {
    all.least += response->lower();
    all.most += response->upper();
  }
  const double margin = std::max(8 * resolution, 0.25 * (all.most - all.least));
  return {all.least - margin, all.most + margin};
}

/// What the dark bins of each sensor point say; those whose readings do not count are left out.
std::vector<double> point_levels(const GatedImage& counts, const Readings& readings, int points) {
  std::vector<double> levels = dark_levels(counts, readings, points);
  std::erase_if(levels, [](double level) { return !std::isfinite(level); });
  return levels;
}

/// Whether they scatter more than Poisson numbers of one mean do, by five standard deviations.
bool vary(const std::vector<double>& levels, double readings_each) {
  if (levels.size() < 2) return false;
  const auto n = static_cast<double>(levels.size());
  const double mean = std::accumulate(levels.begin(), levels.end(), 0.0) / n;
  double squares = 0;
  for (const double level : levels) squares += (level - mean) * (level - mean);
  // Half of the readings are dark at least, else the level says little.
  const double expected = 2 * mean / readings_each;
  return squares / (n - 1) > expected * (1 + 5 * std::sqrt(2 / (n - 1)));
}

/// Sums over the points, of each gate that counts.
std::vector<double> by_gate(const GatedImage& image, const Readings& readings) {
  std::vector<double> sums;
  for (int g = 0; g < image.gates; ++g) {
    if (!readings.uses_gate(g)) continue;
    sums.push_back(0);
    for (int p = 0; p < image.pixels(); ++p)
      if (readings.uses_pixel(p)) sums.back() += image.at(p, g);
  }
  return sums;
}

/// The multiple of the light that with a background explains the counts best: weighted least squares of the sums, whose variances are
/// the counts. What is dark cannot be told from counts alone where a response has a long tail. NaN or below zero: none.
double multiple_of(const std::vector<double>& light, const std::vector<double>& counts) {
  double weights = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t g = 0; g < light.size(); ++g) {
    const double w = 1 / std::max(1.0, counts[g]);
    weights += w;
    x += w * light[g];
    y += w * counts[g];
    xx += w * light[g] * light[g];
    xy += w * light[g] * counts[g];
  }
  return (weights * xy - x * y) / (weights * xx - x * x);
}

/// Of faces that look away from the wall there are none: the area is that of one side.
double area_of(const Mesh& mesh) {
  double area = 0;
  for (const auto& f : mesh.faces)
    area +=
        0.5 * length(cross(mesh.positions[f[1]] - mesh.positions[f[0]], mesh.positions[f[2]] - mesh.positions[f[0]]));
  return area;
}

/// Gain, background and the weights of priors, by the data and a rendering of the start.
void measure(const std::string& experiment, const Mesh& start, Settings& set,
             const std::function<void(const std::string&)>& warning) {
  const Problem problem(load_experiment(experiment), warning);
  const GatedImage counts = problem.make_target([] {});
  const Readings& readings = problem.readings();
  const int points = static_cast<int>(problem.scene().capture->sensor.size());
  const std::vector<double> levels = point_levels(counts, readings, points);
  const double readings_each = readings.count(counts) / points;
  set.background_per_point = vary(levels, readings_each);
  std::vector<double> theta = problem.parameters().initial();
  for (const Parameters::Block& block : problem.parameters().blocks())
    if (block.name == "background") std::fill_n(theta.begin() + block.begin, block.count, 0.0);
  const GatedImage light =
      problem.render(theta, problem.stream(Pass::render), {0, std::max(kLeastSamples, set.samples / 4)});
  const double gain = multiple_of(by_gate(light, readings), by_gate(counts, readings));
  if (gain > 0 && std::isfinite(gain)) set.gain = gain;
  // Weights of slopes that are normal with such a standard deviation (optim/README.md).
  const double edges = 1.5 * static_cast<double>(start.faces.size());
  const double unit = edges / (2 * readings.count(counts) * mean_square(counts, readings));
  set.motion = unit / (kMotionSlope * kMotionSlope);
  const double slope = kAlbedoChange / std::sqrt(area_of(start));
  set.albedo = unit / (slope * slope);
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
  const auto begun = std::chrono::steady_clock::now();
  const std::string name = fs::path(spec.capture).stem().string();
  const std::string experiment = place + "/experiment.yaml";
  Settings set;
  Reconstruction result;
  const auto write = [&](const std::string& file, const std::string& text) { write_file_atomically(file, text); };
  write(place + "/scene.yaml", scene_text(quoted_path(spec.capture)));
  write(experiment, experiment_text(spec, name, set));
  const Experiment unmeasured = load_experiment(experiment);
  const CaptureFile capture = read_capture(spec.capture);
  const DetectorResponse response = response_of(unmeasured.gates, capture);
  const ProgressStage stage("back-projection", 1);
  const BackProjection volume = back_projected(capture, response, spec.capture);
  const FirstSurface first = first_surface(volume);
  const Mesh start = start_surface(volume, first);

  result.photons_needed = photons_needed(capture, volume);
  result.files["back_projection.ply"] = first.mesh.faces.empty() ? "" : ply(first.mesh, first.albedo);
  result.has_signal = !start.faces.empty();
  const auto end = [&] {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    result.files["start.yaml"] = start_yaml(volume, first, seconds);
  };
  if (!result.has_signal) {
    result.files.erase("back_projection.ply");
    end();
    return result;
  }
  set.edge_length = volume.lateral_resolution;
  const double histograms = static_cast<double>(capture.counts.width) * capture.counts.height;
  set.samples = static_cast<int>(std::clamp(kSamplesPerSecond * spec.seconds / histograms, 1.0 * kLeastSamples,
                                            1.0 * kMostSamples)) /
                2 * 2;
  while (set.levels < kMostLevels &&
         static_cast<double>(start.positions.size()) * std::pow(4.0, set.levels) <= kMostVertices)
    ++set.levels;
  set.window = time_window(start, capture.geometry, response, volume.depth_resolution);
  // Beside the run's copy of the capture.
  result.files["scene.yaml"] = scene_text("\"inputs/scene/elsewhere/" + fs::path(spec.capture).filename().string() + "\"");
  result.files["start.ply"] = ply(start);
  write(place + "/start.ply", result.files["start.ply"]);
  write(experiment, experiment_text(spec, name, set));
  measure(experiment, start, set, warning);
  result.experiment = experiment_text(spec, name, set);
  write(experiment, result.experiment);
  end();
  return result;
}

}  // namespace isochron
