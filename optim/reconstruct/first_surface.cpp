#include "optim/reconstruct/first_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "core/base/disjoint_sets.h"
#include "optim/reconstruct/sheet_maxima.h"

namespace isochron {
namespace {

constexpr int kStride = 2;               // voxels from vertex to vertex: a lateral resolution
constexpr double kSteepest = 2;          // depth over distance
constexpr double kNearestBorder = 0.25;  // of the distance of two lines, from either: no slivers

/// A vertex inside of a sheet: a maximum of a line.
struct Node {
  int across, up, number;
  friend auto operator<=>(const Node&, const Node&) = default;
};

class SheetMesher {
 public:
  explicit SheetMesher(const BackProjection& volume) : volume_(volume), maxima_(sheet_maxima(volume)) {}

  void run() {
    const int width = static_cast<int>(volume_.across.size()), height = static_cast<int>(volume_.up.size());
    for (int u = 0; u + kStride < height; u += kStride) {
      for (int a = 0; a + kStride < width; a += kStride) add_cell(a, u);
    }
  }
  const std::vector<std::vector<SheetMaximum>>& maxima() const { return maxima_; }

  std::vector<Vec3> places;  ///< wall's frame
  std::vector<double> albedo;
  std::vector<std::array<int, 3>> faces;

 private:
  using Corners = std::array<std::optional<Node>, 4>;
  // Counter-clockwise seen from the wall, which looks along the depth: up runs up, across to the left.
  static constexpr int kCorner[4][2] = {{0, 0}, {0, kStride}, {kStride, kStride}, {kStride, 0}};

  const std::vector<SheetMaximum>& line(int a, int u) const { return maxima_[u * volume_.across.size() + a]; }
  const SheetMaximum& at(const Node& node) const { return line(node.across, node.up)[node.number]; }
  double spacing() const { return kStride * (volume_.across[1] - volume_.across[0]); }

  /// Of a line's maxima that are not `taken`, the one closest in depth, unless that is a jump over so many spacings.
  template <class Taken>
  std::optional<Node> joined(int a, int u, double depth, double spacings, Taken&& taken) const {
    std::optional<Node> best;
    double least = kSteepest * spacings * spacing();
    for (int i = 0; i < static_cast<int>(line(a, u).size()); ++i) {
      const double jump = std::abs(line(a, u)[i].depth - depth);
      if (jump > least || taken(Node{a, u, i})) continue;
      least = jump;
      best = Node{a, u, i};
    }
    return best;
  }

  /// Cells may hold a piece of each of several sheets. The nearest of the maxima at the corners chooses what it is joined with.
  void add_cell(int a, int u) {
    std::vector<Node> left;
    for (const auto& [da, du] : kCorner) {
      for (int i = 0; i < static_cast<int>(line(a + da, u + du).size()); ++i) left.push_back({a + da, u + du, i});
    }
    while (!left.empty()) {
      const double depth = at(*std::min_element(left.begin(), left.end(), [&](const Node& x, const Node& y) {
                             return at(x).depth < at(y).depth;
                           })).depth;
      Corners corners;
      for (int k = 0; k < 4; ++k) {
        const auto taken = [&](const Node& node) { return std::find(left.begin(), left.end(), node) == left.end(); };
        corners[k] = joined(a + kCorner[k][0], u + kCorner[k][1], depth, 1, taken);
      }
      for (const auto& node : corners) {
        if (node) left.erase(std::find(left.begin(), left.end(), *node));
      }
      add_polygon(a, u, corners);
    }
  }

  void add_polygon(int a, int u, const Corners& corners) {
    std::vector<int> polygon;
    for (int k = 0; k < 4; ++k) {
      const int next = (k + 1) % 4;
      if (corners[k]) polygon.push_back(inner_vertex(*corners[k]));
      if (corners[k] && !corners[next])
        polygon.push_back(border_vertex(*corners[k], a + kCorner[next][0], u + kCorner[next][1]));
      if (!corners[k] && corners[next])
        polygon.push_back(border_vertex(*corners[next], a + kCorner[k][0], u + kCorner[k][1]));
    }
    if (corners[0] && corners[1] && corners[2] && corners[3]) {
      // Along the diagonal over which the sheet bends less.
      const double one = std::abs(at(*corners[0]).depth - at(*corners[2]).depth);
      const double other = std::abs(at(*corners[1]).depth - at(*corners[3]).depth);
      if (other < one) std::rotate(polygon.begin(), polygon.begin() + 1, polygon.end());
    }
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) faces.push_back({polygon[0], polygon[i], polygon[i + 1]});
  }

