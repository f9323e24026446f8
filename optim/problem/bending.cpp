#include "optim/problem/bending.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace isochron {
namespace {

/// What a vertex has around it: weights of its neighbours, and sums over its triangles.
struct Around {
  std::map<int, double> weight;  ///< half the cotangents of the angles opposite to each edge
  double area = 0;
  Vec3 normal;
  bool border = false;
};

std::vector<Around> surroundings(const Scene& scene, const Shape& shape) {
  std::vector<Around> around(shape.vertex_count);
  for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
    const std::array<int, 3>& v = scene.triangles[t].vertex;
    for (int k = 0; k < 3; ++k) {
      const int a = v[k], b = v[(k + 1) % 3], c = v[(k + 2) % 3];
      const Vec3 to_a = scene.positions[a] - scene.positions[c], to_b = scene.positions[b] - scene.positions[c];
      const Vec3 twice_area = cross(to_a, to_b);
      const double half_cotangent = dot(to_a, to_b) / (2 * length(twice_area));
      around[a - shape.first_vertex].weight[b] += half_cotangent;
      around[b - shape.first_vertex].weight[a] += half_cotangent;
      around[c - shape.first_vertex].area += length(twice_area) / 6;
      around[c - shape.first_vertex].normal += twice_area;
    }
  }
  for (int e = shape.first_edge; e < shape.first_edge + shape.edge_count; ++e) {
    const Edge& edge = scene.edges[e];
    if (edge.face[1] >= 0 && !edge.sector) continue;
    for (const int v : edge.vertex) around[v - shape.first_vertex].border = true;
  }
  return around;
}

}  // namespace

std::vector<LinearForm> bending_forms(const Parameters& parameters, const Parameters::VertexField& field,
                                      const std::vector<double>& theta) {
  const Scene scene = parameters.apply(theta);
  const TangentBasis basis = parameters.tangent(theta);
  const DofLayout layout(scene);
  const int first = field.begin, last = field.begin + field.stride * static_cast<int>(field.vertices.size());
  std::vector<LinearForm> forms;
  if (field.vertices.empty()) return forms;
  const Shape& shape = *std::find_if(scene.shapes.begin(), scene.shapes.end(), [&](const Shape& s) {
    return field.vertices.front() < s.first_vertex + s.vertex_count;
  });
  const std::vector<Around> around = surroundings(scene, shape);
  for (const int v : field.vertices) {
    const Around& here = around[v - shape.first_vertex];
    if (here.border || !(here.area > 0)) continue;
    const Vec3 across = normalize(here.normal) / std::sqrt(here.area);
    std::map<int, double> entries;
    LinearForm form;
    const auto add = [&](int vertex, double factor) {
      for (int axis = 0; axis < 3; ++axis) {
        const double part = factor * across[axis];
        form.constant += part * scene.positions[vertex][axis];
        const int row = layout.vertex(vertex, axis);
        for (int k = basis.row_begin[row]; k < basis.row_begin[row + 1]; ++k)
          if (const auto& [column, coefficient] = basis.entries[k]; column >= first && column < last)
            entries[column] += part * coefficient;
      }
    };
    for (const auto& [neighbour, weight] : here.weight) {
      add(v, weight);
      add(neighbour, -weight);
    }
    for (const auto& [unknown, coefficient] : entries) {
      form.entries.emplace_back(unknown, coefficient);
      form.constant -= coefficient * theta[unknown];
    }
    forms.push_back(std::move(form));
  }
  return forms;
}

}  // namespace isochron
