#include "optim/remesh/folds.h"

#include <vector>

namespace isochron {
namespace {

/// Of the angle between the normals, 120 degrees: faces of a tetrahedron turn by 109.
constexpr double kFoldCosine = -0.5;
/// Two surfaces of a blob under 8 x 8 spots, with 45 and 56 folds, had none after 7 and 14.
constexpr int kMostRounds = 16;

/// Sum of positions, and of how many.
struct Middle {
  Vec3 sum;
  int count = 0;
  void add(const Vec3& p) {
    sum += p;
    ++count;
  }
};

bool is_border(const Edge& edge) {
  return edge.face[1] < 0;
}

bool is_folded(const Edge& edge, const std::vector<Vec3>& normals) {
  if (is_border(edge)) return false;
  const Vec3 &a = normals[edge.face[0]], &b = normals[edge.face[1]];
  return dot(a, b) < kFoldCosine * length(a) * length(b);
}

}  // namespace

Mesh unfolded(Mesh mesh) {
  const std::vector<Edge> edges = build_edges(mesh);
  std::vector<char> on_border(mesh.positions.size(), 0);
  for (const Edge& edge : edges)
    for (const int v : edge.vertex) on_border[v] |= is_border(edge);
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<Vec3> normals;
    for (const auto& [a, b, c] : mesh.faces)
      normals.push_back(cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]));
    std::vector<char> moves(mesh.positions.size(), 0);
    bool any = false;
    for (const Edge& edge : edges) {
      if (!is_folded(edge, normals)) continue;
      moves[edge.vertex[0]] = moves[edge.vertex[1]] = 1;
      any = true;
    }
    if (!any) break;
    std::vector<Middle> middles(mesh.positions.size());
    for (const Edge& edge : edges)
      for (int k = 0; k < 2; ++k)
        if (const int v = edge.vertex[k]; moves[v] && !on_border[v]) middles[v].add(mesh.positions[edge.vertex[1 - k]]);
    for (std::size_t v = 0; v < middles.size(); ++v)
      if (middles[v].count > 0) mesh.positions[v] = middles[v].sum / middles[v].count;
  }
  return mesh;
}

}  // namespace isochron
