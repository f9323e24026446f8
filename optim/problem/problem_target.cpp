// Targets, and images of many samples such as rendered ones are.
#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.h"
#include "optim/problem/photon_noise.h"
#include "optim/problem/problem.h"

namespace isochron {

GatedImage Problem::read_target(const std::string& file) const {
  GatedImage image = read_exr(file);
  const Camera& camera = scene_.camera;
  const auto require = [&](bool equal, const std::string& found, const std::string& wanted) {
    if (!equal)
      throw InputError(fmt::format("{}: {} in the target images (the experiment has {})", file, found, wanted));
  };
  require(image.width == camera.width && image.height == camera.height,
          fmt::format("{} x {} pixels", image.width, image.height),
          fmt::format("{} x {}", camera.width, camera.height));
  require(image.gates == gates_.size(), fmt::format("{} gates", image.gates), fmt::format("{}", gates_.size()));
  const int channels = scene_.grey ? 1 : 3;
  require(image.channels == channels, image.channels == 1 ? "one grey channel (Y)" : "three channels (R, G, B)",
          channels == 1 ? "one grey channel, Y" : "three channels, R, G and B");
  require_usable(image, file);
  return image;
}

template <class F>
void Problem::render_parts(const std::vector<double>& theta, const EstimatorOptions& options, const Stream& stream,
                           int samples, const std::string& name, F&& use) const {
  const int parts = std::min(32, samples);
  const Scene scene = parameters_->apply(theta);
  const Renderer renderer(scene, gates_, options);
  ProgressStage stage(name, parts);
  for (int i = 0; i < parts; ++i) {
    const SampleRange range = Share{i, parts}.of(samples);
    use(renderer.render(stream, range), range.count(), i, parts);
    stage.advance();
  }
}

GatedImage Problem::render_in_parts(const std::vector<double>& theta, const EstimatorOptions& options,
                                    const Stream& stream, int samples, const std::string& name) const {
  ImageMean mean;
  render_parts(theta, options, stream, samples, name,
               [&](const GatedImage& image, int count, int, int) { mean.add(image, count); });
  return mean.mean();
}

SplitImage Problem::render_halves_in_parts(const std::vector<double>& theta, const EstimatorOptions& options,
                                           const Stream& stream, int samples, const std::string& name) const {
  ImageMean halves[2];
  int counts[2] = {};
  render_parts(theta, options, stream, samples, name, [&](const GatedImage& image, int count, int i, int parts) {
    const int half = 2 * i >= parts;
    halves[half].add(image, count);
    counts[half] += count;
  });
  if (counts[1] == 0) return {halves[0].mean(), {}, 1};
  return join_halves(halves[0].mean(), counts[0], halves[1].mean(), counts[1]);
}

GatedImage Problem::make_target() const {
  const TargetSpec& target = experiment_.target;
  if (!target.images.empty()) return read_target(target.images);
  if (counts_) return *counts_;
  const Stream stream{target.seed, 0, pass_number(Pass::target)};
  EstimatorOptions options = estimator();
  options.max_bounces = target.max_bounces;
  GatedImage image = render_in_parts(parameters_->target(), options, stream, target.samples, "rendering the target");
  const Stream noise{target.seed, 0, pass_number(Pass::photon_noise)};
  if (target.photons > 0) add_photon_noise(image, target.photons, noise);
  if (target.counts) draw_counts(image, noise);
  require_usable(image, experiment_.file + ": target");
  return image;
}

}  // namespace isochron
