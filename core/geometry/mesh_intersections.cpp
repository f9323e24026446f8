#include "core/geometry/mesh_intersections.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

#include "core/base/bounds.h"
#include "core/base/parallel.h"

namespace isochron {
namespace {

bool has_vertex(const Scene& scene, int triangle, int vertex) {
  const auto& v = scene.triangles[triangle].vertex;
  return v[0] == vertex || v[1] == vertex || v[2] == vertex;
}

}  // namespace

struct MeshIntersections::ClusterEdges {
  ClusterEdges(const FloatBox& around, int of_cluster, bool piercing_alone)
      : box(around), cluster(of_cluster), only_piercing(piercing_alone) {}
  const FloatBox box;  ///< holds those of all
  const int cluster;
  const bool only_piercing;  ///< only those that pierce their own shape in the initial scene
  int count = -1;            ///< not filled yet
  std::array<const ClusterEdge*, 3 * EightBoxes::kWidth> edge;
  std::array<FloatBox, 3 * EightBoxes::kWidth> each;
  std::array<EightBoxes, 3> boxes;  ///< the same side by side
};

MeshIntersections::MeshIntersections(const Scene& at_first, double touching)
    : clusters_(at_first),
      through_own_shape_(at_first.edges.size(), 0),
      shape_pierces_itself_(at_first.shapes.size(), 0),
      positions_(at_first.positions),
      touching_(touching) {
  std::vector<int> cluster_of(at_first.triangles.size());
  for (int i = 0; i < clusters_.count(); ++i)
    for (int lane = 0; lane < clusters_.cluster(i).used; ++lane) cluster_of[clusters_.cluster(i).triangle[lane]] = i;
  first_edge_.assign(static_cast<std::size_t>(clusters_.count()) + 1, 0);
  for (const Edge& edge : at_first.edges) ++first_edge_[cluster_of[edge.face[0]] + 1];
  for (int i = 0; i < clusters_.count(); ++i) first_edge_[i + 1] += first_edge_[i];
  edges_.resize(at_first.edges.size());
  std::vector<int> next = first_edge_;
  for (std::size_t e = 0; e < at_first.edges.size(); ++e)
    edges_[next[cluster_of[at_first.edges[e].face[0]]]++] = {static_cast<int>(e), at_first.edges[e].vertex};

  find_hits(at_first, std::vector<char>(at_first.shapes.size(), 1), true);
  for (const EdgeHit& hit : hits_) {
    const int shape = at_first.triangles[hit.triangle[0]].shape;
    if (shape != at_first.triangles[hit.triangle[1]].shape) continue;
    through_own_shape_[hit.edge] = 1;
    shape_pierces_itself_[shape] = 1;
  }
}

void MeshIntersections::update(const Scene& scene, double touching) {
  const bool all = touching != touching_;
  std::vector<char> moved(scene.shapes.size(), all);
  for (std::size_t s = 0; s < moved.size(); ++s) {
    const Shape& shape = scene.shapes[s];
    const auto begin = scene.positions.begin() + shape.first_vertex, end = begin + shape.vertex_count;
    const auto old = positions_.begin() + shape.first_vertex;
    if (std::equal(begin, end, old)) continue;
    moved[s] = 1;
    std::copy(begin, end, old);
  }
  if (std::find(moved.begin(), moved.end(), 1) == moved.end()) return;
  touching_ = touching;
  find_hits(scene, moved, false);
}

std::vector<std::vector<int>> MeshIntersections::partners(const Scene& scene, const std::vector<char>& moved,
                                                          bool all_edges) const {
  const int shapes = static_cast<int>(scene.shapes.size());
  std::vector<FloatBox> box(scene.shapes.size());
  std::vector<std::vector<int>> result(scene.shapes.size());
  const auto margin = static_cast<float>(touching_);
  for (int s = 0; s < shapes; ++s) {
    if (scene.shapes[s].triangle_count > 0) box[s] = clusters_.box(clusters_.root(s));
    if (moved[s] && (all_edges || scene.shapes[s].deforms || shape_pierces_itself_[s])) result[s].push_back(s);
  }
  for (int a = 0; a < shapes; ++a)
    for (int b = 0; b < a; ++b) {
      if (!(moved[a] || moved[b]) || !box[a].grown(margin).overlaps(box[b])) continue;
      result[a].push_back(b);
      result[b].push_back(a);
    }
  return result;
}

void MeshIntersections::find_hits(const Scene& scene, const std::vector<char>& moved, bool all_edges) {
  for (std::size_t s = 0; s < moved.size(); ++s)
    if (moved[s]) clusters_.fit(scene, static_cast<int>(s));
  std::erase_if(hits_, [&](const EdgeHit& hit) {
    return moved[scene.triangles[hit.triangle[0]].shape] || moved[scene.triangles[hit.triangle[1]].shape];
  });
  const auto partners_of = partners(scene, moved, all_edges);
  for (int s = 0; s < static_cast<int>(partners_of.size()); ++s) {
    if (partners_of[s].empty()) continue;
    constexpr int kChunk = 64;
    const int begin = clusters_.first(s), end = clusters_.first(s + 1);
    std::vector<std::vector<EdgeHit>> found((end - begin + kChunk - 1) / kChunk);
    parallel(static_cast<int>(found.size()), [&](int chunk) {
      for (int i = begin + chunk * kChunk; i < std::min(begin + (chunk + 1) * kChunk, end); ++i)
        for (const int other : partners_of[s]) {
          const bool only_piercing = other == s && !all_edges && !scene.shapes[s].deforms;
          ClusterEdges edges(clusters_.box_of_cluster(i).grown(static_cast<float>(touching_)), i, only_piercing);
          if (edges.box.overlaps(clusters_.box(clusters_.root(other))))
            test_cluster(scene, edges, clusters_.root(other), found[chunk]);
        }
    });
    for (const auto& each : found) hits_.insert(hits_.end(), each.begin(), each.end());
  }
  join(scene);
}

void MeshIntersections::fill(const Scene& scene, ClusterEdges& edges) const {
  edges.count = 0;
  for (int i = first_edge_[edges.cluster]; i < first_edge_[edges.cluster + 1]; ++i) {
    const ClusterEdge& edge = edges_[i];
    if (edges.only_piercing && !through_own_shape_[edge.number]) continue;
    FloatBox box;
    for (const int v : edge.vertex) box.add(scene.positions[v]);
    edges.edge[edges.count] = &edge;
    box = edges.each[edges.count] = box.grown(static_cast<float>(touching_));
    edges.boxes[edges.count / EightBoxes::kWidth].set(edges.count % EightBoxes::kWidth, box);
    ++edges.count;
  }
}

void MeshIntersections::test_cluster(const Scene& scene, ClusterEdges& edges, const TriangleClusters::Node& node,
                                     std::vector<EdgeHit>& hits) const {
  const FloatBox& of_node = clusters_.box(node);
  // Of large edges among small triangles each goes down by itself.
  if (!node.is_cluster() && edges.box.size() <= of_node.size()) {
    for (const auto& child : TriangleClusters::children(node))
      if (edges.box.overlaps(clusters_.box(child))) test_cluster(scene, edges, child, hits);
    return;
  }
  if (node.is_cluster() && !clusters_.cluster(node.first).may_meet(edges.box)) return;
  if (edges.count < 0) fill(scene, edges);
  for (int first = 0; first < edges.count; first += EightBoxes::kWidth) {
    const EightBoxes& boxes = edges.boxes[first / EightBoxes::kWidth];
    const unsigned used = (1u << std::min(edges.count - first, EightBoxes::kWidth)) - 1;
    for (unsigned bits = boxes.overlapping(of_node) & used; bits != 0; bits &= bits - 1) {
      const int i = first + std::countr_zero(bits);
      if (node.is_cluster())
        test_edge_against_cluster(scene, *edges.edge[i], edges.each[i], clusters_.cluster(node.first), hits);
      else
        test_edge_against_node(scene, *edges.edge[i], edges.each[i], node, hits);
    }
  }
}

void MeshIntersections::test_edge_against_node(const Scene& scene, const ClusterEdge& edge, const FloatBox& box,
                                               const TriangleClusters::Node& node, std::vector<EdgeHit>& hits) const {
  if (node.is_cluster()) {
    test_edge_against_cluster(scene, edge, box, clusters_.cluster(node.first), hits);
    return;
  }
  for (const auto& child : TriangleClusters::children(node))
    if (box.overlaps(clusters_.box(child))) test_edge_against_node(scene, edge, box, child, hits);
}

void MeshIntersections::test_edge_against_cluster(const Scene& scene, const ClusterEdge& edge, const FloatBox& box,
                                                  const TriangleCluster& cluster, std::vector<EdgeHit>& hits) const {
  for (unsigned bits = cluster.may_cross(box, edge.vertex); bits != 0; bits &= bits - 1)
    try_edge(scene, edge, cluster.triangle[std::countr_zero(bits)], hits);
}

void MeshIntersections::try_edge(const Scene& scene, const ClusterEdge& edge, int triangle,
                                 std::vector<EdgeHit>& hits) const {
  const auto& v = scene.triangles[triangle].vertex;
  const Vec3 &from = scene.positions[edge.vertex[0]], d = scene.positions[edge.vertex[1]] - from;
  const Vec3 a = scene.positions[v[0]] - from, b = scene.positions[v[1]] - from, c = scene.positions[v[2]] - from;
  const Vec3 normal = cross(b - a, c - a);
  const double height = dot(normal, a), rate = dot(normal, d);
  // Of the plane above the edge's origin; it is passed where height / rate is between 0 and 1.
  if (rate > 0 ? !(height > 0 && height < rate) : !(height < 0 && height > rate)) return;
  const double all = length(d), distance = height / rate * all;
  if (!(std::abs(rate) > kCoplanarAngle * length(normal) * all)) return;
  if (!(distance > touching_ && distance < all - touching_)) return;
  // Which way round the line passes the triangle's sides; the triangle beyond a side comes to the same number.
  const auto passes = [&](int i, int j, const Vec3& p, const Vec3& q) {
    return i < j ? dot(d, cross(p, q)) : -dot(d, cross(q, p));
  };
  const double side[] = {passes(v[0], v[1], a, b), passes(v[1], v[2], b, c), passes(v[2], v[0], c, a)};
  if (!(side[0] >= 0 && side[1] >= 0 && side[2] >= 0) && !(side[0] <= 0 && side[1] <= 0 && side[2] <= 0)) return;
  const Vec3 point = d * (height / rate);
  // Of a triangle that is nearly a line rounding errors may decide the above.
  Bounds box;
  for (const Vec3& corner : {a, b, c}) box.add(corner);
  if (!box.grown(0.5 * touching_).holds(point)) return;
  for (const int face : scene.edges[edge.number].face)
    if (face >= 0) hits.push_back({{std::min(face, triangle), std::max(face, triangle)}, edge.number, from + point});
}

void MeshIntersections::join(const Scene& scene) {
  std::sort(hits_.begin(), hits_.end(), [](const EdgeHit& a, const EdgeHit& b) {
    return std::tie(a.triangle, a.edge) < std::tie(b.triangle, b.edge);
  });
  segments_.clear();
  for (std::size_t begin = 0, end; begin < hits_.size(); begin = end) {
    for (end = begin; end < hits_.size() && hits_[end].triangle == hits_[begin].triangle;) ++end;
    const auto& [a, b] = hits_[begin].triangle;
    MeshIntersection segment{hits_[begin].triangle, {hits_[begin].point, hits_[begin].point}};
    // The farthest from the first: through a vertex or an edge the same point is found several times.
    const auto consider = [&](const Vec3& p) {
      if (length(p - segment.end[0]) > length(segment.end[1] - segment.end[0])) segment.end[1] = p;
    };
    for (std::size_t i = begin + 1; i < end; ++i) consider(hits_[i].point);
    for (const int v : scene.triangles[a].vertex)
      if (has_vertex(scene, b, v)) consider(scene.positions[v]);
    if (length(segment.end[1] - segment.end[0]) > touching_) segments_.push_back(segment);
  }
}

}  // namespace isochron
