// How much a surface bends, as a quadratic function of the unknowns that move its vertices.
#pragma once
#include <vector>

#include "core/scene/scene.h"
#include "optim/problem/parameters.h"

namespace isochron {

/// Sum of coefficient times unknown, plus the constant.
struct LinearForm {
  std::vector<std::pair<int, double>> entries;
  double constant = 0;
  double at(const std::vector<double>& unknowns) const {
    double sum = constant;
    for (const auto& [i, coefficient] : entries) sum += coefficient * unknowns[i];
    return sum;
  }
};

/// Of each vertex of the field that has triangles all around: 2 H sqrt(A), H being the mean curvature, by cotangents of the
/// angles, and A a third of the area of its triangles. The sum of their squares is the integral of (2 H)^2 over the surface,
/// which has no unit: 16 pi for any sphere, 0 for any plane, however uneven its mesh. Of each vertex of the field on a border: the
/// border's curvature as a vector, so that the sum of squares is the integral of its square along the border times a tenth of the root
/// of the surface's area, without a unit, too: 0.2 pi^1.5 for any disc. With the whole root borders of thin parts are drawn back
/// (optim/README.md, Bending). Angles, areas, lengths and normals are those at theta, where the forms are exact, but for
/// triangles that are more than a hundred times longer than high.
std::vector<LinearForm> bending_forms(const Parameters& parameters, const Parameters::VertexField& field,
                                      const std::vector<double>& theta);

/// Of each edge between vertices of the field that have triangles all around: the difference of 2 H at its ends, times the root of its
/// weight (half the cotangents of the angles opposite to it) and the root of A / (4 pi), A being the area of the surface. The sum of their
/// squares is the integral of the squared slope of 2 H, times the squared radius of a sphere of that area, which has no unit: 0 for
/// any sphere and plane. Angles, areas and normals as above.
std::vector<LinearForm> variation_forms(const Parameters& parameters, const Parameters::VertexField& field,
                                        const std::vector<double>& theta);

/// Of each vertex of the field that has triangles all around: how far it is from where it is at theta along two tangents of the surface there,
/// over the root of a third of the area of its triangles. Such motion changes the mesh and not the surface.
std::vector<LinearForm> tangential_forms(const Parameters& parameters, const Parameters::VertexField& field,
                                         const std::vector<double>& theta);

}  // namespace isochron
