// Captures of hidden points and plates, by the closed form of light that is scattered once.
#pragma once
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/image/capture_file.h"
#include "optim/reconstruct/time_filter.h"
#include "tests/seed.h"

namespace isochron {

/// A small diffuse patch.
struct HiddenPatch {
  Vec3 position, normal;
  double area = 1;  ///< times albedo
};

/// A wall in the plane z = 0, side by side points, corners included.
inline CaptureGeometry square_wall(int points, double side) {
  CaptureGeometry wall;
  wall.columns = wall.rows = points;
  for (int row = 0; row < points; ++row) {
    for (int column = 0; column < points; ++column)
      wall.sensor.push_back({side * (column / (points - 1.0) - 0.5), side * (0.5 - row / (points - 1.0)), 0});
  }
  wall.sensor_normal.assign(wall.sensor.size(), {0, 0, 1});
  return wall;
}

inline void add_spots(CaptureGeometry& wall, const std::vector<Vec3>& spots) {
  wall.confocal = false;
  wall.laser = spots;
  wall.laser_normal.assign(spots.size(), {0, 0, 1});
}

/// A plate of patches that are `step` wide, parallel to the wall and facing it.
inline std::vector<HiddenPatch> plate(const Vec3& middle, double width, double height, double step) {
  std::vector<HiddenPatch> patches;
  const int columns = static_cast<int>(std::lround(width / step)), rows = static_cast<int>(std::lround(height / step));
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const Vec3 offset{(i + 0.5) * step - 0.5 * width, (j + 0.5) * step - 0.5 * height, 0};
      patches.push_back({middle + offset, {0, 0, -1}, step * step});
    }
  }
  return patches;
}

/// Expected counts, `light` per sensor point and spot on average, without background.
inline CaptureFile expected_counts(const CaptureGeometry& wall, const std::vector<HiddenPatch>& patches, int bins,
                                   double bin, double light, const DetectorResponse& response = {}) {
  CaptureFile capture;
  capture.geometry = wall;
  capture.delta_t = bin;
  capture.counts = GatedImage(wall.columns, wall.rows * wall.spots(), bins, 1);
  const int points = static_cast<int>(wall.sensor.size());
  double total = 0;
  for (int pixel = 0; pixel < capture.counts.pixels(); ++pixel) {
    const Vec3& sensor = wall.sensor[pixel % points];
    const Vec3& lit = wall.confocal ? sensor : wall.laser[pixel / points];
    for (const HiddenPatch& patch : patches) {
      const Vec3 back = patch.position - sensor, there = patch.position - lit;
      const double r = length(back), q = length(there);
      const double cosines =
          back.z * there.z * std::max(0.0, -dot(back, patch.normal)) * std::max(0.0, -dot(there, patch.normal));
      const double power = patch.area * cosines / std::pow(r * q, 4);
      double path = r + q;
      if (wall.accounts_first_and_last) path += length(wall.laser_origin - lit) + length(wall.sensor_origin - sensor);
      for (int i = 0; i < bins; ++i) {
        const double low = i * bin - path, high = low + bin;
        const double share =
            response ? response->cumulated(high).below - response->cumulated(low).below : low <= 0 && high > 0;
        capture.counts.at(pixel, i) += power * share;
        total += power * share;
      }
    }
  }
  for (double& value : capture.counts.data) value *= light * capture.counts.pixels() / total;
  return capture;
}

/// Poisson numbers of these means and a background.
inline CaptureFile counted(CaptureFile capture, double background, std::mt19937& random) {
  for (double& value : capture.counts.data) value = std::poisson_distribution<int>(value + background)(random);
  return capture;
}

}  // namespace isochron
