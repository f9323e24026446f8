#include "optim/problem/darkness.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/bounds.h"
#include "optim/problem/loss.h"

namespace isochron {
namespace {

constexpr int kSamples = 16, kMostPixels = 32, kMostBounces = 16, kBins = 128;
constexpr double kRounding = 1e-12;  ///< of the background, which halves of an image bring in parts

/// The range narrowed to the bins of it that light falls into; empty where there are none.
std::optional<std::pair<double, double>> narrowed(const Problem& problem, const Scene& scene, double low, double high) {
  const double width = (high - low) / kBins;
  std::vector<double> centers;
  for (int i = 0; i < kBins; ++i) centers.push_back(low + (i + 0.5) * width);
  const GateSet bins(GateShape::boxcar(width), centers);
  const Experiment& experiment = problem.experiment();
  EstimatorOptions options;
  options.max_bounces =
      std::min(kMostBounces, std::max(experiment.estimator.max_bounces, experiment.target.max_bounces));
  options.sampling = Sampling::standard;
  const GatedImage image = Renderer(scene, bins, options).render(problem.stream(Pass::mix), {0, kSamples});
  int first = kBins, last = -1;
  for (int i = 0; i < kBins; ++i) {
    if (image.mean(i) == 0) continue;
    first = std::min(first, i);
    last = i;
  }
  if (last < 0) return std::nullopt;
  return std::pair{low + first * width, low + (last + 1) * width};
}

/// f(place in the image's data, what light has brought there) of every reading at theta. Nothing was brought to a reading that was left out, which
/// has not even its background.
template <class F>
void for_each_light(const Problem& problem, const std::vector<double>& theta, const GatedImage& image, F&& f) {
  const Scene scene = problem.parameters().apply(theta);
  for (int p = 0; p < image.pixels(); ++p) {
    const double background = scene.detector.background[scene.detector.background_of(scene.capture, p)];
    for (int g = 0; g < image.gates; ++g)
      for (int c = 0; c < image.channels; ++c) {
        const double light = image.at(p, g, c) - background;
        f(image.index(p, g, c), light <= kRounding * background ? 0 : light);
      }
  }
}

bool has_light(const Problem& problem, const std::vector<double>& theta, const GatedImage& image) {
  bool any = false;
  for_each_light(problem, theta, image, [&](std::size_t, double light) { any |= light != 0; });
  return any;
}

/// An image of readings at theta less their background.
GatedImage light_of(const Problem& problem, const std::vector<double>& theta, const GatedImage& image) {
  GatedImage light = image;
  for_each_light(problem, theta, image, [&](std::size_t i, double value) { light.data[i] = value; });
  return light;
}

bool is_black(const GatedImage& image, int gate) {
  for (int p = 0; p < image.pixels(); ++p)
    for (int c = 0; c < image.channels; ++c)
      if (image.at(p, gate, c) != 0) return false;
  return true;
}

/// Such as "0, 3 to 5".
std::string ranges(const std::vector<int>& numbers) {
  std::string text;
  for (std::size_t i = 0, end = 0; i < numbers.size(); i = end) {
    for (end = i + 1; end < numbers.size() && numbers[end] == numbers[end - 1] + 1;) ++end;
    const int first = numbers[i], last = numbers[end - 1];
    text += text.empty() ? "" : ", ";
    text += first == last       ? fmt::format("{}", first)
            : last == first + 1 ? fmt::format("{}, {}", first, last)
                                : fmt::format("{} to {}", first, last);
  }
  return text;
}

/// Shortest and longest path length in scene units among 16 paths per pixel of an image of 32 pixels at most across, with 16
/// bounces at most, to about a hundredth of their distance. Empty where no path brings light.
std::optional<std::pair<double, double>> path_length_range(const Problem& problem, const std::vector<double>& theta) {
  Scene scene = problem.parameters().apply(theta);
  int& width = scene.camera.width;
  int& height = scene.camera.height;
  if (!scene.capture) {
    const double shrink = std::min(1.0, static_cast<double>(kMostPixels) / std::max(width, height));
    width = std::max(1, static_cast<int>(width * shrink));
    height = std::max(1, static_cast<int>(height * shrink));
  }
  scene.detector = {.gain = 1,
                    .background = std::vector<double>(scene.detector.background.size()),
                    .time_offset = std::vector<double>(scene.detector.time_offset.size())};
  // A path of n bounces has n + 1 segments or, seen directly, one; none is longer than the scene.
  Bounds box;
  box.add(scene.camera.position);
  for (const Vec3& p : scene.positions) box.add(p);
  double to_instruments = 0;
  if (scene.capture) {
    for (const WallPoint& s : scene.capture->sensor) box.add(s.p);
    for (const WallPoint& l : scene.capture->spots) box.add(l.p);
    for (int pixel = 0; pixel < width * height; ++pixel)
      to_instruments = std::max(to_instruments, scene.capture->extra_length(pixel));
  }
  double index = 1;
  for (const Material& material : scene.materials)
    if (material.bsdf().transparent()) index = std::max(index, material.number(material.bsdf().index_number()));
  const double longest = to_instruments + (kMostBounces + 2) * index * length(box.high - box.low);
  const auto coarse = narrowed(problem, scene, 0, longest);
  return coarse ? narrowed(problem, scene, coarse->first, coarse->second) : coarse;
}

/// The target values where all are known, else `theta`: where to look for the target's light.
std::vector<double> point_of_target(const Problem& problem, const std::vector<double>& theta) {
  return problem.parameters().target_known() ? problem.parameters().target() : theta;
}

/// Histograms often begin with dark bins, which are nothing to warn of.
bool has_bins(const Problem& problem) {
  return problem.experiment().gates.kind == "bins";
}

/// Of gates that are `dark`.
std::string warning_about(const Problem& problem, const std::vector<double>& theta, const std::vector<int>& dark,
                          const std::string& what) {
  const int gates = problem.gates().size();
  if (dark.empty()) return {};
  if (static_cast<int>(dark.size()) < gates && has_bins(problem)) return {};
  std::string text = "no light reaches the gates of " + what;
  if (static_cast<int>(dark.size()) < gates)
    text = fmt::format("no light reaches {} {} of {} of {}", dark.size() == 1 ? "gate" : "gates", ranges(dark), gates,
                       what);
  const GateSpec& spec = problem.experiment().gates;
  const double unit = length_unit(spec);
  const auto shown = [&](double low, double high) {
    return fmt::format("{:.3g} to {:.3g} {}", low / unit, high / unit, name(spec.unit));
  };
  const auto range = path_length_range(problem, theta);
  text += range ? fmt::format("; paths with light are about {} long", shown(range->first, range->second))
          : problem.scene().capture
              ? "; no path with light was found at all: does a surface face the wall, in front of it?"
              : "; no path with light was found at all: does a lamp face the scene?";
  if (range && !spec.unbounded()) {
    const auto by_center = [&](int a, int b) { return problem.gates().center(a) < problem.gates().center(b); };
    const auto [first, last] = std::minmax_element(dark.begin(), dark.end(), by_center);
    const double low = problem.gates().center(*first), high = problem.gates().center(*last);
    text += low == high ? fmt::format("; its centre is {:.4g}", low / unit)
                        : fmt::format("; their centres are {:.4g} to {:.4g}", low / unit, high / unit);
  }
  return text;
}

/// Those that are black in all images.
std::vector<int> black_gates(const std::vector<GatedImage>& images) {
  std::vector<int> dark;
  for (int g = 0; g < images[0].gates; ++g)
    if (std::all_of(images.begin(), images.end(), [&](const GatedImage& image) { return is_black(image, g); }))
      dark.push_back(g);
  return dark;
}

}  // namespace

std::string darkness_warning(const Problem& problem, const std::vector<double>& theta, const GatedImage& image,
                             const std::string& what) {
  return warning_about(problem, theta, black_gates({light_of(problem, theta, image)}), what);
}

std::string darkness_warning(const Problem& problem, const std::vector<double>& theta, const std::vector<double>& means,
                             const std::string& what) {
  const Scene scene = problem.parameters().apply(theta);
  const int pixels = problem.scene().camera.width * problem.scene().camera.height;
  double background = 0;
  for (int p = 0; p < pixels; ++p)
    if (!scene.capture || !scene.capture->leaves_out(p))
      background += scene.detector.background[scene.detector.background_of(scene.capture, p)] / pixels;
  constexpr double kOfSums = 1e-9;  // over all pixels
  std::vector<int> dark;
  for (std::size_t g = 0; g < means.size(); ++g)
    if (std::abs(means[g] - background) <= kOfSums * background) dark.push_back(static_cast<int>(g));
  return warning_about(problem, theta, dark, what);
}

std::string darkness_warning(const Problem& problem, const std::vector<double>& theta, const GatedImage& image,
                             const GatedImage& target) {
  const std::vector<double> of_target = point_of_target(problem, theta);
  const bool lit = has_light(problem, theta, image), lit_target = has_light(problem, of_target, target);
  if (lit && lit_target && has_bins(problem)) return {};
  const GatedImage light = light_of(problem, theta, image), wanted = light_of(problem, of_target, target);
  if (!lit_target && lit) return warning_about(problem, of_target, black_gates({wanted}), "the target");
  if (!lit && lit_target) return warning_about(problem, theta, black_gates({light}), "the image");
  return warning_about(problem, theta, black_gates({light, wanted}), "the image and the target");
}

}  // namespace isochron
