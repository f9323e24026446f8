// What can have a derivative.
#pragma once
#include <cstdint>
#include <vector>

#include "core/base/bounds.h"
#include "core/scene/scene.h"

namespace isochron {

/// Which degrees of freedom move. Everything else is skipped by the derivative passes.
struct Differentiable {
  std::vector<std::uint8_t> vertex, triangle;
  std::vector<std::uint8_t> material;  ///< any of its numbers
  std::vector<std::uint8_t> number;    ///< as DofLayout counts them, from the first material's first on
  std::vector<std::uint8_t> emission;  ///< per shape
  std::vector<std::uint8_t> texture;   ///< per vertex, where shapes are textured
  std::vector<std::uint8_t> light;     ///< any number of it
  bool gain = false, time_offset = false;
  bool any = false;
  bool geometry = false;     ///< vertices, or lights without an extent
  Bounds bounds;             ///< of the triangles with a vertex that moves
  bool lengths = false;      ///< paths can change their length
  bool every_path = false;   ///< every path has a derivative
  std::vector<int> corners;  ///< the vertices of triangles that have one that moves, each once

  Differentiable() = default;
  Differentiable(const Scene& scene, const TangentBasis* basis);
  /// Sets `bounds`; to be called again when vertices have moved.
  void find_bounds(const Scene& scene);
  /// Of a degree of freedom that is a material's.
  bool has_number(const DofLayout& layout, int dof) const { return number[dof - layout.first_number[0]] != 0; }
};

}  // namespace isochron
