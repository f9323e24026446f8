#include "core/scene/stacked_faces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace isochron {
namespace {

/// Faces whose planes differ by more are not compared: such close faces share an area only at the smallest scales.
constexpr double kMostTilt = 1e-3;

using Corners = std::array<Vec3, 3>;

struct Item {
  Bounds box;
  Corners corners;
  Vec3 normal;  ///< unit; zero without an area
  int triangle;
  int group;  ///< pairs are of different groups
};

Bounds box_of(const Corners& corners) {
  Bounds box;
  for (const Vec3& p : corners) box.add(p);
  return box;
}

Item make_item(const Bounds& box, const Corners& corners, int triangle, int group) {
  const Vec3 n = cross(corners[1] - corners[0], corners[2] - corners[0]);
  const double norm = length(n);
  return {box, corners, norm > 0 ? n / norm : Vec3(), triangle, group};
}

/// A convex polygon of few corners.
struct Polygon {
  std::array<Vec3, 8> corner;
  int count = 0;
};

/// What is left of the polygon where `height` is positive.
template <class F>
Polygon clipped(const Polygon& polygon, F&& height) {
  Polygon result;
  for (int i = 0; i < polygon.count; ++i) {
    const Vec3 &a = polygon.corner[i], &b = polygon.corner[(i + 1) % polygon.count];
    const double at_a = height(a), at_b = height(b);
    if (at_a > 0) result.corner[result.count++] = a;
    if ((at_a > 0) != (at_b > 0)) result.corner[result.count++] = a + (b - a) * (at_a / (at_a - at_b));
  }
  return result;
}

/// Whether b has a part within the prism over a, farther than `touching` from its sides, that is as close as that to a's plane.
bool lies_on(const Item& a, const Item& b, double touching) {
  if (length_squared(cross(a.normal, b.normal)) > kMostTilt * kMostTilt || length_squared(a.normal) == 0) return false;
  Polygon part{{b.corners[0], b.corners[1], b.corners[2]}, 3};
  for (int k = 0; k < 3 && part.count > 2; ++k) {
    const Vec3 &from = a.corners[k], side = a.corners[(k + 1) % 3] - from;
    const Vec3 inward = cross(a.normal, side) / length(side);
    part = clipped(part, [&](const Vec3& p) { return dot(inward, p - from) - touching; });
  }
  if (part.count < 3) return false;
  double area = 0, perimeter = 0;
  for (int i = 0; i < part.count; ++i) {
    const Vec3 &p = part.corner[i], &q = part.corner[(i + 1) % part.count];
    if (std::abs(dot(a.normal, p - a.corners[0])) > touching) return false;
    area += 0.5 * dot(a.normal, cross(p - part.corner[0], q - part.corner[0]));
    perimeter += length(q - p);
  }
  return std::abs(area) > touching * perimeter;
}

void compare(const Item& a, const Item& b, double touching, std::vector<std::array<int, 2>>& pairs) {
  if (a.group == b.group || !a.box.grown(touching).overlaps(b.box)) return;
  if (lies_on(a, b, touching)) pairs.push_back({std::min(a.triangle, b.triangle), std::max(a.triangle, b.triangle)});
}

/// Halves the space until few items are left that meet a part. A pair may be found in several parts.
void find_pairs(std::vector<const Item*> items, double touching, std::vector<std::array<int, 2>>& pairs) {
  constexpr std::size_t kFew = 64;  // the quickest of 8 to 64 on a ball of 70 000 faces
  Bounds middles;
  for (const Item* item : items) middles.add(0.5 * (item->box.low + item->box.high));
  const Vec3 size = middles.high - middles.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  std::vector<const Item*> part[2];
  if (items.size() > kFew) {
    const double plane = 0.5 * (middles.low[axis] + middles.high[axis]);
    for (const Item* item : items) {
      if (item->box.low[axis] <= plane + touching) part[0].push_back(item);
      if (item->box.high[axis] >= plane - touching) part[1].push_back(item);
    }
  }
  // Where most items reach across, parts of them would be no smaller.
  if (items.size() <= kFew || 10 * std::max(part[0].size(), part[1].size()) > 9 * items.size()) {
    for (std::size_t i = 0; i < items.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) compare(*items[i], *items[j], touching, pairs);
    return;
  }
  items = {};
  for (auto& each : part) find_pairs(std::move(each), touching, pairs);
}

std::vector<std::array<int, 2>> find_pairs(const std::vector<Item>& items, double touching) {
  std::vector<const Item*> all;
  for (const Item& item : items) all.push_back(&item);
  std::vector<std::array<int, 2>> pairs;
  find_pairs(std::move(all), touching, pairs);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

Corners corners_of(const std::vector<Vec3>& positions, const std::array<int, 3>& v) {
  return {positions[v[0]], positions[v[1]], positions[v[2]]};
}

bool face_alike(const Scene& scene, int a, int b) {
  const auto normal = [&](int t) {
    const Corners c = corners_of(scene.positions, scene.triangles[t].vertex);
    return cross(c[1] - c[0], c[2] - c[0]);
  };
  return dot(normal(a), normal(b)) > 0;
}

double touching_distance(const std::vector<Vec3>& positions) {
  double largest = 0;
  for (const Vec3& p : positions) largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  return largest * 0x1p-20;
}

}  // namespace

std::vector<std::array<int, 2>> stacked_faces(const std::vector<Vec3>& positions,
                                              const std::vector<std::array<int, 3>>& faces) {
  std::vector<Item> items;
  items.reserve(faces.size());
  for (int t = 0; t < static_cast<int>(faces.size()); ++t) {
    const Corners corners = corners_of(positions, faces[t]);
    items.push_back(make_item(box_of(corners), corners, t, t));
  }
  return find_pairs(items, touching_distance(positions));
}

void StackedFaces::update(const Scene& scene, std::vector<char> moved, double touching) {
  if (std::exchange(touching_, touching) != touching) moved.assign(moved.size(), 1);
  if (std::find(moved.begin(), moved.end(), 1) == moved.end()) return;
  const int shapes = static_cast<int>(scene.shapes.size());
  boxes_.resize(scene.shapes.size());
  for (int s = 0; s < shapes; ++s) {
    if (!moved[s]) continue;
    boxes_[s] = {};
    const Shape& shape = scene.shapes[s];
    for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v)
      boxes_[s].add(scene.positions[v]);
  }
  std::erase_if(between_, [&](const std::array<int, 2>& pair) {
    return moved[scene.triangles[pair[0]].shape] || moved[scene.triangles[pair[1]].shape];
  });
  for (int a = 0; a < shapes; ++a)
    for (int b = 0; b < a; ++b)
      if ((moved[a] || moved[b]) && boxes_[a].grown(touching).overlaps(boxes_[b])) find_between(scene, a, b);
  std::sort(between_.begin(), between_.end());
  pairs_.clear();
  for (const auto* each : {&std::as_const(between_), &scene.stacked})
    for (const auto& [a, b] : *each) {
      pairs_.push_back({a, b});
      pairs_.push_back({b, a});
    }
  std::sort(pairs_.begin(), pairs_.end());
  kind_.assign(scene.triangles.size(), Kind::free);
  for (const auto& [a, b] : pairs_)
    kind_[a] = std::max(kind_[a], face_alike(scene, a, b) ? Kind::alike : Kind::opposite);
}

