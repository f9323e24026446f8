// The light side of a boundary segment: what a surface point sends towards a given point, gathered by a
// standard walk or, under narrow gates, by ellipsoidal connections of lengths drawn from the gates.
#pragma once
#include <span>

#include "core/techniques/ellipsoidal.h"
#include "core/techniques/standard_walk.h"

namespace isochron {

/// Light that vertex 1 of a path sends to vertex 0.
struct GatheredLight {
  Rgb value;               ///< contribution over density from vertex 1 on, without the gate
  double length;           ///< from vertex 1 to the emitter
  int bounces;             ///< scattering vertices
  int target;              ///< which of the lengths before the path it is meant for; -1: all
  SurfacePoint next = {};  ///< vertex 2; none (triangle -1) where vertex 1 emits the light
};

/// What a boundary segment's light is joined with.
struct CameraSide {
  int pixel;      ///< or GatePick::kImage
  double length;  ///< from the camera to where the light side begins
};

template <class Sink>
class LightSide {
 public:
  /// `arcs`: by ellipsoidal connections.
  LightSide(Worker<Sink>& worker, bool arcs)
      : worker_(worker),
        scene_(worker.scene),
        arcs_(arcs),
        path_(worker.options.max_bounces),
        connections_(worker, {}, Receiver{*this}) {}

  /// Light that x sends towards `towards`, to be joined with the paths `before`. The result lives until the
  /// next call.
  const std::vector<GatheredLight>& gather(const SurfacePoint& towards, const SurfacePoint& x,
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
      for (const CameraSide& side : before) {
        const double pick = rng.uniform(), u = rng.uniform();
        const auto length = worker_.pick.sample_length(side.pixel, pick, u);
        lengths_.push_back(length ? *length - side.length : 0);
      }
      std::swap(worker_.path, path_);
      connections_.gather(lengths_, max_bounces, rng);
      std::swap(worker_.path, path_);
    } else {
      const auto [shortest, longest] = std::ranges::minmax(before, {}, &CameraSide::length);
      walk_standard(worker_, path_, max_bounces,
                    {worker_.gates.lower() - longest.length, worker_.gates.upper() - shortest.length}, rng,
                    Visitor{lights_, path_});
    }
    return lights_;
  }

 private:
  struct Visitor {
    std::vector<GatheredLight>& lights;
    const Path& path;
    bool wants() const { return true; }
    void take(const Rgb& value) {
      lights.push_back(
          {value, path.length.back(), path.size() - 2, -1, path.size() > 2 ? path.vertex[2] : SurfacePoint{}});
    }
  };
  struct Receiver {
    LightSide& side;
    void take(int target, int bounces, const Rgb& value) {
      const double length = side.lengths_[target];
      const CameraSide& before = side.before_[target];
      const double pdf = side.worker_.pick.length_pdf(before.pixel, length + before.length);
      side.lights_.push_back({value * (1 / pdf), length, bounces, target, side.worker_.path.vertex[2]});
    }
  };

  Worker<Sink>& worker_;
  const PreparedScene& scene_;
  const bool arcs_;
  Path path_;
  EllipsoidalConnections<Sink, Receiver> connections_;
  std::span<const CameraSide> before_;
  std::vector<double> lengths_;  ///< drawn from the gates, less `before_`
  std::vector<GatheredLight> lights_;
};

}  // namespace isochron
