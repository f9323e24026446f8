#include "core/scene/behind_wall.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace isochron {

std::string behind_wall(const Scene& scene) {
  constexpr double kOnWall = 1e-6;  // of the largest coordinate: floats know 1e-7
  double largest = 0;
  for (const Vec3& p : scene.positions) largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  std::vector<std::pair<Vec3, double>> planes;  // normal, height
  for (const WallPoint& s : scene.capture->sensor) {
    const double height = dot(s.n, s.p);
    const auto same = [&](const auto& plane) {
      return length(plane.first - s.n) <= kOnWall && std::abs(plane.second - height) <= kOnWall * largest;
    };
    if (std::none_of(planes.begin(), planes.end(), same)) planes.emplace_back(s.n, height);
  }
  for (const Shape& shape : scene.shapes) {
    if (!shape.hidden) continue;
    for (const auto& [n, height] : planes) {
      double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
      for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v) {
        const double d = dot(n, scene.positions[v]) - height;
        nearest = std::min(nearest, d);
        farthest = std::max(farthest, d);
      }
      const double tolerance = kOnWall * largest;
      if (nearest <= tolerance && (farthest > tolerance || nearest < -tolerance))
        return fmt::format(
            "shape '{}' reaches to {:.4g} before the wall at a sensor point (allowed: hidden shapes in front of it, "
            "on the side that `normal` points to)",
            shape.name, nearest);
    }
  }
  return {};
}

}  // namespace isochron
