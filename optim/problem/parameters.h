// From the flat vector of all unknowns to a scene and its tangent.
//
// Parameters of one shape act in the listed order: a rotation turns what earlier parameters moved, so the
// tangents of earlier parameters are carried through it. Directions (also `normal`: the area-weighted vertex
// normals of the loaded mesh) and axes are fixed in the world, and so are pivots unless they move with the shape
// (PivotKind): those are carried along by the translations and rotations listed before that act on every vertex
// that this rotation turns. Several shapes of one rotation turn about one pivot.
//
// Scales: what counts as one unit of each parameter where parameters of different units are compared, as optimisers
// and param_rmse do. Values, bounds, gradients, checkpoints and logs are in units of the parameter. Default: 1 for
// translations and vertices (units of the parameter, usually scene units) and what materials have; 180 / pi degrees for
// rotations, which move what is one scene unit from the axis by one scene unit; the largest initial component of an
// emission.
//
// Physical bounds, always applied besides the user's: of materials as their quantities say (core/scene/materials), albedos of
// vertices likewise, emission, intensity and gain at least 1e-6 of their largest initial component (so that an emitter stays
// one), backgrounds at least 0.
//
// The camera's pose is a motion of everything else, so that all that moves is alike: with c its position and R its turn, a
// point p goes to c_0 + R^-1 (p - c), after all else.
#pragma once
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "optim/experiment/experiment.h"

namespace isochron {

/// Gives the scene room for what the parameters set: backgrounds of each sensor point, texture on shapes (whose material then
/// has an albedo of one); and marks the shapes that they change as hidden (see Shape). Throws InputError where that cannot be.
void make_room(Scene& scene, const std::vector<ParameterSpec>& specs);

/// Marks the shapes that the experiment names as hidden, if it names some, in place of others. Throws InputError where there
/// is none of a name.
void mark_hidden(Scene& scene, const Experiment& experiment);

class Parameters {
 public:
  /// `gate_unit`: scene units per unit of the gates' lengths. Binds the parameters to a loaded scene, which must outlive this. Throws InputError
  /// (line and key) for a shape or material that is not there, an empty selection, values of the wrong number or out of bounds.
  Parameters(const Scene& scene, const std::vector<ParameterSpec>& specs, double gate_unit = 1);

  int size() const { return static_cast<int>(component_names_.size()); }  ///< scalar unknowns
  /// NAME for a parameter of one component, else NAME[0], NAME[1], ...: vertices in the order of the
  /// selection with x, y, z of each together when free; colours r, g, b.
  const std::vector<std::string>& component_names() const { return component_names_; }

  /// Components [begin, begin + count) of theta that belong to one parameter.
  struct Block {
    std::string name;
    int begin, count;
    double scale = 1;  ///< > 0, in units of the parameter
  };
  const std::vector<Block>& blocks() const { return blocks_; }

  /// The parameter, or the one component of it, of that name. Throws InputError, which begins with the command line's
  /// `option`, where there is none.
  Block find(const std::string& name, const char* option) const;

  /// The vertices of one parameter of type `vertices`, or of albedos by vertex: component `axis` of vertices[i] is the
  /// unknown begin + stride i + axis.
  struct VertexField {
    std::string name;
    int begin;
    int stride;                 ///< 3 for free vertices, else 1
    double unit;                ///< length of the offset per unit of an unknown; albedos: 1
    std::vector<int> vertices;  ///< in Scene::positions
  };
  VertexField vertex_field(const Block& block) const;

  const std::vector<double>& initial() const { return initial_; }
  /// Target values. Components without one are NaN.
  const std::vector<double>& target() const { return target_; }
  bool target_known() const;
  /// Root mean square of (theta - target) / scale over the unknowns; NaN where a target value is unknown.
  double distance_to_target(const std::vector<double>& theta) const;
  /// Root mean square of theta - target over one parameter's unknowns, in units of the parameter; NaN likewise.
  double distance_to_target(const std::vector<double>& theta, const Block& block) const;
  /// Block::scale of every unknown.
  std::vector<double> scales() const;
  const std::vector<double>& lower() const { return lower_; }  ///< -infinity where there is none
  const std::vector<double>& upper() const { return upper_; }

