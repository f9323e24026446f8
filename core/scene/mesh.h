// Triangle meshes: reading files, welding, and edges with the faces on either side.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/base/vec.h"
#include "core/scene/scene.h"

namespace isochron {

/// Faces index into `positions`, counter-clockwise seen from the side the normal points to.
struct Mesh {
  std::vector<Vec3> positions;
  std::vector<std::array<int, 3>> faces;
  std::optional<FileVertices> file_vertices = {};  ///< of a clean mesh, see Shape
};

/// Reads OBJ, OFF, PLY (text or binary) or STL (text or binary), chosen by the file's extension. Vertices and
/// faces are those of the file, in its order, manifold or not; polygons are cut into triangles, concave and bent ones
/// too (see cut_polygon), and one that crosses itself is refused. Of STL, which does not number vertices, those at equal
/// positions are one already, in the order of their first appearance. Coordinates are as precise as the file has
/// them, up to double. Throws InputError `FILE[:LINE]: what is wrong`.
Mesh read_mesh(const std::string& file);

/// The mesh on which shapes are built:
/// - vertices at equal positions become one, so that seams of texture coordinates or normals are no borders. What
///   rounding in double precision explains counts as equal: 2^-44 of the largest coordinate of a face;
/// - degenerate faces (two equal corners, or exactly no area) and repetitions of a face are dropped;
/// - vertices of no remaining face are set apart; the others are in the order of their first appearance in
/// `mesh`, whose numbers `file_vertices` keeps. A front and a back with the same corners are two faces. Throws InputError when
/// no face is left.
Mesh clean_mesh(const Mesh& mesh);

/// Edges of a clean mesh, by ascending vertices: vertex[0] < vertex[1], and face[0] < face[1] unless it is a
/// border. The two faces may be oriented inconsistently. Where more than two meet: see Edge; by ascending face[0].
std::vector<Edge> build_edges(const Mesh& mesh);

/// Adds a shape of the mesh as it is, whose edges these are; sets the shape's ranges. Returns its index.
int add_shape(Scene& scene, Shape shape, const Mesh& mesh, const std::vector<Edge>& edges);

}  // namespace isochron
