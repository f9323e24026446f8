#include "optim/remesh/operations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <utility>

#include "core/base/error.h"

namespace isochron {
namespace {

// Halves of an edge of 4/3 and what two of 4/5 leave when one end goes into the other lie about as far from the target.
constexpr double kLongest = 4.0 / 3, kShortest = 4.0 / 5;
// A border has a corner where it turns by more than half a right angle.
constexpr double kCornerCosine = 0.70710678118654752;
// A triangle may not turn further than by 60 degrees at a time.
constexpr double kTurnCosine = 0.5;
// Twice the area over the square of the longest edge: 0.87 of the regular triangle, 0.5 of one with angles of 45, 45 and 90.
constexpr double kLeastShape = 0.15;

Vec3 from(const OpenMesh::Vec3d& p) {
  return {p[0], p[1], p[2]};
}
OpenMesh::Vec3d to(const Vec3& p) {
  return {p.x, p.y, p.z};
}

using Corners = std::array<Vec3, 3>;

Vec3 double_area(const Corners& t) {
  return cross(t[1] - t[0], t[2] - t[0]);
}

double shape(const Corners& t) {
  const double longest =
      std::max({length_squared(t[1] - t[0]), length_squared(t[2] - t[1]), length_squared(t[0] - t[2])});
  return length(double_area(t)) / longest;
}

/// Whether the triangle may take the place of another.
bool may_follow(const Corners& next, const Corners& before) {
  const Vec3 a = double_area(before), b = double_area(next);
  return dot(a, b) > kTurnCosine * length(a) * length(b) && shape(next) > std::min(kLeastShape, shape(before));
}

/// Where vertices are. On a surface that passes through itself, vertices of two parts can be drawn to one corner of a border, and
/// readers take vertices at one position for one.
class Places {
 public:
  explicit Places(double edge_length) : apart_(edge_length * kApart) {}

  void add(const Vec3& p) { cells_.emplace(cell(p, 0), p); }
  void remove(const Vec3& p) {
    const auto [first, last] = cells_.equal_range(cell(p, 0));
    const auto found =
        std::find_if(first, last, [&](const auto& entry) { return length_squared(entry.second - p) == 0; });
    cells_.erase(found);
  }
  bool taken(const Vec3& p) const {
    const Cell low = cell(p, -apart_), high = cell(p, apart_);
    for (Cell c = low; c[0] <= high[0]; ++c[0])
      for (c[1] = low[1]; c[1] <= high[1]; ++c[1])
        for (c[2] = low[2]; c[2] <= high[2]; ++c[2]) {
          const auto [first, last] = cells_.equal_range(c);
          if (std::any_of(first, last, [&](const auto& entry) { return length(entry.second - p) <= apart_; }))
            return true;
        }
    return false;
  }

 private:
  static constexpr double kApart = 0x1p-20;  // of an edge, far above rounding
  using Cell = std::array<long long, 3>;

  /// Large enough that a place mostly has all that is close to it in one.
  Cell cell(const Vec3& p, double beside) const {
    Cell result{};
    for (int axis = 0; axis < 3; ++axis)
      result[axis] = static_cast<long long>(std::floor((p[axis] + beside) / (64 * apart_)));
    return result;
  }

