#include "core/techniques/boundary_edges.h"

#include "core/geometry/mesh_intersections.h"

namespace isochron {
namespace {

/// Unit direction in the plane of face t, perpendicular to the edge, towards the face's third vertex.
Vec3 inward_direction(const PreparedScene& scene, int t, const Edge& edge, const Vec3& tangent) {
  for (int v : scene.scene.triangles[t].vertex) {
    if (v == edge.vertex[0] || v == edge.vertex[1]) continue;
    const Vec3 d = scene.scene.positions[v] - scene.scene.positions[edge.vertex[0]];
    return normalize(d - tangent * dot(d, tangent));
  }
  return {};
}

/// How often an edge is to be looked at from the camera: by its length in the image, and between two faces that are both
/// seen, where light changes little, by the angle between them, `wedge` (without it, pi). Zero where it makes no difference
/// to any image.
double primary_weight(const PreparedScene& scene, const BoundaryEdge& edge, double wedge) {
  const Vec3 a = edge.origin - scene.camera.position, b = edge.end - scene.camera.position;
  if (scene.camera.misses_image(edge.origin, edge.end)) return 0;
  const Vec3 middle = (a + b) * 0.5;
  const double r = length(middle);
  bool within_outline = edge.is_mesh_intersection();
  if (edge.faces() == 2 && !edge.is_mesh_intersection()) {
    bool seen[2], dark = true;
    for (int i = 0; i < 2; ++i) {
      seen[i] = dot(scene.normal(edge.face[i]), a) <= kCoplanarAngle * length(a);
      dark &= !seen[i] && !scene.two_sided(edge.face[i]) && !scene.transparent(edge.face[i]);
    }
    if (dark) return 0;
    within_outline = seen[0] == seen[1];
  }
  const double in_image = length(cross(a, b)) / (r * (r * r + length_squared(b - a)));
  return in_image * (within_outline ? std::min(1.0, wedge) : 1.0);
}

}  // namespace

BoundaryEdges::BoundaryEdges(const PreparedScene& scene, bool wedge) {
  for (const Edge& e : scene.scene.edges) {
    BoundaryEdge b;
    for (int i = 0; i < 2; ++i) b.vertex[i] = e.vertex[i], b.face[i] = e.face[i];
    b.origin = scene.scene.positions[e.vertex[0]];
    b.end = scene.scene.positions[e.vertex[1]];
    const double edge_length = length(b.end - b.origin);
    bool degenerate = !(edge_length > 0);
    for (int i = 0; i < b.faces(); ++i) degenerate |= !(scene.area(b.face[i]) > 0);
    if (degenerate) continue;
    const Vec3 tangent = (b.end - b.origin) / edge_length;
    for (int i = 0; i < b.faces(); ++i) b.inward[i] = inward_direction(scene, b.face[i], e, tangent);
    double angle = kPi;
    if (b.faces() == 2) {
      angle -= std::atan2(length(cross(b.inward[0], b.inward[1])), dot(b.inward[0], b.inward[1]));
      if (angle < kCoplanarAngle) continue;
    }
    b.azimuths = wedge ? angle : kPi;
    b.moves = scene.moving.vertex[e.vertex[0]] || scene.moving.vertex[e.vertex[1]];
    if (b.moves || scene.flows.camera_possible())
      if (const double weight = primary_weight(scene, b, b.azimuths); weight > 0) primary_.add(b, weight);
    secondary_.add(b, edge_length * b.azimuths);
  }
  if (scene.moving.geometry) add_mesh_intersections(scene, wedge);
  primary_.finish();
  secondary_.finish();
}

void BoundaryEdges::add_mesh_intersections(const PreparedScene& scene, bool wedge) {
  for (const MeshIntersection& p : find_mesh_intersections(scene.scene, scene.caster)) {
    BoundaryEdge b;
    b.origin = p.end[0];
    b.end = p.end[1];
    for (int i = 0; i < 2; ++i) {
      b.face[i] = p.triangle[i];
      b.inward[i] = normalize(cross(scene.normal(b.face[i]), b.end - b.origin));
      b.moves |= scene.has_moving_vertex(b.face[i]);
    }
    // The angle between the planes takes the place of the wedge.
    const double angle = std::atan2(length(cross(b.inward[0], b.inward[1])), std::abs(dot(b.inward[0], b.inward[1])));
    b.azimuths = wedge ? angle : kPi;
    if (angle < kCoplanarAngle || !(b.moves || scene.flows.camera_possible())) continue;
    if (const double weight = primary_weight(scene, b, b.azimuths); weight > 0) primary_.add(b, weight);
  }
}

void BoundaryEdges::add_velocity(const PreparedScene& scene, const Sample& point, const Vec3& n_b,
                                 LocalDifferential& out) {
  const BoundaryEdge& edge = *point.edge;
  if (!edge.is_mesh_intersection()) {
    const double share[2] = {1 - point.s, point.s};
    for (int i = 0; i < 2; ++i)
      if (scene.moving.vertex[edge.vertex[i]]) out.vertices.push_back({edge.vertex[i], n_b * share[i], {}});
    return;
  }
  // The line stays in both planes: n_b = a n_0 + c n_1 moves by a n_0 . (velocity of face 0) + c n_1 . (velocity of face 1).
  const Vec3 &n0 = scene.normal(edge.face[0]), &n1 = scene.normal(edge.face[1]);
  const Vec3 line = cross(n0, n1);
  const double cosine = dot(n0, n1), determinant = dot(line, line);
  const double of[2] = {dot(n_b, n0), dot(n_b, n1)};
  for (int i = 0; i < 2; ++i) {
    const Vec3 g = scene.normal(edge.face[i]) * ((of[i] - cosine * of[1 - i]) / determinant);
    add_material_flow(scene, {point.y, scene.normal(edge.face[i]), edge.face[i]}, g, out);
  }
}

void BoundaryEdges::Choice::add(const BoundaryEdge& edge, double weight) {
  edges.push_back(edge);
  weights.push_back(weight);
}

void BoundaryEdges::Choice::finish() {
  double sum[2] = {0, 0};
  for (std::size_t i = 0; i < edges.size(); ++i) sum[edges[i].moves] += weights[i];
  if (sum[0] > 0 && sum[1] > 0)
    for (std::size_t i = 0; i < edges.size(); ++i) weights[i] /= sum[edges[i].moves];
  distribution = DiscreteDistribution(weights);
}

BoundaryEdges::Place BoundaryEdges::Choice::place(double u) const {
  const int i = distribution.sample(u);
  prefetch(edges[i]);
  return {&edges[i], u, distribution.below(i), distribution.probability(i)};
}

BoundaryEdges::Sample::Sample(const Place& place) : Place(place), y(edge->point(s)), tangent(edge->end - edge->origin) {
  const double inverse = 1 / length(tangent);
  tangent *= inverse;
  pdf = share * inverse;
}

int BoundaryEdges::occluder_side(const BoundaryEdge& edge, const Vec3& n_b) {
  const double first = dot(edge.inward[0], n_b);
  if (edge.faces() == 1) return first > 0 ? 1 : first < 0 ? -1 : 0;
  const double second = dot(edge.inward[1], n_b);
  if (first > 0 && second > 0) return 1;
  if (first < 0 && second < 0) return -1;
  return 0;
}

}  // namespace isochron
