#include "optim/reconstruct/fit_settings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "optim/problem/loss.h"
#include "optim/problem/problem.h"
#include "optim/remesh/remesh.h"

namespace isochron {
namespace {

/// Of a level, per histogram: the rabbit of scenes/rabbit, 4096 histograms in eleven levels, has 398 for 300 s.
constexpr double kLevelSamplesPerSecond = 60000;
constexpr int kLeastSamples = 16, kMostSamples = 4096;
/// A sample's work where light goes and comes back on two ways, over that of a confocal one: levels by adam of the blob under 8 x 8 spots took
/// 20.7 s, confocal ones 15.2.
constexpr double kTwoWays = 1.35;
/// Iterations of the last level by adam there, over those of confocal captures: by trials with the blob under 8 x 8 spots and with rabbits
/// (optim/README.md, Levels by adam).
constexpr int kOnTwoWays = 2;
/// The first finds the outline and the second the albedo; seven of adam move borders; the last has all histograms, for the
/// evidence of the level after it.
constexpr int kCoarseLevels = 10;
/// Of coarse levels at most: more take longer to settle, and borders of larger surfaces are worth less each.
constexpr double kCoarseVertices = 500;
/// By trials with the rabbit (optim/README.md): expected change of offsets over the distance, and of albedos, a quarter on average, across
/// the surface.
constexpr double kMotionSlope = 0.0625, kAlbedoChange = 0.015;
/// Expected change of offsets over the distance where adam moves borders: triangles fold where it is one.
constexpr double kFreeSlope = 0.5;
/// Expected change of the first level's albedos from vertex to vertex: half of what they are on average, so that both dark and bright
/// neighbours are likely.
constexpr double kOutlineChange = 0.5 * 0.25;
/// Of an image in the coarse levels, per second of the whole: of the rabbit 1206 histograms with 398 each (optim/README.md, Histograms).
constexpr double kCoarseSamplesPerSecond = 1600;
constexpr int kLeastCoarseHistograms = 256;
/// Beyond so many photons of a histogram for each sample the noise of the images is far above theirs, and counts say no more: priors weigh as
/// if there were no more (optim/README.md, Bright captures).
constexpr double kPhotonsPerSample = 5;

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

/// Whether Poisson numbers of one mean scatter less than these, by five standard deviations. A mean below one tells too little.
bool vary(const std::vector<double>& numbers) {
  if (numbers.size() < 2) return false;
  const auto n = static_cast<double>(numbers.size());
  const double mean = std::accumulate(numbers.begin(), numbers.end(), 0.0) / n;
  double squares = 0;
  for (const double number : numbers) squares += (number - mean) * (number - mean);
  return mean >= 1 && squares / (n - 1) > mean * (1 + 5 * std::sqrt(2 / (n - 1) + 1 / (n * mean)));
}

/// The bins before light comes, by what is counted in each: from the first that counts until one counts more than the least so far by eight
/// standard deviations: the least of a thousand is some three below their mean. Dark bins after the light hold its tails.
std::pair<int, int> dark_before_light(const std::vector<double>& counted) {
  constexpr double kClearly = 8;
  const auto first = std::ranges::find_if(counted, [](double sum) { return sum > 0; });
  double least = std::numeric_limits<double>::infinity();
  const auto last = std::find_if(first, counted.end(), [&](double sum) {
    least = std::min(least, std::max(sum, 0.0));
    return sum > least + kClearly * std::sqrt(least + 1);
  });
  return {static_cast<int>(first - counted.begin()), static_cast<int>(last - counted.begin())};
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
/// the counts. Counts do not tell which bins are dark if a response has a long tail. NaN or below zero: none.
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

/// Of a surface in regular triangles, two for each vertex.
double vertices_of(double area, double edge_length) {
  return area / (std::sqrt(3.0) / 2 * edge_length * edge_length);
}

}  // namespace

FitSettings fit_settings(const Mesh& start, double resolution, const FitWork& work) {
  FitSettings settings;
  const double area = surface_area(start);
  settings.edge_length = std::max(resolution, std::sqrt(vertices_of(area, 1) / kCoarseVertices));
  settings.coarse_levels = kCoarseLevels;
  settings.levels = kCoarseLevels + 1;
  settings.more_levels = 1;
  if (!work.confocal) settings.adam_last *= kOnTwoWays;
  // An image of a coarse level has kLeastCoarseHistograms at least, or all that there are: more samples of each would take too long.
  const double seconds = work.seconds / (work.confocal ? 1 : kTwoWays),
               of_coarse_image = kCoarseSamplesPerSecond * seconds,
               each = std::min(kLevelSamplesPerSecond * seconds / (settings.levels * work.histograms),
                               of_coarse_image / std::min(work.histograms, kLeastCoarseHistograms));
  settings.samples = static_cast<int>(std::clamp(each, 1.0 * kLeastSamples, 1.0 * kMostSamples)) / 2 * 2;
  settings.coarse_histograms = std::max(kLeastCoarseHistograms, static_cast<int>(of_coarse_image / settings.samples));
  return settings;
}

bool backgrounds_differ(const CaptureFile& capture, const std::vector<std::uint8_t>& used) {
  const GatedImage& counts = capture.counts;
  const auto points = static_cast<int>(capture.geometry.sensor.size());
  const auto is_used = [&](int point) { return used.empty() || used[point] != 0; };
  const auto for_each_count = [&](int first, int last, auto&& f) {
    for (int p = 0; p < counts.pixels(); ++p)
      for (int g = first; g < last && is_used(p % points); ++g) f(p % points, g, counts.at(p, g));
  };
  std::vector<double> by_bin(counts.gates, 0.0), by_point(points, 0.0);
  for_each_count(0, counts.gates, [&](int, int bin, double count) { by_bin[bin] += count; });
  const auto [first, last] = dark_before_light(by_bin);
  for_each_count(first, last, [&](int point, int, double count) { by_point[point] += count; });
  std::vector<double> counted;
  for (int point = 0; point < points; ++point)
    if (is_used(point)) counted.push_back(by_point[point]);
  return vary(counted);
}

TimeWindow time_window(const Mesh& mesh, const CaptureGeometry& geometry, const DetectorResponse& response,
                       double depth_resolution) {
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
  const double margin = std::max(8 * depth_resolution, 0.25 * (all.most - all.least));
  return {all.least - margin, all.most + margin};
}

void measure(const std::string& experiment, const Mesh& start, FitSettings& settings,
             const std::function<void(const std::string&)>& warning) {
  const Problem problem(load_experiment(experiment), warning);
  const GatedImage counts = problem.make_target();
  const Readings& readings = problem.readings();
  std::vector<double> theta = problem.parameters().initial();
  for (const Parameters::Block& block : problem.parameters().blocks())
    if (block.name == "background") std::fill_n(theta.begin() + block.begin, block.count, 0.0);
  const GatedImage light =
      problem.render(theta, problem.stream(Pass::render), {0, std::max(kLeastSamples, settings.samples / 4)});
  const std::vector<double> lights = by_gate(light, readings);
  const double gain = multiple_of(lights, by_gate(counts, readings));
  if (gain > 0 && std::isfinite(gain)) settings.gain = gain;
  const double photons = settings.gain * std::accumulate(lights.begin(), lights.end(), 0.0) / readings.pixels(counts);
  // Weights of slopes that are normal with such a standard deviation (optim/README.md).
  const double area = surface_area(start), edges = 3 * vertices_of(area, settings.edge_length);
  const double believed = std::min(1.0, kPhotonsPerSample * settings.samples / photons);
  const double unit = edges / (2 * readings.count(counts) * mean_square(counts, readings)) / believed;
  settings.bending /= believed;
  settings.motion = unit / (kMotionSlope * kMotionSlope);
  settings.adam_motion = unit / (kFreeSlope * kFreeSlope);
  const double slope = kAlbedoChange / std::sqrt(area);
  settings.albedo = unit / (slope * slope);
  const double change = kOutlineChange / settings.edge_length;
  settings.outline_slopes = unit / (change * change);
}

}  // namespace isochron