  const Scene& scene() const { return scene_; }  ///< as loaded
  /// Indices of the shapes that parameters move, as a whole or by their vertices.
  std::vector<int> moving_shapes() const;

  /// The loaded scene with theta applied. The camera stays: what moves it moves all else the other way.
  Scene apply(const std::vector<double>& theta) const;
  /// The same with the shapes in the coordinates that the scene was loaded in, whatever moves the camera.
  Scene in_place(const std::vector<double>& theta) const;

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
    std::vector<int> carriers;  ///< of a rotation's pivot: places in the shape's list of motions, rising
  };
  /// A parameter that is a value: degrees of freedom from `dof` on, one each or all the same.
  struct Value {
    int dof, numbers;
    int first_component, count;
    double factor = 1;  ///< units of the degrees of freedom per unit of the parameter
  };
  /// A translation or rotation of a light or of the camera.
  struct RigidMotion {
    ParameterType type;
    int first_component;
    Vec3 direction;  ///< or unit axis
  };
  struct Moved {
    int column;
    Vec3 velocity;
  };

  /// A point that moves with the parameters.
  struct CarriedPoint {
    Vec3 position;
    std::vector<Moved> velocity;  ///< a column at most once
  };

  /// Of one parameter.
  struct Unknowns {
    int count = 1;
    std::vector<int> listed;  ///< the one that each value of a list is of, as the mesh's file counts vertices; -1: none
  };

  /// Throw InputError where there is none. Of several shapes, find_shape is the first.
  int find_shape(const ParameterSpec& spec) const;
  std::vector<int> find_shapes(const ParameterSpec& spec) const;
  int find_light(const ParameterSpec& spec) const;
  /// Of a parameter that moves something, else false.
  bool bind_move(const ParameterSpec& spec, int first, Unknowns& unknowns);
  void bind_light(const ParameterSpec& spec, int first);
  void bind_value(const ParameterSpec& spec, int first, double gate_unit, Unknowns& unknowns);
  void bind_motion(const ParameterSpec& spec, Motion& motion, int shape, Unknowns& unknowns);
  /// Set the pivot in the scene as loaded, and what carries it: the same of all shapes that turn about it.
  void bind_pivot(const ParameterSpec& spec, const std::vector<int>& shapes, std::vector<Motion>& motions) const;
  void bind_carriers(const std::vector<int>& shapes, std::vector<Motion>& motions) const;
  void bind_values(const ParameterSpec& spec, const Unknowns& unknowns);
  /// Turns `p` and what `tangent`, if given, holds about the pivot.
  static void turn(const Motion& rotation, const CarriedPoint& pivot, const std::vector<double>& theta, Vec3& p,
                   std::vector<Moved>* tangent);
  /// Where the pivots of a shape's rotations are at theta, by place in its list of motions.
  std::vector<CarriedPoint> pivots(int shape, const std::vector<double>& theta) const;
  /// Position of vertex v of `shape` at theta; `tangent`, if given, receives its velocity for every column.
  Vec3 move(int shape, int v, const std::vector<CarriedPoint>& pivots, const std::vector<double>& theta,
            std::vector<Moved>* tangent) const;

  /// Where the light is and what it points to at theta, and how fast, for every column.
  void move_light(int light, const std::vector<double>& theta, Vec3& position, Vec3& direction,
                  std::vector<Moved>* position_rate, std::vector<Moved>* direction_rate) const;
  /// Moves a point, or only turns a direction, as the camera's motions make everything else move.
  void view(const std::vector<double>& theta, bool is_point, Vec3& p, std::vector<Moved>* tangent) const;

  const Scene& scene_;
  std::vector<std::vector<Motion>> motions_;             ///< per shape, in the listed order
  std::vector<std::vector<RigidMotion>> light_motions_;  ///< per light, likewise
  std::vector<RigidMotion> camera_motions_;
  std::vector<Value> values_;
  std::vector<Block> blocks_;
  std::vector<std::string> component_names_;
  std::vector<double> initial_, target_, lower_, upper_;
};

/// The columns [first, first + count) of a basis, renumbered from 0.
TangentBasis select_columns(const TangentBasis& basis, int first, int count);

}  // namespace isochron
