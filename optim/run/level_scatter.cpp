#include "optim/run/level_scatter.h"

#include <algorithm>
#include <cmath>

#include "optim/remesh/surface.h"

namespace isochron {

void add_level_scatter(const EarlierSurfaces& earlier, const Scene& scene, std::vector<double>& errors) {
  if (errors.empty()) return;
  const Shape& shape = scene.shapes[scene.find_shape(earlier.shape)];
  const std::vector<Vec3> normals = vertex_normals(scene);
  std::vector<double> farthest(shape.vertex_count, 0.0);  // squared
  for (const std::string& file : earlier.meshes) {
    const Surface surface(read_mesh(file));
    for (int v = 0; v < shape.vertex_count; ++v) {
      const Vec3& p = scene.positions[shape.first_vertex + v];
      MeshPoint found = surface.closest(p, normals[shape.first_vertex + v]);
      if (found.face < 0) found = surface.closest(p, {});
      farthest[v] = std::max(farthest[v], length_squared(found.position - p));
    }
  }
  for (int v = 0; v < shape.vertex_count; ++v) {
    double& error = errors[shape.first_vertex + v];
    error = std::sqrt(error * error + farthest[v]);
  }
}

}  // namespace isochron