  int add_vertex(const Vec3& place, double of_albedo) {
    places.push_back(place);
    albedo.push_back(of_albedo);
    return static_cast<int>(places.size()) - 1;
  }

  int inner_vertex(const Node& node) {
    const auto [entry, is_new] = inner_.emplace(node, 0);
    if (is_new)
      entry->second = add_vertex({volume_.across[node.across], volume_.up[node.up], at(node).depth}, at(node).albedo);
    return entry->second;
  }

  /// Where a sheet ends on the way from a vertex to a line that it does not reach. The line halfway says more.
  int border_vertex(const Node& from, int a, int u) {
    const auto [entry, is_new] = border_.emplace(std::pair{from, std::pair{a, u}}, 0);
    if (!is_new) return entry->second;
    const int da = (a - from.across) / kStride, du = (u - from.up) / kStride;
    const std::optional<Node> halfway =
        joined(from.across + da, from.up + du, at(from).depth, 0.5, [](const Node&) { return false; });
    const Node last = halfway.value_or(from);
    const SheetMaximum& end = at(last);
    const double beyond = volume_.albedo[volume_.index(end.voxel, last.up + du, last.across + da)];
    // The border's albedo lies between the two, but for a line that was left out for other reasons.
    const double fall = end.albedo - beyond,
                 along = fall > 0 ? std::clamp((end.albedo - end.border) / fall, 0.0, 1.0) : 1.0;
    const double share = std::clamp((along + (halfway ? 1 : 0)) / kStride, kNearestBorder, 1 - kNearestBorder);
    const Vec3 place{volume_.across[from.across] + share * (volume_.across[a] - volume_.across[from.across]),
                     volume_.up[from.up] + share * (volume_.up[u] - volume_.up[from.up]), end.depth};
    return entry->second = add_vertex(place, end.albedo);
  }

  const BackProjection& volume_;
  const std::vector<std::vector<SheetMaximum>> maxima_;
  std::map<Node, int> inner_;
  std::map<std::pair<Node, std::pair<int, int>>, int> border_;  ///< by vertex inside and line outside
};

/// Faces of parts that seen from the wall have at least that area.
std::vector<std::array<int, 3>> large_parts(const SheetMesher& sheets, double least) {
  DisjointSets parts(sheets.places.size());
  for (const auto& face : sheets.faces)
    for (const int k : {1, 2}) parts.join(face[k], face[0]);
  std::vector<double> area(sheets.places.size());
  for (const auto& face : sheets.faces) {
    const Vec3 &a = sheets.places[face[0]], &b = sheets.places[face[1]], &c = sheets.places[face[2]];
    area[parts.root(face[0])] += 0.5 * std::abs(cross(b - a, c - a).z);
  }
  std::vector<std::array<int, 3>> faces;
  for (const auto& face : sheets.faces) {
    if (area[parts.root(face[0])] >= least) faces.push_back(face);
  }
  return faces;
}

}  // namespace

FirstSurface first_surface(const BackProjection& volume) {
  FirstSurface result;
  if (volume.depth.empty()) return result;
  SheetMesher sheets(volume);
  sheets.run();
  for (const auto& line : sheets.maxima())
    result.depth.push_back(line.empty() ? std::numeric_limits<double>::quiet_NaN() : line.front().depth);

  const double disc = 0.25 * std::numbers::pi * volume.lateral_resolution * volume.lateral_resolution;
  std::vector<int> number(sheets.places.size(), -1);
  for (auto face : large_parts(sheets, 0.5 * disc)) {
    for (int& vertex : face) {
      if (number[vertex] < 0) {
        number[vertex] = static_cast<int>(result.albedo.size());
        result.mesh.positions.push_back(volume.frame.to_capture(sheets.places[vertex]));
        result.albedo.push_back(sheets.albedo[vertex]);
      }
      vertex = number[vertex];
    }
    result.mesh.faces.push_back(face);
  }
  const double mean =
      std::accumulate(result.albedo.begin(), result.albedo.end(), 0.0) / static_cast<double>(result.albedo.size());
  for (double& value : result.albedo) value /= mean;
  return result;
}

}  // namespace isochron
