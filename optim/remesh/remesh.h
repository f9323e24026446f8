// Isotropic remeshing: the same surface in triangles that are about regular and of one size. Long edges are split, short ones
// collapse, others flip towards even valences, vertices move within the surface: a mesh of the same topology, whose vertices
// lie on the old one and whose distance from it is of second order in the edge length. Creases are no borders: they are
// rounded by about an edge length.
//
// Places where the surface passes through itself are left as they are but for splits, and so are those where it would begin to.
#pragma once
#include <vector>

#include "core/scene/mesh.h"
#include "optim/remesh/surface.h"

namespace isochron {

/// Of all edges; 0 where there is none.
double mean_edge_length(const Mesh& mesh);

/// Of all faces, each once.
double surface_area(const Mesh& mesh);

struct Remeshed {
  Mesh mesh;
  std::vector<MeshPoint> origins;  ///< of each of its vertices, on the mesh that it was made of
};

/// Edges are mostly between 0.8 and 1.33 of `edge_length` (> 0). Borders are resampled along themselves; their corners, where
/// they turn by more than 45 degrees, stay. The same bits for any number of threads. Throws InputError, without a file's name,
/// where `mesh` is no oriented manifold or the result would have more than ten million triangles.
Remeshed remesh(const Mesh& mesh, double edge_length);

/// Throws what `remesh` does.
void require_remeshable(const Mesh& mesh, double edge_length);

/// Values of the old mesh's vertices, `columns` of each together, at those of the new one: linear over its triangles,
/// never beyond the values at their corners.
std::vector<double> carry_over(const Remeshed& remeshed, const Mesh& old, const std::vector<double>& values,
                               int columns = 1);

}  // namespace isochron
