#include "optim/remesh/outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "core/base/disjoint_sets.h"
#include "core/base/self_weighted_mean.h"

namespace isochron {
namespace {

/// Of an edge: cuts are no closer to its ends, or triangles would be thinner than remeshing can mend.
constexpr double kNearestCut = 0.05;

/// A third of the faces about each vertex.
std::vector<double> areas_of(const Mesh& mesh) {
  std::vector<double> area(mesh.positions.size(), 0.0);
  for (const auto& [a, b, c] : mesh.faces) {
    const std::vector<Vec3>& p = mesh.positions;
    const double third = length(cross(p[b] - p[a], p[c] - p[a])) / 6;
    for (const int v : {a, b, c}) area[v] += third;
  }
  return area;
}

/// Vertices that edges join, of those edges whose ends are `together`.
template <class F>
DisjointSets joined(const Mesh& mesh, F&& together) {
  DisjointSets sets(mesh.positions.size());
  for (const auto& face : mesh.faces)
    for (int k = 0; k < 3; ++k)
      if (together(face[k], face[(k + 1) % 3])) sets.join(face[k], face[(k + 1) % 3]);
  return sets;
}

/// Of each vertex: the area of its connected part.
std::vector<double> part_areas(const Mesh& mesh) {
  const std::vector<double> area = areas_of(mesh);
  DisjointSets parts = joined(mesh, [](int, int) { return true; });
  std::vector<double> sums(area.size(), 0.0), result(area.size());
  for (int v = 0; v < std::ssize(area); ++v) sums[parts.root(v)] += area[v];
  for (int v = 0; v < std::ssize(area); ++v) result[v] = sums[parts.root(v)];
  return result;
}

/// Of a mesh: its edges in the directions of their faces, as pairs of vertices.
std::set<std::pair<int, int>> directed_edges(const Mesh& mesh) {
  std::set<std::pair<int, int>> edges;
  for (const auto& face : mesh.faces)
    for (int k = 0; k < 3; ++k) edges.emplace(face[k], face[(k + 1) % 3]);
  return edges;
}

/// Its borders, each as a loop of vertices in the direction of the faces that would close it.
std::vector<std::vector<int>> borders(const std::set<std::pair<int, int>>& edges) {
  std::map<int, int> next;
  for (const auto& [from, to] : edges)
    if (!edges.contains({to, from})) next.emplace(to, from);
  std::vector<std::vector<int>> loops;
  while (!next.empty()) {
    std::vector<int>& loop = loops.emplace_back();
    for (auto at = next.begin(); at != next.end(); at = next.find(loop.back())) {
      loop.push_back(at->second);
      next.erase(at);
    }
  }
  return loops;
}

/// Triangles from one of a loop's vertices to its others, whose diagonals the mesh has not yet; none where it has some of all.
std::vector<std::array<int, 3>> fan(const std::vector<int>& loop, const std::set<std::pair<int, int>>& edges) {
  const std::size_t n = loop.size();
  for (std::size_t first = 0; first < n; ++first) {
    const auto at = [&](std::size_t i) { return loop[(first + i) % n]; };
    std::vector<std::array<int, 3>> faces;
    bool is_free = true;
    for (std::size_t i = 1; i + 1 < n; ++i) {
      faces.push_back({at(0), at(i), at(i + 1)});
      if (i > 1) is_free = is_free && !edges.contains({at(0), at(i)}) && !edges.contains({at(i), at(0)});
    }
    if (is_free) return faces;
  }
  return {};
}

/// Regions of vertices on the `inner` side that have less than that area change sides.
void drop_small(const Mesh& mesh, const std::vector<double>& area, double least_area, bool inner,
                std::vector<double>& above) {
  const auto here = [&](int v) { return (above[v] >= 0) == inner; };
  DisjointSets parts = joined(mesh, [&](int a, int b) { return here(a) && here(b); });
  std::vector<double> sums(above.size(), 0.0);
  for (int v = 0; v < std::ssize(above); ++v) sums[parts.root(v)] += area[v];
  for (int v = 0; v < std::ssize(above); ++v)
    if (here(v) && sums[parts.root(v)] < least_area) above[v] = -above[v];
}

/// What is left of triangles where a function is at least 0, linear along their edges.
class Cut {
 public:
  Cut(const Mesh& mesh, const std::vector<double>& above) : mesh_(mesh), above_(above) {}

  Remeshed left() {
    for (face_ = 0; face_ < std::ssize(mesh_.faces); ++face_) add_face();
    return std::move(result_);
  }

 private:
  bool inside(int corner) const { return above_[mesh_.faces[face_][corner]] >= 0; }

  void add_face() {
    const int count = inside(0) + inside(1) + inside(2);
    if (count == 0) return;
    if (count == 3) {
      result_.mesh.faces.push_back({vertex(0), vertex(1), vertex(2)});
      return;
    }
    int alone = 0;  // the corner on a side of its own
    while (inside(alone) != (count == 1)) ++alone;
    const int next = (alone + 1) % 3, last = (alone + 2) % 3, first_cut = cut(alone, next), last_cut = cut(last, alone);
    if (count == 1) {
      result_.mesh.faces.push_back({vertex(alone), first_cut, last_cut});
    } else {
      const int a = vertex(next), b = vertex(last);
      result_.mesh.faces.push_back({first_cut, a, b});
      result_.mesh.faces.push_back({first_cut, b, last_cut});
    }
  }

