#include "core/techniques/light_side.h"

#include <algorithm>
#include <utility>

#include "core/techniques/standard_walk.h"

namespace isochron {
namespace {

/// Keeps the light that a standard walk along `path` finds.
struct Visitor {
  std::vector<GatheredLight>& lights;
  const Path& path;
  bool wants() const { return true; }
  void take(const Rgb& value) {
    lights.push_back(
        {value, path.length.back(), path.size() - 2, -1, path.size() > 2 ? path.vertex[2] : SurfacePoint{}});
  }
};

}  // namespace

LightSide::LightSide(Worker& worker, bool arcs)
    : worker_(worker),
      scene_(worker.scene),
      arcs_(arcs && scene_.lights.empty()),
      path_(worker.options.max_bounces),
      connections_(worker, {}, this) {}

const std::vector<GatheredLight>& LightSide::gather(const SurfacePoint& towards, const SurfacePoint& x,
                                                    std::span<const CameraSide> before, int max_bounces, Rng& rng) {
  lights_.clear();
  path_.start(towards, 0);
  path_.push(scene_, x, 0);
  if (arcs_) {
    before_ = before;
    if (scene_.emits(x.triangle)) {
      const Rgb radiance = scene_.emitted(x, normalize(towards.p - x.p));
      if (!radiance.is_black()) lights_.push_back({radiance, 0, 0, -1});
    }
    lengths_.clear();
    whole_lengths_.clear();
    for (const CameraSide& side : before) {
      const double pick = rng.uniform(), u = rng.uniform();
      whole_lengths_.push_back(worker_.pick.sample_length(side.pixel, pick, u).value_or(0));
      lengths_.push_back(whole_lengths_.back() - side.length);
    }
    std::swap(worker_.path, path_);
    connections_.gather(lengths_, max_bounces, rng);
    std::swap(worker_.path, path_);
  } else {
    const auto [shortest, longest] = std::ranges::minmax(before, {}, &CameraSide::length);
    walk_standard(worker_, path_, before[0].pixel, max_bounces,
                  {worker_.gates.lower() - longest.length, worker_.gates.upper() - shortest.length}, rng,
                  Visitor{lights_, path_});
  }
  return lights_;
}

void LightSide::take(int target, int bounces, const Rgb& value) {
  const double length = whole_lengths_[target];
  const double pdf = worker_.pick.length_pdf(before_[target].pixel, length);
  lights_.push_back({value * (1 / pdf), length, bounces, target, worker_.path.vertex[2]});
}

}  // namespace isochron
