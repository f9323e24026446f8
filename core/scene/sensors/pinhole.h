// The pinhole camera: what files say of it, and its mapping between image plane, measured in pixels, and directions.
#pragma once
#include <array>

#include "core/base/constants.h"
#include "core/base/description.h"
#include "core/base/vec.h"

namespace isochron {

/// `fov` is in degrees, across the image's width; rows count from the top, columns from the left.
struct Camera {
  Vec3 position, look_at, up{0, 1, 0};
  double fov = 40;
  int width = 64, height = 64;
};

/// Its keys.
void describe(Keys& keys, Camera& camera);
/// [width, height] of an image.
Field resolution_field(int& width, int& height);
/// A direction of a scene file, which becomes a unit vector.
Field unit_direction(Vec3& variable);

/// Image coordinates (u, v) run over [0, width) x [0, height), v downwards; one pixel is a unit square.
class CameraModel {
 public:
  explicit CameraModel(const Camera& camera)
      : position(camera.position),
        forward(normalize(camera.look_at - camera.position)),
        width(camera.width),
        height(camera.height) {
    right_ = normalize(cross(forward, camera.up));
    up_ = cross(right_, forward);
    pixel_size_ = 2 * std::tan(0.5 * camera.fov * kPi / 180) / camera.width;
    cos_corner = dot(direction(0, 0), forward);
  }

  int pixels() const { return width * height; }

  /// Direction through image point (u, v), of depth one.
  Vec3 ray(double u, double v) const {
    return forward + right_ * ((u - 0.5 * width) * pixel_size_) + up_ * ((0.5 * height - v) * pixel_size_);
  }
  /// How `ray` changes from one pixel to the next, in u (axis 0) or v (axis 1).
  Vec3 ray_step(int axis) const { return (axis == 0 ? right_ : -up_) * pixel_size_; }
  /// Unit direction through image point (u, v).
  Vec3 direction(double u, double v) const { return normalize(ray(u, v)); }
  /// (u, v) of a point before the camera.
  std::array<double, 2> image_point(const Vec3& p) const {
    const Vec3 d = p - position;
    const double depth = dot(d, forward);
    return {0.5 * width + dot(d, right_) / (depth * pixel_size_), 0.5 * height - dot(d, up_) / (depth * pixel_size_)};
  }

  /// Pixel that sees the point p, or -1 when p is behind the camera or outside the image.
  int project(const Vec3& p) const {
    if (!(dot(p - position, forward) > 0)) return -1;
    const auto [u, v] = image_point(p);
    if (!(u >= 0 && u < width && v >= 0 && v < height)) return -1;
    return static_cast<int>(v) * width + static_cast<int>(u);
  }

  /// Whether all of what lies between the points is beyond one border of the image, or behind the camera.
  template <class... Points>
  bool misses_image(const Points&... points) const {
    const double across = 0.5 * width * pixel_size_, down = 0.5 * height * pixel_size_;
    for (const Vec3& outwards :
         {-forward, right_ - forward * across, -right_ - forward * across, up_ - forward * down, -up_ - forward * down})
      if (((dot(points - position, outwards) > 0) && ...)) return true;
    return false;
  }

  /// Width of a pixel per depth.
  double pixel_size() const { return pixel_size_; }

  /// Gradient, with respect to a point at d from the camera, of its image coordinate u (axis 0) or v (axis 1).
  Vec3 image_gradient(const Vec3& d, int axis) const {
    const Vec3 across = axis == 0 ? right_ : -up_;
    const double depth = dot(d, forward);
    return (across - forward * (dot(d, across) / depth)) / (depth * pixel_size_);
  }

  /// du/domega: image area (pixels) per solid angle along the unit direction d.
  double image_area_per_solid_angle(const Vec3& d) const {
    const double c = dot(d, forward);
    return 1 / (pixel_size_ * pixel_size_ * c * c * c);
  }

  Vec3 position, forward;
  int width, height;
  double cos_corner;  ///< between `forward` and the image's corners

 private:
  Vec3 right_, up_;
  double pixel_size_;
};

}  // namespace isochron
