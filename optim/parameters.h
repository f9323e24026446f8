// From the flat vector of all unknowns to a scene and its tangent.
//
// Parameters of one shape act in the listed order: a rotation turns what earlier parameters moved, so the
// tangents of earlier parameters are carried through it. Directions (also `normal`: the area-weighted vertex
// normals of the loaded mesh) and pivots are fixed in the world.
//
// Physical bounds, always applied besides the user's: albedo in [1e-4, 1], roughness in [1e-3, 1], ior at
// least 1e-3 from 1 on the side of its initial value, emission
// at least 1e-6 of its largest initial component (so that an emitter stays one).
#pragma once
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "optim/experiment.h"

namespace isochron {

class Parameters {
 public:
  /// Binds the parameters to a loaded scene, which must outlive this. Throws InputError (line and key) for a
  /// shape or material that is not there, an empty selection, values of the wrong number or out of bounds.
  Parameters(const Scene& scene, const std::vector<ParameterSpec>& specs);

  int size() const { return static_cast<int>(component_names_.size()); }  ///< scalar unknowns
  /// NAME for a parameter of one component, else NAME[0], NAME[1], ...: vertices in the order of the
  /// selection with x, y, z of each together when free; colours r, g, b.
  const std::vector<std::string>& component_names() const { return component_names_; }

  /// Components [begin, begin + count) of theta that belong to one parameter.
  struct Block {
    std::string name;
    int begin, count;
  };
  const std::vector<Block>& blocks() const { return blocks_; }

  /// The vertices of one parameter of type `vertices`: component `axis` of vertices[i] is the unknown
  /// begin + stride i + axis.
  struct VertexField {
    std::string name;
    int begin;
    int stride;                 ///< 3 for free vertices, else 1
    double unit;                ///< length of the offset per unit of an unknown
    std::vector<int> vertices;  ///< in Scene::positions
  };
  VertexField vertex_field(const Block& block) const;

  const std::vector<double>& initial() const { return initial_; }
  /// Target values. Components without one are NaN.
  const std::vector<double>& target() const { return target_; }
  bool target_known() const;
  /// Root mean square of theta - target over the unknowns; NaN where a target value is unknown.
  double distance_to_target(const std::vector<double>& theta) const;
  const std::vector<double>& lower() const { return lower_; }  ///< -infinity where there is none
  const std::vector<double>& upper() const { return upper_; }

  const Scene& scene() const { return scene_; }  ///< as loaded
  /// Indices of the shapes that parameters move, as a whole or by their vertices.
  std::vector<int> moving_shapes() const;

  /// The loaded scene with theta applied.
  Scene apply(const std::vector<double>& theta) const;

  /// d(dof)/d(theta) at theta. Entries that are exactly zero are left out.
  TangentBasis tangent(const std::vector<double>& theta) const;

  /// `text` is `initial`, `target`, or a list of NAME=VALUE (NAME[i] allowed) separated by commas, optionally
  /// after one of those words; what is not named keeps its initial value. Blanks around names and
  /// values do not matter. Throws InputError, also where a name stands twice or a vertex would be too far away.
  std::vector<double> parse_point(const std::string& text) const;

 private:
  /// A parameter that moves vertices. `slot[v]` is the place of the shape's vertex v in the selection, or -1.
  struct Motion {
    ParameterType type;
    VertexDirection direction_kind;
    int first_component;
    Vec3 direction, pivot;      ///< for rotations `direction` is the unit axis
    std::vector<Vec3> normals;  ///< per selected vertex, for `normal`
    std::vector<int> slot;
  };
  struct MaterialValue {
    ParameterType type;
    int index;  ///< material, or shape for emission
    int first_component, count;
  };
  struct Moved {
    int column;
    Vec3 velocity;
  };

  void bind_motion(const ParameterSpec& spec, Motion& motion, int shape, int& count);
  void bind_values(const ParameterSpec& spec, int count);
  /// Position of vertex v of `shape` at theta; `tangent`, if given, receives its velocity for every column.
  Vec3 move(int shape, int v, const std::vector<double>& theta, std::vector<Moved>* tangent) const;

  const Scene& scene_;
  std::vector<std::vector<Motion>> motions_;  ///< per shape, in the listed order
  std::vector<MaterialValue> material_values_;
  std::vector<Block> blocks_;
  std::vector<std::string> component_names_;
  std::vector<double> initial_, target_, lower_, upper_;
};

/// The columns [first, first + count) of a basis, renumbered from 0.
TangentBasis select_columns(const TangentBasis& basis, int first, int count);

}  // namespace isochron
