// Coplanar triangles of one mesh that share edges, and the creases around them, of the bodies that come close to others.
#pragma once
#include <span>
#include <vector>

#include "core/scene/scene.h"

namespace isochron {

class PreparedScene;

class FlatPatches {
 public:
  /// Of the bodies (connected meshes) that are `near` others. Looks only at shapes that have changed since the last time.
  void update(const PreparedScene& scene, const std::vector<int>& body_of_vertex, std::vector<char> near_bodies);

  /// The patch of a triangle; -1: its body is not near others.
  int of(int triangle) const { return patch_[triangle]; }
  int body(int patch) const { return patches_[patch].body; }
  /// Edges of the scene.
  std::span<const int> creases(int patch) const {
    return {creases_.data() + patches_[patch].first_crease, static_cast<std::size_t>(patches_[patch].creases)};
  }
  /// Of the patch that the triangle belongs to.
  double area(const PreparedScene& scene, int triangle) const;

 private:
  struct Patch {
    int body = -1;
    int first_triangle = 0, triangles = 0;  ///< in `triangles_`
    int first_crease = 0, creases = 0;      ///< in `creases_`
    double area = 0;                        ///< of more than one triangle
  };
  /// Whether an edge of a body near others is no longer what it was.
  bool update_flat_edges(const PreparedScene& scene, const std::vector<int>& body_of_vertex, int shape);
  void make_patches(const Scene& scene, const std::vector<int>& body_of_vertex);

  std::vector<char> near_bodies_;  ///< of each body, whether it may follow or be followed
  std::vector<char> flat_;         ///< of each edge: its faces are one plane
  int flat_revision_ = 0;          ///< of the scene that this is of
  std::vector<int> patch_;         ///< of each triangle
  std::vector<Patch> patches_;
  std::vector<int> triangles_, creases_;  ///< patch by patch
};

}  // namespace isochron
