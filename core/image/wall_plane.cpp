#include "core/image/wall_plane.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace isochron {
namespace {

/// Rows of a symmetric matrix.
using Symmetric = std::array<Vec3, 3>;

Vec3 times(const Symmetric& m, const Vec3& v) {
  return {dot(m[0], v), dot(m[1], v), dot(m[2], v)};
}

double trace(const Symmetric& m) {
  return m[0].x + m[1].y + m[2].z;
}

/// The direction of the largest eigenvalue, by squaring the matrix until nothing else is left of it. Of equal eigenvalues, any.
Vec3 principal(Symmetric m) {
  constexpr int kSquarings = 20;
  for (int i = 0; i < kSquarings; ++i) {
    const double scale = 1 / trace(m);
    for (Vec3& row : m) row = row * scale;
    m = {times(m, m[0]), times(m, m[1]), times(m, m[2])};
  }
  return normalize(
      *std::max_element(m.begin(), m.end(), [](const Vec3& a, const Vec3& b) { return dot(a, a) < dot(b, b); }));
}

}  // namespace

std::optional<Vec3> plane_normal(const std::vector<Vec3>& points) {
  constexpr double kOnALine = 1e-10;  // of the variance along it: what points that are rounded to 32 bits leave
  Vec3 mean;
  for (const Vec3& p : points) mean = mean + p / static_cast<double>(points.size());
  Symmetric covariance{};
  for (const Vec3& p : points) {
    const Vec3 d = p - mean;
    covariance = {covariance[0] + d * d.x, covariance[1] + d * d.y, covariance[2] + d * d.z};
  }
  const double all = trace(covariance);
  if (!(all > 0)) return std::nullopt;
  const Vec3 along = principal(covariance);
  const double variance = dot(along, times(covariance, along));
  const Symmetric rest{covariance[0] - along * (variance * along.x), covariance[1] - along * (variance * along.y),
                       covariance[2] - along * (variance * along.z)};
  if (!(trace(rest) > kOnALine * all)) return std::nullopt;
  const Vec3 normal = normalize(cross(along, principal(rest)));
  const double largest = std::max({normal.x, normal.y, normal.z, -normal.x, -normal.y, -normal.z});
  return std::max({normal.x, normal.y, normal.z}) == largest ? normal : normal * -1;
}

}  // namespace isochron
