// Readers of mesh files, one per format; mesh.h is what others use.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "core/base/vec.h"

namespace isochron {

/// What a mesh file holds, in double precision.
struct PolygonMesh {
  std::vector<Vec3> positions;
  std::vector<int> corners;       ///< of all polygons
  std::vector<std::size_t> ends;  ///< in `corners`, of each polygon

  /// Leaves out polygons of fewer than three different corners.
  void add_polygon(const std::vector<int>& polygon);
};

/// All throw InputError `FILE[:LINE]: what is wrong`, with lines counted from one, unless the file holds as much as it
/// declares, every coordinate is a finite number, and every index that of a vertex.
PolygonMesh read_obj(const std::string& file, const std::string& contents);
PolygonMesh read_off(const std::string& file, const std::string& contents);
PolygonMesh read_ply(const std::string& file, const std::string& contents);  ///< text or binary
/// Text or binary. Vertices at equal positions are one.
PolygonMesh read_stl(const std::string& file, const std::string& contents);

}  // namespace isochron
