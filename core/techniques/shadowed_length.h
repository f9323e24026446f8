// Lengths of direct light that grazes a given edge point: from the camera by a point D of a given plane, past the edge point, to an
// emitter's plane, as a function of where the image shows D.
#pragma once
#include <array>
#include <cmath>
#include <optional>

#include "core/paths/prepared_scene.h"

namespace isochron {

class ShadowedLength {
 public:
  /// D is in the plane of `receiver`, y the edge point.
  ShadowedLength(const PreparedScene& scene, int receiver, const Vec3& y, int emitter)
      : camera_(scene.camera),
        y_(y),
        plane_(scene.normal(receiver)),
        emitter_(scene.normal(emitter)),
        camera_height_(scene.height_over(receiver, scene.camera.position)),
        height_y_(scene.height_over(emitter, y)),
        height_camera_(scene.height_over(emitter, scene.camera.position)) {}

  struct Value {
    double length;
    std::array<double, 2> rate;  ///< by the image coordinates, per pixel
  };
  /// Empty where D is not before the camera, or the edge point not between D and the emitter.
  std::optional<Value> at(const std::array<double, 2>& image) const {
    const Vec3 ray = camera_.ray(image[0], image[1]);
    const double towards = dot(plane_, ray), depth = -camera_height_ / towards;
    const Vec3 d = ray * depth;  // from the camera
    const double height = height_camera_ + dot(emitter_, d);
    if (!(depth > 0 && height_y_ > 0 && height > height_y_)) return std::nullopt;
    const Vec3 to_y = y_ - camera_.position - d;
    const double r = isochron::length(d), r_y = isochron::length(to_y), stretch = height / (height - height_y_);
    const Vec3 gradient =
        d / r - to_y * (stretch / r_y) - emitter_ * (r_y * height_y_ / ((height - height_y_) * (height - height_y_)));
    Value value{r + r_y * stretch, {}};
    for (int axis = 0; axis < 2; ++axis) {
      const Vec3 step = camera_.ray_step(axis);
      value.rate[axis] = dot(gradient, step - ray * (dot(plane_, step) / towards)) * depth;
    }
    return value;
  }

  /// The coordinate `axis`, from that of `image` on within one pixel, at which the length is tau; the other is that of `image`. Empty
  /// unless it is longer at one end and shorter at the other.
  std::optional<double> solve(std::array<double, 2> image, int axis, double tau) const {
    double low = image[axis], high = low + 1;
    const auto excess = [&](double x) {
      image[axis] = x;
      return at(image);
    };
    const auto first = excess(low), last = excess(high);
    if (!first || !last || !((first->length - tau) * (last->length - tau) < 0)) return std::nullopt;
    const bool rises = last->length > tau;
    double x = low + (high - low) * (tau - first->length) / (last->length - first->length);
    // Newton's steps inside of the bracket; where they leave it, its middle.
    constexpr int kMostSteps = 100;
    for (int i = 0; i < kMostSteps; ++i) {
      const auto here = excess(x);
      if (!here) return std::nullopt;
      (here->length > tau) == rises ? high = x : low = x;
      double next = x - (here->length - tau) / here->rate[axis];
      if (!(next > low && next < high)) next = low + 0.5 * (high - low);
      if (next == x || next == low || next == high) break;
      x = next;
    }
    return x;
  }

 private:
  const CameraModel& camera_;
  Vec3 y_, plane_, emitter_;
  double camera_height_, height_y_, height_camera_;
};

}  // namespace isochron
