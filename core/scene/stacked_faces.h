// Faces that lie on each other: doubled ones, a front and a back, a patch in the plane of a floor.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/bounds.h"
#include "core/base/vec.h"
#include "core/scene/scene.h"

namespace isochron {

/// Pairs of faces that have an area in common and no more than 2^-20 of the largest coordinate between them there, each pair
/// ascending, all in order. Faces that merely touch are none.
std::vector<std::array<int, 2>> stacked_faces(const std::vector<Vec3>& positions,
                                              const std::vector<std::array<int, 3>>& faces);

/// All triangles of a scene that lie on others, kept while shapes move: between shapes as they lie now, within a shape as
/// Scene::stacked has them.
class StackedFaces {
 public:
  /// `moved`: shapes to search again. `touching`: as far as this from each other faces lie on each other.
  void update(const Scene& scene, std::vector<char> moved, double touching);
  bool empty() const { return pairs_.empty(); }
  /// Whether another face may be seen in place of the triangle by who looks along w, `normal` being the triangle's. Of a box
  /// that stands on a floor, say, this is only so from behind.
  bool may_cover(int triangle, const Vec3& normal, const Vec3& w) const {
    return !empty() && kind_[triangle] != Kind::free && (kind_[triangle] == Kind::alike || !(dot(normal, w) < 0));
  }
  /// {triangle, another one that lies on it}, for each of them.
  std::span<const std::array<int, 2>> of(int triangle) const;
  /// Pairs of triangles of different shapes, each once, ascending.
  const std::vector<std::array<int, 2>>& between_shapes() const { return between_; }

 private:
  /// Of a triangle: on no other, on such as face the other way, on one that faces the same way.
  enum class Kind : std::uint8_t { free, opposite, alike };
  void find_between(const Scene& scene, int a, int b);

  std::vector<Bounds> boxes_;                ///< of each shape
  std::vector<std::array<int, 2>> between_;  ///< of different shapes
  std::vector<std::array<int, 2>> pairs_;    ///< all, both ways, in order
  std::vector<Kind> kind_;                   ///< of each triangle
  double touching_ = -1;
};

/// One line that names shapes that lie on each other and face the same way; empty where there are none. Only one of the two
/// is seen there.
std::string stacked_warning(const Scene& scene);

}  // namespace isochron