  int vertex(int corner) {
    const int v = mesh_.faces[face_][corner];
    std::array<double, 3> weights{0, 0, 0};
    weights[corner] = 1;
    return numbered({v, v}, weights);
  }

  int cut(int from, int to) {
    const int a = mesh_.faces[face_][from], b = mesh_.faces[face_][to];
    const double place = std::clamp(above_[a] / (above_[a] - above_[b]), kNearestCut, 1 - kNearestCut);
    std::array<double, 3> weights{0, 0, 0};
    weights[from] = 1 - place;
    weights[to] = place;
    return numbered(std::minmax(a, b), weights);
  }

  int numbered(const std::pair<int, int>& place, const std::array<double, 3>& weights) {
    const auto [entry, is_new] = numbers_.emplace(place, static_cast<int>(result_.mesh.positions.size()));
    if (is_new) {
      Vec3 p{0, 0, 0};
      for (int k = 0; k < 3; ++k) p = p + weights[k] * mesh_.positions[mesh_.faces[face_][k]];
      result_.mesh.positions.push_back(p);
      result_.origins.push_back({face_, weights, p});
    }
    return entry->second;
  }

  const Mesh& mesh_;
  const std::vector<double>& above_;
  Remeshed result_;
  std::map<std::pair<int, int>, int> numbers_;
  int face_ = 0;
};

}  // namespace

std::vector<double> typical_albedos(const Mesh& mesh, const std::vector<double>& albedo) {
  const std::vector<double> area = areas_of(mesh);
  DisjointSets parts = joined(mesh, [](int, int) { return true; });
  std::vector<SelfWeightedMean> of_part(albedo.size());
  std::vector<double> typical(albedo.size());
  for (int v = 0; v < std::ssize(albedo); ++v) of_part[parts.root(v)].add(albedo[v], area[v]);
  for (int v = 0; v < std::ssize(albedo); ++v) typical[v] = of_part[parts.root(v)].mean();
  return typical;
}

Remeshed without_small_parts(const Mesh& mesh, double least_area) {
  std::vector<double> above(mesh.positions.size(), 1.0);
  drop_small(mesh, areas_of(mesh), least_area, true, above);
  return Cut(mesh, above).left();
}

Remeshed without_small_holes(const Mesh& mesh, double least_area) {
  Remeshed result = Cut(mesh, std::vector<double>(mesh.positions.size(), 1.0)).left();
  const std::vector<Vec3>& p = result.mesh.positions;
  const std::vector<double> areas = part_areas(result.mesh);
  const std::set<std::pair<int, int>> edges = directed_edges(result.mesh);
  const double border = 6 * std::sqrt(least_area / std::sqrt(3.0));
  for (const std::vector<int>& loop : borders(edges)) {
    double length_of_loop = length(p[loop.front()] - p[loop.back()]);
    for (std::size_t i = 1; i < loop.size(); ++i) length_of_loop += length(p[loop[i]] - p[loop[i - 1]]);
    // No flat part has a shorter outer border for its area than a disc.
    if (!(length_of_loop < border) || areas[loop.front()] < border * border / (4 * std::numbers::pi)) continue;
    const auto faces = fan(loop, edges);
    result.mesh.faces.insert(result.mesh.faces.end(), faces.begin(), faces.end());
  }
  return result;
}

Remeshed without_narrow_strips(const Mesh& mesh, double least_width) {
  const std::vector<Vec3>& p = mesh.positions;
  const std::set<std::pair<int, int>> edges = directed_edges(mesh);
  constexpr int kInside = -1;
  std::vector<int> border(p.size(), kInside);
  int count = 0;
  for (const std::vector<int>& loop : borders(edges)) {
    for (const int v : loop) border[v] = count;
    ++count;
  }
  std::vector<double> above(p.size(), 1.0);
  for (const auto& [a, b] : edges) {
    const bool joins = border[a] != kInside && border[b] != kInside && border[a] != border[b];
    if (joins && length(p[a] - p[b]) < least_width) above[a] = above[b] = -1;
  }
  // A thin ring is no web: nothing would be left of it.
  DisjointSets parts = joined(mesh, [](int, int) { return true; });
  std::vector<char> remains(p.size(), 0);
  for (const auto& [a, b, c] : mesh.faces) remains[parts.root(a)] |= above[a] > 0 && above[b] > 0 && above[c] > 0;
  for (int v = 0; v < std::ssize(p); ++v)
    if (!remains[parts.root(v)]) above[v] = 1;
  return Cut(mesh, above).left();
}

Remeshed within_outline(const Mesh& mesh, const std::vector<double>& albedo, double share, double least_area) {
  const std::vector<double> area = areas_of(mesh), typical = typical_albedos(mesh, albedo);
  // A part that is dark all over goes if another is not.
  const double none = std::ranges::any_of(typical, [](double value) { return value > 0; }) ? -1 : 0;
  std::vector<double> above(albedo.size());
  for (std::size_t v = 0; v < above.size(); ++v) above[v] = typical[v] > 0 ? albedo[v] - share * typical[v] : none;
  drop_small(mesh, area, least_area, false, above);
  drop_small(mesh, area, least_area, true, above);
  return Cut(mesh, above).left();
}

}  // namespace isochron
