#include "optim/remesh/remesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/base/error.h"
#include "core/geometry/mesh_intersections.h"
#include "optim/remesh/operations.h"

namespace isochron {
namespace {

/// Sheets, balls and tori, finer and coarser by up to 4, have 97 to 100 % of their edges between 0.6 and 1.5 of the wanted
/// length after five; five more change that by less than 1 % and take twice the time.
constexpr int kRounds = 5;
/// A round that makes the surface pass through itself is made again so often, and then left out.
constexpr int kTrials = 8;
constexpr double kMostTriangles = 1e7;

/// Where nothing but splits may happen.
struct Place {
  Vec3 center;
  double radius;
};

/// Around each two triangles that pass through each other, unless both have a held vertex, so that they did before.
std::vector<Place> crossings(const Mesh& mesh, const std::vector<char>& held) {
  const auto is_held = [&](int face) {
    const auto& f = mesh.faces[face];
    return held[f[0]] || held[f[1]] || held[f[2]];
  };
  const Scene scene = scene_of(mesh);
  const MeshIntersections intersections(scene, ray_offset(scene));
  std::vector<Place> places;
  for (const MeshIntersection& found : intersections.segments()) {
    if (is_held(found.triangle[0]) && is_held(found.triangle[1])) continue;
    Place place{(found.end[0] + found.end[1]) / 2, 0};
    for (const int face : found.triangle)
      for (const int v : mesh.faces[face])
        place.radius = std::max(place.radius, length(mesh.positions[v] - place.center));
    place.radius *= 1 + 0x1p-20;  // vertices on it are within
    places.push_back(place);
  }
  return places;
}

void make_round(Operations& operations) {
  operations.split_long();
  operations.collapse_short();
  operations.flip_towards_even_valences();
  operations.relax();
}

/// The next round, with more and more places held until nothing passes through anything that did not; none where that does
/// not come about.
std::optional<Operations> next_round(const Operations& before, std::vector<Place>& places) {
  for (int trial = 0; trial < kTrials; ++trial) {
    Operations operations = before;
    operations.hold([&places](const Vec3& p) {
      return std::any_of(places.begin(), places.end(),
                         [&](const Place& place) { return length(p - place.center) <= place.radius; });
    });
    make_round(operations);
    const std::vector<Place> found = crossings(operations.mesh(), operations.held());
    if (found.empty()) return operations;
    places.insert(places.end(), found.begin(), found.end());
  }
  return std::nullopt;
}

}  // namespace

double surface_area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.faces)
    sum += length(cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a])) / 2;
  return sum;
}

double mean_edge_length(const Mesh& mesh) {
  double sum = 0;
  const std::vector<Edge> edges = build_edges(mesh);
  for (const Edge& edge : edges) sum += length(mesh.positions[edge.vertex[1]] - mesh.positions[edge.vertex[0]]);
  return edges.empty() ? 0 : sum / static_cast<double>(edges.size());
}

void require_remeshable(const Mesh& mesh, double edge_length) {
  const double of_triangle = std::sqrt(3.0) / 4 * edge_length * edge_length;
  if (const double triangles = surface_area(mesh) / of_triangle; !(triangles <= kMostTriangles))
    throw InputError(fmt::format("edges of {:.6g} would make {:.3g} triangles (allowed: {:g})", edge_length, triangles,
                                 kMostTriangles));
  Operations(Surface(mesh), edge_length);
}

Remeshed remesh(const Mesh& mesh, double edge_length) {
  require_remeshable(mesh, edge_length);
  const Surface surface(mesh);
  std::vector<Place> places = crossings(mesh, std::vector<char>(mesh.positions.size(), 0));
  Operations operations(surface, edge_length);
  for (int round = 0; round < kRounds; ++round) {
    auto next = next_round(operations, places);
    if (!next) break;
    operations = *std::move(next);
  }
  return {operations.mesh(), operations.origins()};
}

std::vector<double> carry_over(const Remeshed& remeshed, const Mesh& old, const std::vector<double>& values,
                               int columns) {
  std::vector<double> result;
  for (const MeshPoint& origin : remeshed.origins)
    for (int column = 0; column < columns; ++column) {
      double sum = 0, least = std::numeric_limits<double>::infinity(), most = -least;
      for (int k = 0; k < 3; ++k) {
        const double value = values[old.faces[origin.face][k] * columns + column];
        sum += origin.weights[k] * value;
        least = std::min(least, value);
        most = std::max(most, value);
      }
      result.push_back(std::clamp(sum, least, most));
    }
  return result;
}

}  // namespace isochron
