#include "optim/problem/bending.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/base/frame.h"

namespace isochron {
namespace {

/// Of the root of the surface's area, see bending_forms.
constexpr double kBorderShare = 0.1;

/// Triangles thinner than this, height over longest edge, count as if they were this high, so that curvatures stay finite. Regular triangles have
/// 0.87, those at the pole of a ball in 80 slices 0.08.
constexpr double kLeastHeight = 0.01;

/// What a vertex has around it: weights of its neighbours, and sums over its triangles.
struct Around {
  std::map<int, double> weight;  ///< half the cotangents of the angles opposite to each edge
  double area = 0;
  Vec3 normal;
  std::vector<int> along;  ///< neighbours along the border; empty inside
  bool is_inside() const { return along.empty() && length_squared(normal) > 0; }
};

std::vector<Around> surroundings(const Scene& scene, const Shape& shape) {
  std::vector<Around> around(shape.vertex_count);
  for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
    const std::array<int, 3>& v = scene.triangles[t].vertex;
    const auto corner = [&](int k) { return scene.positions[v[k % 3]]; };
    double longest = 0;
    for (int k = 0; k < 3; ++k) longest = std::max(longest, length_squared(corner(k + 1) - corner(k)));
    const Vec3 twice_area = cross(corner(1) - corner(0), corner(2) - corner(0));
    const double size = std::max(length(twice_area), kLeastHeight * longest);
    if (!(size > 0)) continue;
    for (int k = 0; k < 3; ++k) {
      const int a = v[k], b = v[(k + 1) % 3], c = v[(k + 2) % 3];
      const double half_cotangent = dot(corner(k) - corner(k + 2), corner(k + 1) - corner(k + 2)) / (2 * size);
      around[a - shape.first_vertex].weight[b] += half_cotangent;
      around[b - shape.first_vertex].weight[a] += half_cotangent;
      around[c - shape.first_vertex].area += size / 6;
      around[c - shape.first_vertex].normal += twice_area;
    }
  }
  for (int e = shape.first_edge; e < shape.first_edge + shape.edge_count; ++e) {
    const Edge& edge = scene.edges[e];
    if (edge.face[1] >= 0 && !edge.sector) continue;
    for (int k = 0; k < 2; ++k) around[edge.vertex[k] - shape.first_vertex].along.push_back(edge.vertex[1 - k]);
  }
  return around;
}

/// Linear forms of positions as forms of a field's unknowns.
class Forms {
 public:
  Forms(const Parameters& parameters, const Parameters::VertexField& field, const std::vector<double>& theta)
      : theta_(theta),
        scene_(parameters.apply(theta)),
        basis_(parameters.tangent(theta)),
        layout_(scene_),
        first_(field.begin),
        last_(field.begin + field.stride * static_cast<int>(field.vertices.size())) {}

  const Scene& scene() const { return scene_; }

  /// The sum over the pairs of factor times (direction . position).
  LinearForm of(const std::vector<std::pair<int, double>>& factors, const Vec3& direction) const {
    std::map<int, double> entries;
    LinearForm form;
    for (const auto& [vertex, factor] : factors)
      for (int axis = 0; axis < 3; ++axis) {
        const double part = factor * direction[axis];
        form.constant += part * scene_.positions[vertex][axis];
        const int row = layout_.vertex(vertex, axis);
        for (int k = basis_.row_begin[row]; k < basis_.row_begin[row + 1]; ++k)
          if (const auto& [column, coefficient] = basis_.entries[k];
              column >= first_ && column < last_ && part * coefficient != 0)
            entries[column] += part * coefficient;
      }
    for (const auto& [unknown, coefficient] : entries) {
      form.entries.emplace_back(unknown, coefficient);
      form.constant -= coefficient * theta_[unknown];
    }
    return form;
  }

 private:
  const std::vector<double>& theta_;
  const Scene scene_;
  const TangentBasis basis_;
  const DofLayout layout_;
  const int first_, last_;
};

LinearForm mean_curvature(const Forms& forms, int v, const Around& here) {
  std::vector<std::pair<int, double>> factors;
  for (const auto& [neighbour, weight] : here.weight) {
    factors.emplace_back(v, weight);
    factors.emplace_back(neighbour, -weight);
  }
  return forms.of(factors, normalize(here.normal) / std::sqrt(here.area));
}

/// The change of the border's unit tangent at v over the root of the length that it takes, each axis, times the root of `size`.
void add_border_curvature(const Forms& forms, int v, const Around& here, double size, std::vector<LinearForm>& result) {
  const std::vector<Vec3>& at = forms.scene().positions;
  const double to = length(at[here.along[0]] - at[v]), from = length(at[here.along[1]] - at[v]);
  if (!(to > 0 && from > 0)) return;
  const double scale = std::sqrt(2 * size / (to + from));
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 direction;
    direction[axis] = scale;
    LinearForm form =
        forms.of({{here.along[0], 1 / to}, {here.along[1], 1 / from}, {v, -1 / to - 1 / from}}, direction);
    if (!form.entries.empty()) result.push_back(std::move(form));
  }
}

