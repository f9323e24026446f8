// What a level of a run begins with, made of what the one before found: the surface in finer triangles, and everything else as
// it was found.
//
// Offsets become part of the new mesh and begin at 0; bounds of theirs stay where they were in space. Albedos by vertex are
// linear over the old triangles. Other parameters go on from what was found, but those with a prior from where they began, as the
// prior is about that. Scales stay. Target values by vertex end with the mesh that they are of, and so do those of the offsets.
#pragma once
#include <string>
#include <vector>

#include "core/scene/mesh.h"
#include "optim/problem/problem.h"

namespace isochron {

/// The parameter that asks for levels; null where there is none.
const ParameterSpec* remeshed_parameter(const Experiment& experiment);

/// A shape's mesh where it is in the scene.
Mesh mesh_of(const Scene& scene, const std::string& shape);

/// A surface, with what has a value at each of its vertices.
struct LevelSurface {
  Mesh mesh;
  struct Field {
    int parameter;         ///< its place among the experiment's
    const char* quantity;  ///< initial, lower or upper
    int columns;           ///< numbers per vertex
    std::vector<double> values;
  };
  std::vector<Field> fields;
};

/// The same but for 0 where something is moved otherwise than by the offsets of the shape's vertices: levels keep such motions apart from
/// their meshes.
std::vector<double> offsets_alone(const Problem& problem, std::vector<double> theta, const std::string& shape);

/// The surface of `remeshed` at theta, and all that the next level takes from its vertices.
LevelSurface found_surface(const Problem& problem, const std::vector<double>& theta, const ParameterSpec& remeshed);

/// What is left of it within the outline that its albedos show (within_outline), with the typical albedo of each part; all of it where they
/// show none.
LevelSurface within_outline(const LevelSurface& surface, const std::vector<ParameterSpec>& parameters, double share,
                            double least_area);

/// The same without what a fit has shrunk below a regular triangle of that size: connected parts of less area go, unless all have less, and holes
/// with a shorter border are closed. They would shrink with every level, and penalties relative to the distance of their vertices would grow without
/// bound. `cuts_strips`: narrower strips between two borders go, too, where the surface's outline is to be found.
LevelSurface without_small_features(const LevelSurface& surface, double edge_length, bool cuts_strips);

/// The same in triangles of that size. Throws InputError where it is no manifold.
LevelSurface remeshed_surface(const LevelSurface& surface, double edge_length);

/// The parameters of the level that begins on that surface, found values being theta.
std::vector<ParameterSpec> next_parameters(const Problem& problem, const std::vector<double>& theta,
                                           const ParameterSpec& remeshed, const LevelSurface& surface);

}  // namespace isochron
