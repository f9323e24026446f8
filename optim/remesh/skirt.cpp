#include "optim/remesh/skirt.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace isochron {

Skirted with_skirt(const Mesh& mesh, double length, double edge_length, const Vec3& eye) {
  std::set<std::pair<int, int>> sides;
  for (const auto& face : mesh.faces)
    for (int k = 0; k < 3; ++k) sides.emplace(face[k], face[(k + 1) % 3]);
  const int rows = std::max(1, static_cast<int>(std::lround(length / edge_length)));
  Skirted result{mesh, {}};
  const int vertices = static_cast<int>(mesh.positions.size());
  std::vector<int> first(vertices, -1);  // of the further vertices behind each
  const auto behind = [&](int v, int row) {
    if (row == 0) return v;
    if (first[v] < 0) {
      first[v] = static_cast<int>(result.mesh.positions.size());
      const Vec3 step = normalize(mesh.positions[v] - eye) * (length / rows);
      for (int r = 1; r <= rows; ++r) {
        result.mesh.positions.push_back(mesh.positions[v] + step * r);
        result.origins.push_back(v);
      }
    }
    return first[v] + row - 1;
  };
  for (const auto& [a, b] : sides) {
    if (sides.contains({b, a})) continue;
    for (int r = 0; r < rows; ++r) {
      result.mesh.faces.push_back({behind(b, r), behind(a, r), behind(a, r + 1)});
      result.mesh.faces.push_back({behind(b, r), behind(a, r + 1), behind(b, r + 1)});
    }
  }
  return result;
}

}  // namespace isochron
