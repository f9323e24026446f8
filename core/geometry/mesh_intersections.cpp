#include "core/geometry/mesh_intersections.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "core/geometry/bounds.h"

namespace isochron {
namespace {

/// An edge of the first triangle, or of the second, goes through the other here.
struct EdgeHit {
  std::array<int, 2> triangle;
  Vec3 point;
  int edge;
};

bool has_vertex(const Scene& scene, int triangle, int vertex) {
  const auto& v = scene.triangles[triangle].vertex;
  return v[0] == vertex || v[1] == vertex || v[2] == vertex;
}

/// Goes along the edge from triangle to triangle.
void find_edge_hits(const Scene& scene, const RayCaster& caster, int number, std::vector<EdgeHit>& hits) {
  const Edge& edge = scene.edges[number];
  const Vec3 from = scene.positions[edge.vertex[0]], to = scene.positions[edge.vertex[1]];
  const double offset = caster.offset(), end = length(to - from) - offset;
  if (!(end > offset)) return;
  const Vec3 along = normalize(to - from);
  if (!caster.occluded(from + along * offset, from + along * end)) return;
  double passed = 0, step = offset;
  while (passed + step < end) {
    const int t = caster.closest_hit(from + along * (passed + step), along);
    if (t < 0) return;
    const auto& v = scene.triangles[t].vertex;
    const Vec3& corner = scene.positions[v[0]];
    const Vec3 normal = cross(scene.positions[v[1]] - corner, scene.positions[v[2]] - corner);
    const double rate = dot(normal, along), distance = dot(normal, corner - from) / rate;
    if (!(std::abs(rate) > kCoplanarAngle * length(normal) && distance > passed + 0.5 * step)) {
      step *= 2;  // the edge runs within this triangle's plane, or has just left it
      continue;
    }
    if (!(distance < end)) return;
    if (!has_vertex(scene, t, edge.vertex[0]) && !has_vertex(scene, t, edge.vertex[1]))
      for (const int face : edge.face)
        if (face >= 0) hits.push_back({{std::min(face, t), std::max(face, t)}, from + along * distance, number});
    passed = distance;
    step = offset;
  }
}

/// Along all those edges that `wanted` says.
template <class Wanted>
std::vector<EdgeHit> find_hits(const Scene& scene, const RayCaster& caster, Wanted&& wanted) {
  constexpr std::size_t kChunk = 1024;
  const std::size_t edges = scene.edges.size(), chunks = (edges + kChunk - 1) / kChunk;
  std::vector<std::vector<EdgeHit>> found(chunks);
  parallel(static_cast<int>(chunks), [&](int chunk) {
    const std::size_t begin = static_cast<std::size_t>(chunk) * kChunk;
    for (std::size_t e = begin; e < std::min(edges, begin + kChunk); ++e)
      if (wanted(e)) find_edge_hits(scene, caster, static_cast<int>(e), found[static_cast<std::size_t>(chunk)]);
  });
  std::vector<EdgeHit> hits;
  for (const auto& some : found) hits.insert(hits.end(), some.begin(), some.end());
  return hits;
}

std::vector<MeshIntersection> join(const Scene& scene, const RayCaster& caster, std::vector<EdgeHit> hits) {
  std::stable_sort(hits.begin(), hits.end(),
                   [](const EdgeHit& a, const EdgeHit& b) { return a.triangle < b.triangle; });

  std::vector<MeshIntersection> intersections;
  for (std::size_t begin = 0, end; begin < hits.size(); begin = end) {
    for (end = begin; end < hits.size() && hits[end].triangle == hits[begin].triangle;) ++end;
    const auto& [a, b] = hits[begin].triangle;
    MeshIntersection segment{hits[begin].triangle, {hits[begin].point, hits[begin].point}};
    // The farthest from the first: through a vertex or an edge the same point is found several times.
    const auto consider = [&](const Vec3& p) {
      if (length(p - segment.end[0]) > length(segment.end[1] - segment.end[0])) segment.end[1] = p;
    };
    for (std::size_t i = begin + 1; i < end; ++i) consider(hits[i].point);
    for (const int v : scene.triangles[a].vertex)
      if (has_vertex(scene, b, v)) consider(scene.positions[v]);
    if (length(segment.end[1] - segment.end[0]) > caster.offset()) intersections.push_back(segment);
  }
  return intersections;
}

/// What other shapes have near each shape: boxes of their triangles, joined where there are many.
std::vector<std::vector<Bounds>> boxes_near_shapes(const Scene& scene, double margin) {
  constexpr std::size_t kMostBoxes = 8;
  std::vector<Bounds> bounds(scene.shapes.size());
  for (std::size_t s = 0; s < bounds.size(); ++s)
    for (int v = 0; v < scene.shapes[s].vertex_count; ++v)
      bounds[s].add(scene.positions[scene.shapes[s].first_vertex + v]);
  std::vector<std::vector<Bounds>> near(bounds.size());
  for (std::size_t a = 0; a < bounds.size(); ++a)
    for (std::size_t b = 0; b < bounds.size(); ++b) {
      const Bounds of_a = bounds[a].grown(margin);
      if (a == b || !of_a.overlaps(bounds[b])) continue;
      std::vector<Bounds> boxes;
      const Shape& other = scene.shapes[b];
      for (int t = other.first_triangle; t < other.first_triangle + other.triangle_count; ++t) {
        Bounds box;
        for (const int v : scene.triangles[t].vertex) box.add(scene.positions[v]);
        if (!of_a.overlaps(box)) continue;
        if (boxes.size() < kMostBoxes)
          boxes.push_back(box.grown(margin));
        else
          boxes.back().add(box.grown(margin));
      }
      near[a].insert(near[a].end(), boxes.begin(), boxes.end());
    }
  return near;
}

}  // namespace

std::vector<MeshIntersection> find_mesh_intersections(const Scene& scene, const RayCaster& caster) {
  return join(scene, caster, find_hits(scene, caster, [](std::size_t) { return true; }));
}

CrossingEdges::CrossingEdges(const Scene& at_first) : through_own_shape_(at_first.edges.size(), 0) {
  for (const Edge& edge : at_first.edges) shape_.push_back(at_first.triangles[edge.face[0]].shape);
  const RayCaster caster(at_first);
  for (const EdgeHit& hit : find_hits(at_first, caster, [](std::size_t) { return true; }))
    if (at_first.triangles[hit.triangle[0]].shape == at_first.triangles[hit.triangle[1]].shape)
      through_own_shape_[static_cast<std::size_t>(hit.edge)] = 1;
}

std::vector<MeshIntersection> CrossingEdges::find(const Scene& scene, const RayCaster& caster) const {
  const auto near = boxes_near_shapes(scene, 2 * caster.offset());
  const auto may_cross = [&](std::size_t e) {
    const int shape = shape_[e];
    if (through_own_shape_[e] || scene.shapes[shape].deforms) return true;
    if (near[shape].empty()) return false;
    Bounds box;
    for (const int v : scene.edges[e].vertex) box.add(scene.positions[v]);
    return std::any_of(near[shape].begin(), near[shape].end(),
                       [&](const Bounds& other) { return other.overlaps(box); });
  };
  return join(scene, caster, find_hits(scene, caster, may_cross));
}

}  // namespace isochron
