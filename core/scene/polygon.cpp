#include "core/scene/polygon.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/scene/scene.h"

namespace isochron {
namespace {

constexpr std::size_t kMostConcaveCorners = 10000;
constexpr std::size_t kMostBentCorners = 1000;  // the time of the least area grows with their third power: seconds

struct Point {
  double x, y;
  bool operator==(const Point&) const = default;
};

/// Twice the signed area of abc. Of coordinates in single precision its sign is as good as exact.
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

/// The corners, their projections, in which the polygon is counter-clockwise, and their heights above these along a normal.
struct Outline {
  std::vector<int> corner;
  std::vector<Point> point;
  std::vector<double> height;
  double tolerance = 0;  ///< of heights, below which the polygon is flat
  bool bent() const {
    const auto [low, high] = std::minmax_element(height.begin(), height.end());
    return *high - *low > tolerance;
  }
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

/// Where on ab it meets cd, from 0 to 1, both of the projection; they cross.
double meeting(const Point& a, const Point& b, const Point& c, const Point& d) {
  const double at_a = turn(c, d, a), at_b = turn(c, d, b);
  return at_a / (at_a - at_b);
}

/// Sides that pass each other at a distance do not cross.
bool crosses_itself(const Outline& outline) {
  const std::size_t n = outline.size();
  const auto height = [&](std::size_t from, std::size_t to, double t) {
    return (1 - t) * outline.height[from] + t * outline.height[to];
  };
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 2; j < n; ++j) {
      const std::size_t k = i + 1, l = (j + 1) % n;
      const Point &a = outline.point[i], &b = outline.point[k], &c = outline.point[j], &d = outline.point[l];
      if (!cross_each_other(a, b, c, d)) continue;
      if (std::abs(height(i, k, meeting(a, b, c, d)) - height(j, l, meeting(c, d, a, b))) <= outline.tolerance)
        return true;
    }
  return false;
}

/// Newell's, as far as it is more than rounding; else that of the three consecutive corners with the most area.
Vec3 normal_of(const std::vector<Vec3>& p) {
  constexpr double kRounding = 1e-12;  // of the sum of all parts
  Vec3 normal, largest;
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec3 &q = p[(i + 1) % p.size()], &r = p[(i + 2) % p.size()];
    const Vec3 part = cross(p[i] - p[0], q - p[0]), at_corner = cross(q - p[i], r - q);
    normal += part;
    sum += length(part);
    if (length(at_corner) > length(largest)) largest = at_corner;
  }
  return length(normal) > kRounding * sum ? normal : largest;
}

/// Corners that do not repeat the one before, and their projection. Empty where all lie on one line.
Outline project(const std::vector<Vec3>& positions, const std::vector<int>& corners) {
  Outline outline;
  for (const int corner : corners)
    if (outline.corner.empty() || positions[corner] != positions[outline.corner.back()])
      outline.corner.push_back(corner);
  while (outline.size() > 1 && positions[outline.corner.back()] == positions[outline.corner.front()])
    outline.corner.pop_back();
  std::vector<Vec3> p;
  double extent = 0;
  for (const int corner : outline.corner) {
    p.push_back(positions[corner]);
    extent = std::max(extent, length(p.back() - p.front()));
  }
  const Vec3 normal = normal_of(p);
  int axis = 0;
  for (int i : {1, 2})
    if (std::abs(normal[i]) > std::abs(normal[axis])) axis = i;
  if (!(std::abs(normal[axis]) > 0)) return {};
  const int right = (axis + 1) % 3, up = (axis + 2) % 3;
  for (const Vec3& q : p) {
    outline.point.push_back(normal[axis] > 0 ? Point{q[right], q[up]} : Point{q[up], q[right]});
    outline.height.push_back(dot(q - p[0], normal) / length(normal));
  }
  outline.tolerance = kCoplanarAngle * extent;
  return outline;
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
      if (++tried > n)  // sides of a flat polygon that lie on each other leave a line
        return !outline.bent() && std::all_of(outline.point.begin(), outline.point.end(), [&](const Point& p) {
          return turn(outline.point[0], outline.point[1], p) == 0;
        });
      continue;
    }
    if (!spike) triangles.push_back({outline.corner[before], outline.corner[tip], outline.corner[behind]});
    outline.corner.erase(outline.corner.begin() + static_cast<std::ptrdiff_t>(tip));
    outline.point.erase(outline.point.begin() + static_cast<std::ptrdiff_t>(tip));
    tried = 0;
  }
  return true;
}

