#include "core/scene/polygon.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace isochron {
namespace {

constexpr std::size_t kMostConcaveCorners = 10000;

struct Point {
  double x, y;
  bool operator==(const Point&) const = default;
};

/// Twice the signed area of abc. Differences of floats are as good as exact in double precision, so that the sign can be
/// relied on.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool opposite(double a, double b) {
  return (a > 0 && b < 0) || (a < 0 && b > 0);
}

/// Whether the open segments ab and cd cross in one point; touching is no crossing.
bool cross_each_other(const Point& a, const Point& b, const Point& c, const Point& d) {
  return opposite(turn(a, b, c), turn(a, b, d)) && opposite(turn(c, d, a), turn(c, d, b));
}

/// In the closed triangle abc, counter-clockwise, but at none of its corners.
bool inside(const Point& p, const Point& a, const Point& b, const Point& c) {
  return p != a && p != b && p != c && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
}

/// The corners with their projections, in which the polygon is counter-clockwise.
struct Outline {
  std::vector<int> corner;
  std::vector<Point> point;
  std::size_t size() const { return corner.size(); }
};

bool strictly_convex(const Outline& outline) {
  const std::size_t n = outline.size();
  int reversals = 0;  // of the sides' horizontal direction: two in a polygon that goes round once
  double last = 0;
  for (std::size_t i = 0; i <= n; ++i) {
    const Point &a = outline.point[i % n], &b = outline.point[(i + 1) % n], &c = outline.point[(i + 2) % n];
    if (i < n && !(turn(a, b, c) > 0)) return false;
    const double step = b.x - a.x;
    if (step == 0) continue;
    if (opposite(last, step)) ++reversals;
    last = step;
  }
  return reversals <= 2;
}

bool crosses_itself(const Outline& outline) {
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 2; j < n; ++j)
      if (cross_each_other(outline.point[i], outline.point[i + 1], outline.point[j], outline.point[(j + 1) % n]))
        return true;
  return false;
}

/// Corners that do not repeat the one before, and their projection. Empty where they have no normal.
Outline project(const std::vector<Vec3>& positions, const std::vector<int>& corners) {
  Outline outline;
  for (const int corner : corners)
    if (outline.corner.empty() || positions[corner] != positions[outline.corner.back()])
      outline.corner.push_back(corner);
  while (outline.size() > 1 && positions[outline.corner.back()] == positions[outline.corner.front()])
    outline.corner.pop_back();
  Vec3 normal;
  const Vec3& origin = positions[corners.front()];
  for (std::size_t i = 0; i < outline.size(); ++i)
    normal +=
        cross(positions[outline.corner[i]] - origin, positions[outline.corner[(i + 1) % outline.size()]] - origin);
  int axis = 0;
  for (int i : {1, 2})
    if (std::abs(normal[i]) > std::abs(normal[axis])) axis = i;
  if (!(std::abs(normal[axis]) > 0)) return {};
  const int right = (axis + 1) % 3, up = (axis + 2) % 3;
  for (const int corner : outline.corner) {
    const Vec3& p = positions[corner];
    outline.point.push_back(normal[axis] > 0 ? Point{p[right], p[up]} : Point{p[up], p[right]});
  }
  return outline;
}

/// Whether all corners lie on one line.
bool has_no_area(const std::vector<Vec3>& positions, const std::vector<int>& corners) {
  for (std::size_t k = 2; k < corners.size(); ++k) {
    const Vec3& a = positions[corners[0]];
    if (cross(positions[corners[k - 1]] - a, positions[corners[k]] - a) != Vec3{}) return false;
  }
  return true;
}

bool is_ear(const Outline& outline, std::size_t before, std::size_t tip, std::size_t behind) {
  const Point &a = outline.point[before], &b = outline.point[tip], &c = outline.point[behind];
  if (!(turn(a, b, c) > 0)) return false;
  return std::none_of(outline.point.begin(), outline.point.end(), [&](const Point& p) { return inside(p, a, b, c); });
}

/// Cuts ears off until nothing is left; false where there is none to cut.
bool cut_ears(Outline outline, std::vector<std::array<int, 3>>& triangles) {
  std::size_t tip = 0, tried = 0;
  while (outline.size() >= 3) {
    const std::size_t n = outline.size();
    tip %= n;
    const std::size_t before = (tip + n - 1) % n, behind = (tip + 1) % n;
    // What goes there and back the same way, as to a hole whose sides are gone, has nothing between.
    const bool spike = outline.point[before] == outline.point[behind];
    if (!spike && !is_ear(outline, before, tip, behind)) {
      ++tip;
      if (++tried > n)
        return std::all_of(outline.point.begin(), outline.point.end(),
                           [&](const Point& p) { return turn(outline.point[0], outline.point[1], p) == 0; });
      continue;
    }
    if (!spike) triangles.push_back({outline.corner[before], outline.corner[tip], outline.corner[behind]});
    outline.corner.erase(outline.corner.begin() + static_cast<std::ptrdiff_t>(tip));
    outline.point.erase(outline.point.begin() + static_cast<std::ptrdiff_t>(tip));
    tried = 0;
  }
  return true;
}

}  // namespace

std::string cut_polygon(const std::vector<Vec3>& positions, const std::vector<int>& corners,
                        std::vector<std::array<int, 3>>& triangles) {
  if (corners.size() == 3) {
    const int a = corners[0], b = corners[1], c = corners[2];
    if (a != b && b != c && c != a) triangles.push_back({a, b, c});
    return {};
  }
  const Outline outline = project(positions, corners);
  if (outline.size() == 0) return has_no_area(positions, corners) ? "" : "crosses itself";
  if (strictly_convex(outline)) {
    for (std::size_t k = 2; k < outline.size(); ++k)
      triangles.push_back({outline.corner[0], outline.corner[k - 1], outline.corner[k]});
    return {};
  }
  if (outline.size() > kMostConcaveCorners)
    return fmt::format("is concave and has {} corners (at most {} are allowed)", outline.size(), kMostConcaveCorners);
  if (crosses_itself(outline) || !cut_ears(outline, triangles)) return "crosses itself";
  return {};
}

}  // namespace isochron