  double apart_;
  std::multimap<Cell, Vec3> cells_;
};

}  // namespace

Operations::Operations(const Surface& surface, double edge_length) : surface_(&surface), length_(edge_length) {
  add_faces();
  mark_corners();
}

void Operations::add_faces() {
  const Mesh& mesh = surface_->mesh();
  std::vector<Vertex> vertices;
  for (const Vec3& p : mesh.positions) vertices.push_back(kernel_.add_vertex(to(p)));
  const auto fail = [](const Vec3& p) {
    throw InputError(
        fmt::format("is no manifold whose faces agree about their side at ({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z));
  };
  omerr().disable();  // what it would say of faces that it refuses
  for (const auto& face : mesh.faces)
    if (!kernel_.add_face(vertices[face[0]], vertices[face[1]], vertices[face[2]]).is_valid())
      fail(mesh.positions[face[0]]);
  for (const Vertex v : kernel_.vertices())
    if (!kernel_.is_manifold(v)) fail(position(v));
}

void Operations::mark_corners() {
  for (const Vertex v : kernel_.vertices()) {
    if (!kernel_.is_boundary(v)) continue;
    const Halfedge out = kernel_.halfedge_handle(v);  // of a vertex on a border the one along it
    const Vec3 ahead = position(kernel_.to_vertex_handle(out)) - position(v);
    const Vec3 behind = position(v) - position(kernel_.from_vertex_handle(kernel_.prev_halfedge_handle(out)));
    if (dot(ahead, behind) < kCornerCosine * length(ahead) * length(behind)) kernel_.status(v).set_feature(true);
  }
}

void Operations::hold(std::function<bool(const Vec3&)> held) {
  held_ = std::move(held);
  for (const Vertex v : kernel_.vertices()) kernel_.status(v).set_locked(held_(position(v)));
}

void Operations::split_long() {
  // The longest first: it is the longest of both its triangles, so that their angles are at least halves of what they were.
  std::priority_queue<std::pair<double, int>> longest;
  const auto add = [&](OpenMesh::EdgeHandle edge) {
    if (const double length = edge_length(edge); length > kLongest * length_) longest.emplace(length, edge.idx());
  };
  for (const OpenMesh::EdgeHandle edge : kernel_.edges()) add(edge);
  while (!longest.empty()) {
    const OpenMesh::EdgeHandle edge(longest.top().second);
    longest.pop();
    const Halfedge h = kernel_.halfedge_handle(edge, 0);
    const Vec3 p = (position(kernel_.from_vertex_handle(h)) + position(kernel_.to_vertex_handle(h))) / 2.0;
    const Vertex middle = kernel_.split(edge, to(p));
    kernel_.status(middle).set_locked(held_(p));
    for (const OpenMesh::EdgeHandle part : kernel_.ve_range(middle)) add(part);
  }
}

void Operations::collapse_short() {
  const auto try_edge = [&](OpenMesh::EdgeHandle edge) {
    for (int side = 0; side < 2; ++side) {
      const Halfedge h = kernel_.halfedge_handle(edge, static_cast<unsigned>(side));
      if (!may_collapse(h)) continue;
      kernel_.collapse(h);
      return true;
    }
    return false;
  };
  bool again = true;
  while (again) {
    again = false;
    for (unsigned i = 0; i < kernel_.n_edges(); ++i) {
      const OpenMesh::EdgeHandle edge(static_cast<int>(i));
      if (!kernel_.status(edge).deleted() && edge_length(edge) < kShortest * length_) again |= try_edge(edge);
    }
  }
  kernel_.garbage_collection();
}

void Operations::flip_towards_even_valences() {
  const auto surplus = [&](Vertex v, int change) {
    const int valence = static_cast<int>(kernel_.valence(v)) + change - (kernel_.is_boundary(v) ? 4 : 6);
    return valence * valence;
  };
  for (const OpenMesh::EdgeHandle edge : kernel_.edges()) {
    if (kernel_.is_boundary(edge) || !kernel_.is_flip_ok(edge)) continue;
    const Halfedge h = kernel_.halfedge_handle(edge, 0), back = kernel_.opposite_halfedge_handle(h);
    const Vertex a = kernel_.from_vertex_handle(h), b = kernel_.to_vertex_handle(h);
    const Vertex c = kernel_.to_vertex_handle(kernel_.next_halfedge_handle(h)),
                 d = kernel_.to_vertex_handle(kernel_.next_halfedge_handle(back));
    const int before = surplus(a, 0) + surplus(b, 0) + surplus(c, 0) + surplus(d, 0);
    const int after = surplus(a, -1) + surplus(b, -1) + surplus(c, 1) + surplus(d, 1);
    if (after < before && may_flip(edge)) kernel_.flip(edge);
  }
}

void Operations::relax() {
  Places places(length_);
  for (const Vertex v : kernel_.vertices()) places.add(position(v));
  for (const Vertex v : kernel_.vertices()) {
    if (kernel_.status(v).feature()) continue;
    const auto try_at = [&](const Vec3& p) {
      const Vec3 there = origin(v, p).position;
      const bool may = may_move(v, there, Vertex()) && !places.taken(there);
      if (may) kernel_.set_point(v, to(there));
      return may;
    };
    const Vec3 before = position(v);
    places.remove(before);
    if (!try_at(middle_of_neighbours(v))) try_at(before);
    places.add(position(v));
  }
}

Vec3 Operations::position(Vertex v) const {
  return from(kernel_.point(v));
}

Operations::Corners Operations::corners(OpenMesh::FaceHandle face) const {
  Corners result;
  int k = 0;
  for (const Vertex v : kernel_.fv_range(face)) result[k++] = position(v);
  return result;
}

double Operations::edge_length(OpenMesh::EdgeHandle edge) const {
  return kernel_.calc_edge_length(edge);
}

bool Operations::touches_held(OpenMesh::FaceHandle face) const {
  const auto vertices = kernel_.fv_range(face);
  return std::any_of(vertices.begin(), vertices.end(), [&](Vertex v) { return is_held(v); });
}

bool Operations::may_move(Vertex v, const Vec3& to_there, Vertex gone) const {
  for (const OpenMesh::FaceHandle face : kernel_.vf_range(v)) {
    if (touches_held(face)) return false;
    Corners next;
    bool stays = true;
    int k = 0;
    for (const Vertex w : kernel_.fv_range(face)) {
      stays = stays && w != gone;
      next[k++] = w == v ? to_there : position(w);
    }
    if (stays && !may_follow(next, corners(face))) return false;
  }
  return true;
}

bool Operations::may_collapse(Halfedge h) {
  const Vertex removed = kernel_.from_vertex_handle(h), kept = kernel_.to_vertex_handle(h);
  if (kernel_.status(removed).feature() || !kernel_.is_collapse_ok(h)) return false;
  if (kernel_.is_boundary(removed) && !kernel_.is_boundary(kernel_.edge_handle(h))) return false;
  const Vec3 there = position(kept);
  for (const Halfedge side : {h, kernel_.opposite_halfedge_handle(h)})
    if (!kernel_.is_boundary(side) && !may_lose_an_edge(kernel_.to_vertex_handle(kernel_.next_halfedge_handle(side))))
      return false;
  for (const Vertex w : kernel_.vv_range(removed))
    if (length(position(w) - there) > kLongest * length_) return false;
  return may_move(removed, there, kept);
}

bool Operations::may_lose_an_edge(Vertex v) const {
  return kernel_.valence(v) > (kernel_.is_boundary(v) ? 2u : 3u);
}

bool Operations::may_flip(OpenMesh::EdgeHandle edge) const {
  const Halfedge h = kernel_.halfedge_handle(edge, 0), back = kernel_.opposite_halfedge_handle(h);
  const OpenMesh::FaceHandle left = kernel_.face_handle(h), right = kernel_.face_handle(back);
  if (touches_held(left) || touches_held(right)) return false;
  if (!may_lose_an_edge(kernel_.from_vertex_handle(h)) || !may_lose_an_edge(kernel_.to_vertex_handle(h))) return false;
  const Vec3 a = position(kernel_.from_vertex_handle(h)), b = position(kernel_.to_vertex_handle(h)),
             c = position(kernel_.to_vertex_handle(kernel_.next_halfedge_handle(h))),
             d = position(kernel_.to_vertex_handle(kernel_.next_halfedge_handle(back)));
  for (const Corners& next : {Corners{c, a, d}, Corners{d, b, c}})
    if (!may_follow(next, corners(left)) || !may_follow(next, corners(right))) return false;
  return true;
}

Vec3 Operations::normal(Vertex v) const {
  Vec3 sum;
  for (const OpenMesh::FaceHandle face : kernel_.vf_range(v)) sum += double_area(corners(face));
  return sum;
}

Vec3 Operations::middle_of_neighbours(Vertex v) const {
  if (kernel_.is_boundary(v)) {
    const Halfedge out = kernel_.halfedge_handle(v);
    return (position(kernel_.to_vertex_handle(out)) +
            position(kernel_.from_vertex_handle(kernel_.prev_halfedge_handle(out)))) /
           2.0;
  }
  Vec3 sum;
  int neighbours = 0;
  for (const Vertex w : kernel_.vv_range(v)) {
    sum += position(w);
    ++neighbours;
  }
  const Vec3 p = position(v), n = normal(v), step = sum / neighbours - p;
  const double squared = length_squared(n);
  return squared > 0 ? p + step - n * (dot(n, step) / squared) : p;
}

MeshPoint Operations::origin(Vertex v, const Vec3& p) const {
  if (kernel_.is_boundary(v)) return surface_->closest_on_border(p);
  const MeshPoint found = surface_->closest(p, normal(v));
  return found.face >= 0 ? found : surface_->closest(p, {});
}

Mesh Operations::mesh() const {
  Mesh result;
  for (const Vertex v : kernel_.vertices()) result.positions.push_back(position(v));
  for (const OpenMesh::FaceHandle face : kernel_.faces()) {
    std::array<int, 3> f{};
    int k = 0;
    for (const Vertex v : kernel_.fv_range(face)) f[k++] = v.idx();
    result.faces.push_back(f);
  }
  return result;
}

std::vector<MeshPoint> Operations::origins() const {
  std::vector<MeshPoint> result;
  for (const Vertex v : kernel_.vertices()) result.push_back(origin(v, position(v)));
  return result;
}

std::vector<char> Operations::held() const {
  std::vector<char> result;
  for (const Vertex v : kernel_.vertices()) result.push_back(is_held(v));
  return result;
}

}  // namespace isochron