/// The triangulation of the least area among those with the fewest triangles that have as good as none. Sides are kept
/// whatever the polygon's shape.
class LeastArea {
 public:
  LeastArea(const std::vector<Vec3>& positions, const std::vector<int>& corners)
      : corners_(corners), n_(corners.size()) {
    for (const int corner : corners) points_.push_back(positions[corner]);
    best_.resize(n_ * n_);
    for (std::size_t span = 2; span < n_; ++span)
      for (std::size_t from = 0; from + span < n_; ++from) best_[from * n_ + from + span] = best_of(from, from + span);
  }
  void append(std::vector<std::array<int, 3>>& triangles) const { append(0, n_ - 1, triangles); }

 private:
  /// Of the corners from one to another.
  struct Cut {
    int flat = 0;  ///< triangles without area
    double area = 0;
    std::size_t tip = 0;  ///< third corner of the triangle at the chord between both ends
  };

  Cut best_of(std::size_t from, std::size_t to) const {
    Cut best{std::numeric_limits<int>::max(), 0, from + 1};
    for (std::size_t tip = from + 1; tip < to; ++tip) {
      const Cut &left = best_[from * n_ + tip], &right = best_[tip * n_ + to];
      const Vec3 a = points_[tip] - points_[from], b = points_[to] - points_[from];
      const double area = length(cross(a, b));
      const double square = std::max({length_squared(a), length_squared(b), length_squared(b - a)});
      const int flat = left.flat + right.flat + (area <= kCoplanarAngle * square);
      const double sum = left.area + right.area + area;
      if (std::tie(flat, sum) < std::tie(best.flat, best.area)) best = {flat, sum, tip};
    }
    return best;
  }
  void append(std::size_t from, std::size_t to, std::vector<std::array<int, 3>>& triangles) const {
    if (to < from + 2) return;
    const std::size_t tip = best_[from * n_ + to].tip;
    triangles.push_back({corners_[from], corners_[tip], corners_[to]});
    append(from, tip, triangles);
    append(tip, to, triangles);
  }

  const std::vector<int>& corners_;
  std::size_t n_;
  std::vector<Vec3> points_;
  std::vector<Cut> best_;
};

}  // namespace

std::string cut_polygon(const std::vector<Vec3>& positions, const std::vector<int>& corners,
                        std::vector<std::array<int, 3>>& triangles) {
  if (corners.size() == 3) {
    const int a = corners[0], b = corners[1], c = corners[2];
    if (a != b && b != c && c != a) triangles.push_back({a, b, c});
    return {};
  }
  const Outline outline = project(positions, corners);
  if (outline.size() == 0) return {};
  if (strictly_convex(outline)) {
    for (std::size_t k = 2; k < outline.size(); ++k)
      triangles.push_back({outline.corner[0], outline.corner[k - 1], outline.corner[k]});
    return {};
  }
  if (outline.size() > kMostConcaveCorners)
    return fmt::format("is concave and has {} corners (at most {} are allowed)", outline.size(), kMostConcaveCorners);
  if (crosses_itself(outline)) return "crosses itself";
  if (outline.bent() && outline.size() <= kMostBentCorners) {
    LeastArea(positions, outline.corner).append(triangles);
    return {};
  }
  return cut_ears(outline, triangles) ? "" : "crosses itself";
}

}  // namespace isochron
