// A mesh as a surface on which points are looked for.
#pragma once
#include <array>
#include <memory>

#include "core/base/vec.h"
#include "core/geometry/ray_caster.h"
#include "core/scene/mesh.h"

namespace isochron {

struct MeshPoint {
  int face = -1;                           ///< -1: there is none
  std::array<double, 3> weights{0, 0, 0};  ///< of the face's corners: at least 0, sum 1
  Vec3 position;
};

/// The mesh alone in a scene, so that what works on scenes works on it.
Scene scene_of(const Mesh& mesh);

class Surface {
 public:
  /// A copy is made. Throws std::runtime_error where there is too little memory.
  explicit Surface(Mesh mesh);
  const Mesh& mesh() const { return mesh_; }

  /// The point closest to p on faces whose normals are at most a right angle from `facing`, so that what lies behind a thin
  /// part of the surface is not meant; zero: on all.
  MeshPoint closest(const Vec3& p, const Vec3& facing) const;
  /// The same on edges with one face.
  MeshPoint closest_on_border(const Vec3& p) const;

 private:
  struct Search;
  MeshPoint find(Search& search) const;

  Mesh mesh_;
  std::vector<std::array<bool, 3>> on_border_;  ///< of each face: whether its edge k, from corner k to k + 1, is
  RayCaster boxes_;                             ///< of the faces
};

}  // namespace isochron
