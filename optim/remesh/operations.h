// The changes of a mesh that remeshing is made of, each where it does no harm: it leaves the surface a manifold of the same
// kind, folds nothing, makes no thin triangle where there was none, and touches no triangle with a held vertex.
#pragma once
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <functional>
#include <vector>

#include "optim/remesh/surface.h"

namespace isochron {

class Operations {
 public:
  /// Borders turn at corners, which stay where they are. Throws InputError where `surface` is no manifold.
  Operations(const Surface& surface, double edge_length);

  /// Vertices for which it says so are held from now on; so are those that come to lie there.
  void hold(std::function<bool(const Vec3&)> held);

  /// Edges longer than 4/3 of the edge length, in halves: the surface stays as it is.
  void split_long();
  /// Edges shorter than 4/5 of it, one end into the other, unless that makes one too long to stay.
  void collapse_short();
  /// Edges become the other diagonal of their two triangles where that brings valences closer to 6, of borders to 4.
  void flip_towards_even_valences();
  /// Vertices move within the surface towards the middle of their neighbours, those of borders along the border.
  void relax();

  Mesh mesh() const;
  /// Of each vertex of mesh(): on the surface.
  std::vector<MeshPoint> origins() const;
  /// Of each vertex of mesh().
  std::vector<char> held() const;

 private:
  struct Traits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
    VertexAttributes(OpenMesh::Attributes::Status);
    EdgeAttributes(OpenMesh::Attributes::Status);
    FaceAttributes(OpenMesh::Attributes::Status);
    HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
  };
  using Kernel = OpenMesh::TriMesh_ArrayKernelT<Traits>;
  using Vertex = OpenMesh::VertexHandle;
  using Halfedge = OpenMesh::HalfedgeHandle;
  using Corners = std::array<Vec3, 3>;

  void add_faces();
  void mark_corners();

  Vec3 position(Vertex v) const;
  Corners corners(OpenMesh::FaceHandle face) const;
  double edge_length(OpenMesh::EdgeHandle edge) const;
  bool is_held(Vertex v) const { return kernel_.status(v).locked(); }
  bool touches_held(OpenMesh::FaceHandle face) const;
  /// Whether all faces about v may have it at `to`, but for those that also have `gone`.
  bool may_move(Vertex v, const Vec3& to, Vertex gone) const;
  bool may_collapse(Halfedge h);
  /// Whether what is left about v is no fold: three triangles, at a border one.
  bool may_lose_an_edge(Vertex v) const;
  bool may_flip(OpenMesh::EdgeHandle edge) const;
  /// Of the area-weighted normals about v.
  Vec3 normal(Vertex v) const;
  /// Within the tangent plane, or of the two along the border.
  Vec3 middle_of_neighbours(Vertex v) const;
  /// The point closest to p on the part of the surface that v belongs to.
  MeshPoint origin(Vertex v, const Vec3& p) const;

  const Surface* surface_;
  double length_;
  std::function<bool(const Vec3&)> held_ = [](const Vec3&) { return false; };
  Kernel kernel_;
};

}  // namespace isochron
