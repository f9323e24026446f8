#include "core/techniques/boundary_edges.h"

#include <algorithm>
#include <utility>

#include "core/base/fast_angle.h"
#include "core/base/parallel.h"
#include "core/geometry/mesh_intersections.h"
#include "core/scene/around_edge.h"

namespace isochron {
namespace {

/// Unit direction in the plane of face t, perpendicular to the edge, towards the face's third vertex.
Vec3 inward_direction(const PreparedScene& scene, int t, const Edge& edge, const Vec3& tangent) {
  const bool along = runs_along(scene.scene.triangles[t].vertex, edge.vertex[0], edge.vertex[1]);
  return cross(scene.normal(t), along ? tangent : -tangent);
}

/// What lies counter-clockwise beside face[0] of an edge that more than two faces share, as these lie now.
struct Sector {
  int face;  ///< the next one
  double angle;
  bool holds_camera;
};
Sector sector_beside(const PreparedScene& scene, std::size_t number, const Vec3& tangent) {
  const std::vector<Edge>& edges = scene.scene.edges;
  const Edge& edge = edges[number];
  const auto is_same = [&](std::size_t i) { return edges[i].sector && edges[i].vertex == edge.vertex; };
  std::size_t begin = number;
  while (begin > 0 && is_same(begin - 1)) --begin;
  std::vector<int> faces;
  std::vector<Vec3> inward;
  int own = -1;
  for (std::size_t i = begin; i < edges.size() && is_same(i); ++i) {
    const int face = edges[i].face[0];
    if (!(scene.area(face) > 0)) continue;
    if (i == number) own = static_cast<int>(faces.size());
    faces.push_back(face);
    inward.push_back(inward_direction(scene, face, edge, tangent));
  }
  if (own < 0 || faces.size() < 2) return {edge.face[1], 0, false};
  const NextAround next = next_around(tangent, inward, own);
  // All of the edge is seen from one sector: the half-plane to the camera takes its place among the faces.
  inward.push_back(scene.camera.position - scene.scene.positions[edge.vertex[0]]);
  const bool holds_camera = next_around(tangent, inward, own).number == static_cast<int>(faces.size());
  return {faces[next.number], next.angle, holds_camera};
}

/// Whether the faces run along the edge in opposite directions, as those of an oriented mesh do.
bool is_oriented(const PreparedScene& scene, const BoundaryEdge& edge) {
  const auto along = [&](int i) {
    return runs_along(scene.scene.triangles[edge.face[i]].vertex, edge.vertex[0], edge.vertex[1]);
  };
  return along(0) != along(1);
}

/// How often the camera samples an edge: by its length in the image, and between two faces that are both
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
    within_outline = (seen[0] == seen[1]) == is_oriented(scene, edge);
    if (dark && within_outline) return 0;
  }
  const double in_image = length(cross(a, b)) / (r * (r * r + length_squared(b - a)));
  return in_image * (within_outline ? std::min(1.0, wedge) : 1.0);
}

}  // namespace

BoundaryEdges::BoundaryEdges(const PreparedScene& scene, bool wedge, const Scene* at_first)
    : at_first_(at_first), wedge_(wedge) {
  update(scene);
}
BoundaryEdges::~BoundaryEdges() = default;

void BoundaryEdges::update(const PreparedScene& scene) {
  const std::size_t shapes = scene.scene.shapes.size();
  const int count = static_cast<int>(scene.scene.edges.size());
  // Which edges the camera samples depends on whether points may follow others.
  const bool all = revision_ == 0 || camera_possible_ != scene.flows.camera_possible();
  const auto resize = [this](std::size_t edges) {
    edges_.resize(edges);
    moves_.resize(edges);
    for (Weighted* each : {&primary_, &secondary_}) each->weights.resize(edges);
  };
  if (revision_ == 0) {
    resize(static_cast<std::size_t>(count));
    for (Weighted* each : {&primary_, &secondary_}) each->choice.resize(shapes + 1);
  }
  bool changed = false;
  for (std::size_t s = 0; s < shapes; ++s) {
    if (!update_shape(scene, static_cast<int>(s), all)) continue;
    changed = true;
    set_group(s, scene.scene.shapes[s].first_edge, scene.scene.shapes[s].edge_count);
  }
  if (changed) {
    resize(static_cast<std::size_t>(count));  // without the intersections of before
    if (scene.differentiable.geometry) add_mesh_intersections(scene);
    set_group(shapes, count, static_cast<int>(edges_.size()) - count);
    for (Weighted* each : {&primary_, &secondary_}) each->choice.finish();
  }
  // Last: an interrupted update is made again.
  revision_ = scene.revision();
  camera_possible_ = scene.flows.camera_possible();
}