void StackedFaces::find_between(const Scene& scene, int a, int b) {
  std::vector<Item> items;
  // What of a shape meets the other's box; the smaller shape first, which often has nothing there.
  const auto add_items = [&](int s, int other) {
    const std::size_t before = items.size();
    const int first = scene.shapes[s].first_triangle;
    const Bounds near_other = boxes_[other].grown(touching_);
    for (int t = first; t < first + scene.shapes[s].triangle_count; ++t) {
      const Corners corners = corners_of(scene.positions, scene.triangles[t].vertex);
      const Bounds box = box_of(corners);
      if (near_other.overlaps(box)) items.push_back(make_item(box, corners, t, s));
    }
    return items.size() > before;
  };
  if (scene.shapes[a].triangle_count > scene.shapes[b].triangle_count) std::swap(a, b);
  if (!add_items(a, b) || !add_items(b, a)) return;
  const auto found = find_pairs(items, touching_);
  between_.insert(between_.end(), found.begin(), found.end());
}

std::span<const std::array<int, 2>> StackedFaces::of(int triangle) const {
  const auto first = [](const std::array<int, 2>& pair) { return pair[0]; };
  return {std::ranges::lower_bound(pairs_, triangle, {}, first), std::ranges::upper_bound(pairs_, triangle, {}, first)};
}

std::string stacked_warning(const Scene& scene) {
  constexpr std::size_t kMostNamed = 4;
  StackedFaces stacked;
  stacked.update(scene, std::vector<char>(scene.shapes.size(), 1), touching_distance(scene.positions));
  std::map<std::array<int, 2>, std::vector<int>> found;  // by shapes: triangles of the second
  for (const auto& [a, b] : stacked.between_shapes())
    if (face_alike(scene, a, b)) found[{scene.triangles[a].shape, scene.triangles[b].shape}].push_back(b);
  if (found.empty()) return {};
  std::string names;
  std::size_t named = 0;
  for (auto& [shape, triangles] : found) {
    if (named == kMostNamed) break;
    std::sort(triangles.begin(), triangles.end());
    const auto count = std::unique(triangles.begin(), triangles.end()) - triangles.begin();
    names += fmt::format("{}'{}' on '{}' ({} triangle{})", named++ ? ", " : "", scene.shapes[shape[1]].name,
                         scene.shapes[shape[0]].name, count, count > 1 ? "s" : "");
  }
  if (found.size() > kMostNamed) names += fmt::format(" and {} more pairs", found.size() - kMostNamed);
  return fmt::format("shapes on the same surface: {}; of two the one that comes later in the file is seen there",
                     names);
}

}  // namespace isochron
