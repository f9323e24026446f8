// Parameters: what an experiment says of each, and the names of their types.
#pragma once
#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "core/base/description.h"

namespace isochron {

enum class ParameterType {
  translation,
  rotation,
  vertices,
  material,
  emission,
  texture,
  intensity,
  gain,
  background,
  time_offset,
  camera_translation,
  camera_rotation
};
/// How many unknowns a parameter has that may have one for each of many things.
enum class Per { all, vertex, pixel };
enum class VertexDirection { fixed, normal, free };
/// fixed: a point of the world. center, follow: a point of the shape, which earlier parameters carry along (see
/// parameters.h); center: the mean of the positions, as loaded, of the vertices that turn.
enum class PivotKind { fixed, center, follow };

/// Which vertices of a shape a parameter moves: all, a list of indices, or those inside a box.
struct Selection {
  enum class Kind { all, list, box } kind = Kind::all;
  std::vector<int> indices;  ///< within the shape, after vertices at one position were welded; counted from 0
  Vec3 min, max;             ///< world space of the scene file, borders included
};

/// A run in levels: on a mesh, then on the surface that was found in triangles of half the size, and so on.
struct RemeshSpec {
  int levels = 0;          ///< 0: the mesh stays as it is
  int more_levels = 0;     ///< that may follow, as long as the fit of counts is rejected (FitVerdict::unexplained)
  int coarse_levels = 1;   ///< so many have the first one's edge length, with adam but for the last two; at most all
  double edge_length = 0;  ///< of the first level, scene units; 0: that of the loaded mesh, which is used as it is
  /// Of albedos by vertex: the surface ends where the first level finds less than this share of their mean (within_outline). 0: where it is.
  double outline = 0;
  double outline_slopes = 0;  ///< weight of their slopes in that level, in place of ParameterSpec::slopes
  int coarse_histograms = 0;  ///< of a capture: so many are used before the finer levels; 0: all are
  int adam_iterations = 0;    ///< of each level that adam fits, see steps_by_adam; 0: there is none
  int adam_last = 0;          ///< of the last such level; 0: as many
  double adam_rate = 0;       ///< their OptimizerSpec::learning_rate
  double adam_slopes = 0;     ///< weight of the offsets' slopes in these levels, in place of ParameterSpec::slopes

  int most_levels() const { return levels + more_levels; }
  /// How often edges are halved before level `level`. Adam's last level is the first to have half of them.
  int halvings(int level) const {
    return std::max({0, level - coarse_levels, adam_iterations > 0 && level >= last_by_adam() ? 1 : 0});
  }
  bool finds_outline(int level) const { return outline > 0 && level == 1 && levels > 1; }
  /// Whether level `level` comes before the last coarse one, which evidence is taken from.
  bool comes_early(int level) const { return level < coarse_levels; }
  bool spares_histograms(int level) const { return coarse_histograms > 0 && comes_early(level); }
  /// The others are the experiment's optimiser's, the first with all of its smoothing among them: what is far off, as a typical albedo
  /// is, is out of reach for adam's steps, which would shrink the surface instead.
  bool steps_by_adam(int level) const {
    return adam_iterations > 0 && level >= first_by_adam() && level <= last_by_adam();
  }
  /// If there are any.
  int first_by_adam() const { return finds_outline(1) ? 3 : 2; }
  int last_by_adam() const { return std::min(levels, coarse_levels - 1); }
};

/// One named parameter. Values of translations, rotations (degrees) and vertices are offsets from the scene
/// file; those of materials, emission and the like replace what the scene file says.
struct ParameterSpec {
  std::string name;
  ParameterType type = ParameterType::translation;
  std::string shape;                        ///< translation, rotation, vertices, emission, texture
  std::vector<std::string> further_shapes;  ///< of translation, rotation and emission: that change alike
  std::string light;                        ///< translation and rotation in place of a shape, intensity
  std::string material;                     ///< material
  std::string quantity;                     ///< material: which of its quantities, as `type` in the file
  Per per = Per::all;
  Selection selection;
  VertexDirection direction_kind = VertexDirection::fixed;
  Vec3 direction;  ///< translation and fixed vertices; the value multiplies it as given (it is not normalised)
  Vec3 axis;       ///< rotation, by the right-hand rule; only its direction matters
  PivotKind pivot_kind = PivotKind::fixed;
  Vec3 pivot;  ///< rotation; of follow: where the point is in the scene as loaded; of center: unused
  std::vector<double> initial, target, lower, upper;  ///< one value for all components or one each; may be
                                                      ///< empty (all but initial)

  double scale = 0;  ///< in units of the parameter, see parameters.h; 0: the default of its type

  /// Of types vertices and texture, see smoothing.h; 0: none.
  double diffusion = 0;  ///< lambda of the gradient's preconditioner, adam only
  double slopes = 0;     ///< weight of the penalty on uneven values, in units of the target's mean square
  RemeshSpec remesh;     ///< of type vertices
  /// Of type vertices, see bending.h; 0: none.
  double bending = 0;     ///< weight of a prior on curved surfaces
  double variation = 0;   ///< and of one on surfaces whose curvature changes
  double tangential = 0;  ///< and of one on motion of inner vertices within the surface
  /// Of types vertices and texture: each level but the first takes the weights that the data of the one before ask
  /// for, see evidence.h.
  bool evidence = false;
  /// Of type time_offset: standard deviation of a normal prior about the initial values; 0: none.
  double prior_width = 0;

  /// Where the file gives each key (and, under "", the parameter): for checks that need the scene.
  std::map<std::string, YamlValue> where;
  /// All shapes that it changes, none where it changes something else.
  std::vector<std::string> shapes() const;
  /// Whether there is a prior on how the surface bends.
  bool bends() const { return bending > 0 || variation > 0; }
  /// Throws the one-line InputError at `key`, or at the parameter where the key was not given.
  [[noreturn]] void fail(const std::string& key, const std::string& wrong, const std::string& allowed = "") const;
};

/// Its type as files name it.
std::string type_name(const ParameterSpec& spec);

template <>
inline constexpr auto kChoices<ParameterType> = std::to_array<Choice<ParameterType>>(
    {{ParameterType::translation, "translation", "along `direction`, scene units"},
     {ParameterType::rotation, "rotation", "about `axis`, degrees"},
     {ParameterType::vertices, "vertices", "each vertex by itself, along `direction`, scene units"},
     {ParameterType::emission, "emission", "radiance of a shape that emits"},
     {ParameterType::intensity, "intensity", "radiant intensity of a light"},
     {ParameterType::gain, "gain", "a factor on all readings"},
     {ParameterType::background, "background", "added to every gate"},
     {ParameterType::time_offset, "time_offset", "the detector's delay, in the unit of the gates"},
     {ParameterType::camera_translation, "camera_translation",
      "of camera or capture, its `origin` included, along `direction`, scene units"},
     {ParameterType::camera_rotation, "camera_rotation",
      "of camera or capture about `axis`, degrees, through the camera's position (a capture's: the mean of its "
      "points)"}});

template <>
inline constexpr auto kChoices<Per> = std::to_array<Choice<Per>>(
    {{Per::all, "all", "one unknown"},
     {Per::vertex, "vertex", "an albedo for each vertex of `shape`, linear over triangles"},
     {Per::pixel, "pixel", "a background or time offset for each sensor point of a capture"}});

template <>
inline constexpr auto kChoices<VertexDirection> =
    std::to_array<Choice<VertexDirection>>({{VertexDirection::normal, "normal", "each along its normal, as loaded"},
                                            {VertexDirection::free, "free", "three unknowns per vertex"}});

}  // namespace isochron
