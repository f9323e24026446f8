#include "core/paths/hidden_geometry.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "core/base/bounds.h"

namespace isochron {
namespace {

/// Puts two zero bits after each of the lowest 21.
std::uint64_t spread(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

}  // namespace

std::vector<int> spatial_order(const std::vector<Vec3>& points) {
  Bounds box;
  for (const Vec3& p : points) box.add(p);
  const Vec3 size = box.high - box.low;
  const double largest = std::max({size.x, size.y, size.z});
  std::vector<std::uint64_t> code(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const double fraction = largest > 0 ? (points[i][axis] - box.low[axis]) / largest : 0;
      code[i] |= spread(static_cast<std::uint64_t>(fraction * 0x1fffff)) << axis;
    }
  std::vector<int> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return code[a] < code[b]; });
  return order;
}

}  // namespace isochron
