// Where a surface ends, by the albedos that a fit has found on it.
//
// A mesh that reaches beyond what it is a model of can only be dark there: in gaps, in webs between two parts, beyond outlines. Albedos
// find that in a few steps, where borders would have to move far, and topology cannot change at all.
#pragma once
#include <vector>

#include "core/scene/mesh.h"
#include "optim/remesh/remesh.h"

namespace isochron {

/// Of each vertex, the albedo that light of its connected part comes from on average: the mean over the area, weighted by itself.
std::vector<double> typical_albedos(const Mesh& mesh, const std::vector<double>& albedo);

/// What is left of a mesh where an albedo, linear over its triangles, is at least `share` (in (0, 1)) of the typical one. What would be
/// a hole of less than `least_area` (>= 0) stays, a part of less goes. `mesh` is an oriented manifold with an albedo of at least 0 for each
/// vertex. The result is one, too; it has no face where all parts are that small.
Remeshed within_outline(const Mesh& mesh, const std::vector<double>& albedo, double share, double least_area);

/// The connected parts of a mesh whose area is at least that; without a face where none is.
Remeshed without_small_parts(const Mesh& mesh, double least_area);

/// An oriented manifold's holes are closed whose borders are shorter than that of a regular triangle of `least_area`, with triangles between
/// the vertices there are. Parts of less than that area stay as they are.
Remeshed without_small_holes(const Mesh& mesh, double least_area);

/// Strips between two borders of an oriented manifold are cut where an edge across them is shorter than that: a fit draws borders together
/// but cannot open a hole. Necks between two parts, which have one border on both sides, stay; so do rings that are nothing but such a strip.
Remeshed without_narrow_strips(const Mesh& mesh, double least_width);

}  // namespace isochron
