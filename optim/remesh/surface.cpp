#include "optim/remesh/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace isochron {
namespace {

using Corners = std::array<Vec3, 3>;

MeshPoint at(const Corners& corners, const std::array<double, 3>& weights) {
  return {-1, weights, corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]};
}

MeshPoint closest_on_edge(const Vec3& p, const Corners& corners, int k) {
  const int next = (k + 1) % 3;
  const Vec3 along = corners[next] - corners[k];
  const double t = std::clamp(dot(p - corners[k], along) / length_squared(along), 0.0, 1.0);
  std::array<double, 3> weights{0, 0, 0};
  weights[k] = 1 - t;
  weights[next] = t;
  return at(corners, weights);
}

/// The closer one to p.
const MeshPoint& closer(const Vec3& p, const MeshPoint& a, const MeshPoint& b) {
  return length_squared(b.position - p) < length_squared(a.position - p) ? b : a;
}

MeshPoint closest_on_face(const Vec3& p, const Corners& corners, const Vec3& normal) {
  std::array<double, 3> weights;
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 &a = corners[(k + 1) % 3], &b = corners[(k + 2) % 3];
    weights[k] = dot(cross(b - a, p - a), normal);
    sum += weights[k];
  }
  if (std::all_of(weights.begin(), weights.end(), [](double w) { return w >= 0; }) && sum > 0) {
    for (double& w : weights) w /= sum;
    return at(corners, weights);
  }
  const MeshPoint first = closest_on_edge(p, corners, 0), second = closest_on_edge(p, corners, 1);
  return closer(p, closer(p, first, second), closest_on_edge(p, corners, 2));
}

std::vector<std::array<bool, 3>> border_edges(const Mesh& mesh) {
  std::vector<std::array<bool, 3>> result(mesh.faces.size(), {false, false, false});
  for (const Edge& edge : build_edges(mesh)) {
    if (edge.face[1] >= 0) continue;
    const auto& face = mesh.faces[edge.face[0]];
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(face[k], face[(k + 1) % 3]);
      if (low == edge.vertex[0] && high == edge.vertex[1]) result[edge.face[0]][k] = true;
    }
  }
  return result;
}

}  // namespace

Scene scene_of(const Mesh& mesh) {
  Scene scene;
  add_shape(scene, {}, mesh, build_edges(mesh));
  return scene;
}

/// What is looked for, and the best of it so far. Of equally close ones it is that of the first face, so that it does not
/// matter in which order faces are visited.
struct Surface::Search {
  const Surface& surface;
  Vec3 p, facing;
  bool border;
  MeshPoint best = {};
  double best_squared = std::numeric_limits<double>::infinity();

  bool take(const MeshPoint& found, int face) {
    const double squared = length_squared(found.position - p);
    if (squared > best_squared || (squared == best_squared && face >= best.face)) return false;
    best = found;
    best.face = face;
    best_squared = squared;
    return true;
  }

  /// Whether a closer point was found.
  bool visit(int face) {
    const auto& vertex = surface.mesh_.faces[face];
    const Corners corners{surface.mesh_.positions[vertex[0]], surface.mesh_.positions[vertex[1]],
                          surface.mesh_.positions[vertex[2]]};
    if (border) {
      bool found = false;
      for (int k = 0; k < 3; ++k)
        if (surface.on_border_[face][k]) found |= take(closest_on_edge(p, corners, k), face);
      return found;
    }
    const Vec3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
    return dot(normal, facing) >= 0 && take(closest_on_face(p, corners, normal), face);
  }

  static bool visit(RTCPointQueryFunctionArguments* arguments) {
    auto& search = *static_cast<Search*>(arguments->userPtr);
    if (!search.visit(static_cast<int>(arguments->primID))) return false;
    // Boxes are in single precision: faces as close as the best one must not be passed over.
    const double radius = std::sqrt(search.best_squared) * (1 + 0x1p-20) + search.surface.boxes_.offset();
    arguments->query->radius = static_cast<float>(radius);
    return true;
  }
};

Surface::Surface(Mesh mesh) : mesh_(std::move(mesh)), on_border_(border_edges(mesh_)), boxes_(scene_of(mesh_)) {}

MeshPoint Surface::find(Search& search) const {
  RTCPointQuery query{};
  query.x = static_cast<float>(search.p.x);
  query.y = static_cast<float>(search.p.y);
  query.z = static_cast<float>(search.p.z);
  query.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(boxes_.embree_scene(), &query, &context, &Search::visit, &search);
  return search.best;
}

MeshPoint Surface::closest(const Vec3& p, const Vec3& facing) const {
  Search search{*this, p, facing, false};
  return find(search);
}

MeshPoint Surface::closest_on_border(const Vec3& p) const {
  Search search{*this, p, {}, true};
  return find(search);
}

}  // namespace isochron
