#include "core/paths/differentiable.h"

#include <algorithm>
#include <utility>

#include "core/base/parallel.h"

namespace isochron {

Differentiable::Differentiable(const Scene& scene, const TangentBasis* basis)
    : vertex(scene.positions.size(), 0),
      triangle(scene.triangles.size(), 0),
      material(scene.materials.size(), 0),
      emission(scene.shapes.size(), 0),
      texture(scene.texture.size(), 0),
      light(scene.lights.size(), 0) {
  const DofLayout layout(scene);
  const int first_number = layout.first_number[0];
  number.assign(layout.first_number.back() - first_number, 0);
  if (!basis || basis->columns == 0) return;
  for (int v = 0; v < layout.vertices; ++v)
    for (int axis = 0; axis < 3; ++axis) vertex[v] |= basis->differentiates(layout.vertex(v, axis));
  for (int m = 0; m < layout.materials(); ++m) {
    for (int k = 0; k < layout.numbers(m); ++k) {
      const int dof = layout.number(m, k);
      material[m] |= number[dof - first_number] = basis->differentiates(dof);
    }
    const int index = scene.materials[m].bsdf().index_number();
    lengths |= index >= 0 && basis->differentiates(layout.number(m, index));
  }
  for (int s = 0; s < layout.shapes; ++s)
    for (int c = 0; c < 3; ++c) emission[s] |= basis->differentiates(layout.emission(s, c));
  std::vector<char> is_corner(vertex.size(), 0);
  for (std::size_t t = 0; t < triangle.size(); ++t) {
    const auto& corner = scene.triangles[t].vertex;
    for (const int v : corner) triangle[t] |= vertex[v];
    if (!triangle[t]) continue;
    geometry = true;
    for (const int v : corner)
      if (!std::exchange(is_corner[v], 1)) corners.push_back(v);
  }
  for (int v = 0; v < layout.textured; ++v) texture[v] = basis->differentiates(layout.texture(v));
  for (int i = 0; i < layout.lights; ++i)
    for (int k = 0; k < 9; ++k) {
      const bool moves = basis->differentiates(layout.light_position(i, k));
      light[i] |= moves;
      geometry |= moves && k < 3;
    }
  gain = basis->differentiates(layout.gain());
  for (int i = 0; i < layout.time_offsets; ++i) time_offset |= basis->differentiates(layout.time_offset(i));
  every_path = gain || time_offset;
  lengths |= geometry || time_offset;
  any = !basis->entries.empty();
  find_bounds(scene);
}

void Differentiable::find_bounds(const Scene& scene) {
  constexpr int kChunk = 4096;
  const int count = static_cast<int>(corners.size());
  std::vector<Bounds> parts(static_cast<std::size_t>((count + kChunk - 1) / kChunk));
  parallel(static_cast<int>(parts.size()), [&](int chunk) {
    for (int i = chunk * kChunk; i < std::min((chunk + 1) * kChunk, count); ++i)
      parts[chunk].add(scene.positions[corners[i]]);
  });
  bounds = {};
  for (const Bounds& part : parts) bounds.add(part);
}

}  // namespace isochron
