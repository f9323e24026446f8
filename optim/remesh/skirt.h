// Strips behind the borders of a surface.
//
// Most borders that a sensor sees of a body are where it turns out of sight, and its surface goes on behind them. A sheet that ends
// there moves its border only by what light its rim sends; with a strip behind it the outline is a bend within the surface. Plates and
// letters end where their borders are: there the data are explained better without.
#pragma once
#include <vector>

#include "core/scene/mesh.h"

namespace isochron {

struct Skirted {
  Mesh mesh;                 ///< the vertices of the mesh that it was made of come first
  std::vector<int> origins;  ///< of each further vertex: the border vertex that it lies behind
};

/// Every edge with one face gets a strip of that length (> 0), straight away from the point `eye`, in rows of about `edge_length`
/// (> 0). `mesh` is an oriented manifold, and so is the result.
Skirted with_skirt(const Mesh& mesh, double length, double edge_length, const Vec3& eye);

}  // namespace isochron