LinearForm difference(const LinearForm& a, double factor_a, const LinearForm& b, double factor_b) {
  std::map<int, double> entries;
  for (const auto& [unknown, coefficient] : a.entries) entries[unknown] += factor_a * coefficient;
  for (const auto& [unknown, coefficient] : b.entries) entries[unknown] -= factor_b * coefficient;
  return {{entries.begin(), entries.end()}, factor_a * a.constant - factor_b * b.constant};
}

/// What `add(forms, vertex, surroundings(vertex), area of the shape, result)` adds for each vertex of the field.
template <class F>
std::vector<LinearForm> forms_of_vertices(const Parameters& parameters, const Parameters::VertexField& field,
                                          const std::vector<double>& theta, F&& add) {
  std::vector<LinearForm> result;
  if (field.vertices.empty()) return result;
  const Forms forms(parameters, field, theta);
  const std::vector<Shape>& shapes = forms.scene().shapes;
  const Shape& shape = *std::find_if(shapes.begin(), shapes.end(), [&](const Shape& s) {
    return field.vertices.front() < s.first_vertex + s.vertex_count;
  });
  const std::vector<Around> around = surroundings(forms.scene(), shape);
  const auto of = [&](int v) -> const Around& { return around[v - shape.first_vertex]; };
  double area = 0;
  for (const Around& each : around) area += each.area;
  for (const int v : field.vertices) add(forms, v, of, area, result);
  return result;
}

}  // namespace

std::vector<LinearForm> bending_forms(const Parameters& parameters, const Parameters::VertexField& field,
                                      const std::vector<double>& theta) {
  return forms_of_vertices(parameters, field, theta,
                           [](const Forms& forms, int v, const auto& of, double area, std::vector<LinearForm>& result) {
                             const Around& here = of(v);
                             if (here.along.size() == 2)
                               add_border_curvature(forms, v, here, kBorderShare * std::sqrt(area), result);
                             else if (here.is_inside())
                               result.push_back(mean_curvature(forms, v, here));
                           });
}

std::vector<LinearForm> variation_forms(const Parameters& parameters, const Parameters::VertexField& field,
                                        const std::vector<double>& theta) {
  const std::set<int> moved(field.vertices.begin(), field.vertices.end());
  std::map<int, LinearForm> curvatures;
  const auto curvature = [&](const Forms& forms, int v, const Around& here) -> const LinearForm& {
    const auto [place, is_new] = curvatures.try_emplace(v);
    if (is_new) place->second = mean_curvature(forms, v, here);
    return place->second;
  };
  return forms_of_vertices(
      parameters, field, theta,
      [&](const Forms& forms, int v, const auto& of, double area, std::vector<LinearForm>& result) {
        const Around& here = of(v);
        if (!here.is_inside()) return;
        for (const auto& [neighbour, weight] : here.weight) {
          const Around& there = of(neighbour);
          if (neighbour < v || !moved.contains(neighbour) || !there.is_inside() || !(weight > 0)) continue;
          const double size = weight * area / (4 * std::numbers::pi);
          LinearForm form = difference(curvature(forms, v, here), std::sqrt(size / here.area),
                                       curvature(forms, neighbour, there), std::sqrt(size / there.area));
          if (!form.entries.empty()) result.push_back(std::move(form));
        }
      });
}

std::vector<LinearForm> tangential_forms(const Parameters& parameters, const Parameters::VertexField& field,
                                         const std::vector<double>& theta) {
  return forms_of_vertices(parameters, field, theta,
                           [&](const Forms& forms, int v, const auto& of, double, std::vector<LinearForm>& result) {
                             const Around& here = of(v);
                             if (!here.is_inside()) return;
                             const Frame frame(normalize(here.normal));
                             for (const Vec3& tangent : {frame.s, frame.t}) {
                               LinearForm form = forms.of({{v, 1}}, tangent / std::sqrt(here.area));
                               form.constant -= form.at(theta);
                               if (!form.entries.empty()) result.push_back(std::move(form));
                             }
                           });
}

}  // namespace isochron
