// What a capture reads of a parallelogram behind a black one, by quadrature over convex polygons: the board less the shadows of
// the sensor point and of the laser's spot. Shadows are sharp, so differences of readings are smooth.
#pragma once
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "core/base/constants.h"
#include "core/base/vec.h"

namespace isochron::testing {

struct Point2 {
  double x, y;
};
using Polygon = std::vector<Point2>;  // convex, counter-clockwise

inline double turn(const Point2& a, const Point2& b, const Point2& p) {
  return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

inline Polygon counter_clockwise(Polygon p) {
  if (turn(p[0], p[1], p[2]) < 0) std::reverse(p.begin(), p.end());
  return p;
}

inline Polygon intersection(Polygon p, const Polygon& q) {
  for (std::size_t i = 0; i < q.size() && !p.empty(); ++i) {
    const Point2 &a = q[i], &b = q[(i + 1) % q.size()];
    Polygon kept;
    for (std::size_t j = 0; j < p.size(); ++j) {
      const Point2 &s = p[j], &t = p[(j + 1) % p.size()];
      const double ds = turn(a, b, s), dt = turn(a, b, t);
      if (ds >= 0) kept.push_back(s);
      if (ds * dt < 0) kept.push_back({s.x + (t.x - s.x) * ds / (ds - dt), s.y + (t.y - s.y) * ds / (ds - dt)});
    }
    p = kept.size() < 3 ? Polygon() : kept;
  }
  return p;
}

/// Integral over the polygon: 6 x 6 Gauss points in `cells` x `cells` parts of each of its triangles.
inline double integral(const Polygon& p, int cells, const std::function<double(const Point2&)>& f) {
  constexpr double kPlace[] = {0.0337652428984240, 0.1693953067668677, 0.3806904069584016},
                   kWeight[] = {0.0856622461895852, 0.1803807865240693, 0.2339569672863455};
  std::vector<double> place, weight;
  for (int c = 0; c < cells; ++c)
    for (int i = 0; i < 6; ++i) {
      const double at = i < 3 ? kPlace[i] : 1 - kPlace[5 - i];
      place.push_back((c + at) / cells);
      weight.push_back(kWeight[i < 3 ? i : 5 - i] / cells);
    }
  double sum = 0;
  for (std::size_t k = 1; k + 1 < p.size(); ++k) {
    const Point2 &a = p[0], &b = p[k], &c = p[k + 1];
    const double doubled = turn(a, b, c);
    for (std::size_t i = 0; i < place.size(); ++i)
      for (std::size_t j = 0; j < place.size(); ++j) {
        const double u = place[i], v = place[j];
        const Point2 q{a.x + u * ((b.x - a.x) + v * (c.x - b.x)), a.y + u * ((b.y - a.y) + v * (c.y - b.y))};
        sum += weight[i] * weight[j] * u * doubled * f(q);
      }
  }
  return sum;
}

/// Corners in order; the normal of neither matters.
struct BoardAndOccluder {
  std::array<Vec3, 4> board, occluder;
  bool occluded = true;
  double albedo = 0.7;

  /// Light of one bounce from l by way of the board to s, on walls with normal n, by gate(length).
  double reading(const Vec3& s, const Vec3& l, const Vec3& n, const std::function<double(double)>& gate,
                 int cells) const {
    const Vec3 normal = normalize(cross(board[1] - board[0], board[3] - board[0]));
    const Vec3 x = normalize(board[1] - board[0]), y = cross(normal, x);
    const auto flat = [&](const Vec3& p) { return Point2{dot(p - board[0], x), dot(p - board[0], y)}; };
    const auto polygon = [&](const std::array<Vec3, 4>& corners) {
      Polygon p;
      for (const Vec3& corner : corners) p.push_back(flat(corner));
      return counter_clockwise(p);
    };
    const auto shadow = [&](const Vec3& from) {
      std::array<Vec3, 4> corners;
      for (int i = 0; i < 4; ++i) {
        const Vec3 d = occluder[i] - from;
        corners[i] = from + d * (dot(board[0] - from, normal) / dot(d, normal));
      }
      return polygon(corners);
    };
    const auto carried = [&](const Point2& at) {
      const Vec3 q = board[0] + x * at.x + y * at.y;
      const Vec3 a = q - s, b = q - l;
      const double r = length(a), t = length(b);
      const double g = std::abs(dot(n, a) * dot(normal, a) * dot(n, b) * dot(normal, b)) / (r * r * r * r * t * t * t * t);
      return albedo / (kPi * kPi * kPi) * g * gate(r + t);
    };
    const Polygon whole = polygon(board);
    double sum = integral(whole, cells, carried);
    if (!occluded) return sum;
    const Polygon of_s = intersection(whole, shadow(s)), of_l = intersection(whole, shadow(l));
    sum -= integral(of_s, cells, carried);
    if (s == l) return sum;
    return sum - integral(of_l, cells, carried) + integral(intersection(of_s, of_l), cells, carried);
  }
};

}  // namespace isochron::testing
