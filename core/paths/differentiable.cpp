#include "core/paths/differentiable.h"

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
  for (std::size_t t = 0; t < triangle.size(); ++t) {
    for (int v : scene.triangles[t].vertex) triangle[t] |= vertex[v];
    geometry |= triangle[t] != 0;
  }
  for (int v = 0; v < layout.textured; ++v) texture[v] = basis->differentiates(layout.texture(v));
  for (int i = 0; i < layout.lights; ++i)
    for (int k = 0; k < 9; ++k) {
      const bool moves = basis->differentiates(layout.light_position(i, k));
      light[i] |= moves;
      geometry |= moves && k < 3;
    }
  gain = basis->differentiates(layout.gain());
  time_offset = basis->differentiates(layout.time_offset());
  every_path = gain || time_offset;
  lengths |= geometry || time_offset;
  any = !basis->entries.empty();
  find_bounds(scene);
}

void Differentiable::find_bounds(const Scene& scene) {
  std::vector<std::uint8_t> counts(scene.positions.size(), 0);  // each vertex once
  for (std::size_t t = 0; t < triangle.size(); ++t)
    if (triangle[t])
      for (const int v : scene.triangles[t].vertex) counts[v] = 1;
  bounds = {};
  for (std::size_t v = 0; v < counts.size(); ++v)
    if (counts[v]) bounds.add(scene.positions[v]);
}

}  // namespace isochron