bool BoundaryEdges::update_shape(const PreparedScene& scene, int shape, bool all) {
  if (!all && scene.shape_changed(shape) <= revision_) return false;
  const int first = scene.scene.shapes[shape].first_edge;
  constexpr int kAhead = 8;
  parallel_ranges(scene.scene.shapes[shape].edge_count, 4096, [&](std::size_t begin, std::size_t end) {
    std::vector<std::size_t> edges;
    for (std::size_t i = first + begin; i < first + end; ++i) {
      const auto& face = scene.scene.edges[i].face;
      // What is next to a face may depend on all that meet there.
      if (all || scene.scene.edges[i].sector || scene.changed(face[0]) > revision_ ||
          (face[1] >= 0 && scene.changed(face[1]) > revision_))
        edges.push_back(i);
    }
    for (std::size_t k = 0; k < edges.size(); ++k) {
      if (k + kAhead < edges.size())
        for (const int t : scene.scene.edges[edges[k + kAhead]].face) scene.prefetch(std::max(t, 0));
      update_edge(scene, edges[k]);
    }
  });
  return true;
}

void BoundaryEdges::set_group(std::size_t group, int first, int count) {
  parallel(2, [&](int i) {
    Weighted& each = i == 0 ? primary_ : secondary_;
    const auto of_group = [&](const auto& all) {
      return std::span(all).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(count));
    };
    each.choice.set_group(group, first, of_group(std::as_const(each.weights)), of_group(std::as_const(moves_)));
  });
}

void BoundaryEdges::update_edge(const PreparedScene& scene, std::size_t i) {
  primary_.weights[i] = secondary_.weights[i] = 0;
  Edge e = scene.scene.edges[i];
  const Vec3 &origin = scene.scene.positions[e.vertex[0]], &end = scene.scene.positions[e.vertex[1]];
  const Vec3 d = end - origin;
  const double edge_length = length(d);
  bool degenerate = !(edge_length > 0), camera_beside = true, may_graze = true;
  if (e.sector && !degenerate) {
    const Sector sector = sector_beside(scene, i, d / edge_length);
    e.face[1] = sector.face;
    camera_beside = sector.holds_camera;
    may_graze = sector.angle > kPi;  // else a line past the edge meets a face on either side
  }
  const int faces = e.face[1] < 0 ? 1 : 2;
  for (int k = 0; k < faces; ++k) degenerate |= !(scene.area(e.face[k]) > 0);
  const Vec3 tangent = degenerate ? Vec3() : d / edge_length;
  Vec3 inward[2];
  for (int k = 0; k < faces; ++k) inward[k] = inward_direction(scene, e.face[k], e, tangent);
  double angle = degenerate ? 0 : kPi;
  if (faces == 2 && !degenerate) angle -= fast_angle(length(cross(inward[0], inward[1])), dot(inward[0], inward[1]));
  const bool sharp = angle >= kCoplanarAngle;
  // Field by field: a copy of a whole edge would wait for the memory of those before.
  BoundaryEdge& b = edges_[i];
  for (int k = 0; k < 2; ++k) {
    b.vertex[k] = e.vertex[k];
    b.face[k] = e.face[k];
    b.inward[k] = inward[k];
  }
  b.origin = origin;
  b.end = end;
  b.azimuths = !sharp ? 0 : wedge_ ? angle : kPi;
  b.moves = sharp && (scene.differentiable.vertex[e.vertex[0]] || scene.differentiable.vertex[e.vertex[1]]);
  if (!sharp) return;
  moves_[i] = b.moves;
  if (camera_beside && (b.moves || scene.flows.camera_possible()))
    primary_.weights[i] = primary_weight(scene, b, b.azimuths);
  if (may_graze) secondary_.weights[i] = edge_length * b.azimuths;
}

void BoundaryEdges::add_mesh_intersections(const PreparedScene& scene) {
  if (!intersections_) {
    const Scene& first = at_first_ ? *at_first_ : scene.scene;
    intersections_ = std::make_unique<MeshIntersections>(first, ray_offset(first));
  }
  intersections_->update(scene.scene, scene.caster.offset());
  for (const MeshIntersection& p : intersections_->segments()) {
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
    b.azimuths = wedge_ ? angle : kPi;
    if (angle < kCoplanarAngle || !(b.moves || scene.flows.camera_possible())) continue;
    edges_.push_back(b);
    moves_.push_back(b.moves);
    primary_.weights.push_back(primary_weight(scene, b, b.azimuths));
    secondary_.weights.push_back(0);
  }
}

void BoundaryEdges::add_velocity(const PreparedScene& scene, const Sample& point, const Vec3& n_b,
                                 LocalDifferential& out) {
  const BoundaryEdge& edge = *point.edge;
  if (!edge.is_mesh_intersection()) {
    const double share[2] = {1 - point.s, point.s};
    for (int i = 0; i < 2; ++i)
      if (scene.differentiable.vertex[edge.vertex[i]]) out.vertices.push_back({edge.vertex[i], n_b * share[i], {}});
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

BoundaryEdges::Pick BoundaryEdges::pick(const EdgeChoice& choice, double u) const {
  const EdgeChoice::Pick picked = choice.pick(u);
  const BoundaryEdge& edge = edges_[picked.edge];
  prefetch(edge);
  return {&edge, u, picked.begin, picked.share};
}

BoundaryEdges::Sample::Sample(const Pick& picked) : Pick(picked), y(edge->point(s)), tangent(edge->end - edge->origin) {
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
