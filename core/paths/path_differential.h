// The one local differential of a path, by hand in reverse (theory section 2): how ln F (contribution) and l (length)
// change with everything the path touches. TangentSink and AdjointSink (sinks.h) take what this writes.
#pragma once
#include <vector>

#include "core/paths/path.h"

namespace isochron {

/// Gradients with respect to one mesh vertex; `channel` -1: ln F of every channel, else of one.
struct VertexGradient {
  int vertex;
  Vec3 log_f;   ///< of ln F
  Vec3 length;  ///< of the (optical) path length
  int channel = -1;
};

/// Gradients with respect to a scalar degree of freedom; `channel` -1: of every channel.
struct ScalarGradient {
  int dof;
  int channel;
  double log_f;       ///< of ln F
  double length = 0;  ///< of the path length
};

/// Sparse gradient of one path (or boundary segment). What appears more than once adds up.
struct LocalDifferential {
  std::vector<VertexGradient> vertices;
  std::vector<ScalarGradient> scalars;
  /// Adds `factor` times the change of the length that `other` holds to what counts with the gate's value.
  void add_length(const LocalDifferential& other, double factor) {
    for (const VertexGradient& v : other.vertices) vertices.push_back({v.vertex, v.length * factor, {}});
    for (const ScalarGradient& s : other.scalars) scalars.push_back({s.dof, -1, s.length * factor});
  }
  void clear() {
    vertices.clear();
    scalars.clear();
  }
  /// f(degree of freedom, channel, change of ln F, change of the length) for every entry, axis by axis.
  template <class F>
  void for_each(const DofLayout& layout, F&& f) const {
    for (const VertexGradient& v : vertices)
      for (int axis = 0; axis < 3; ++axis) f(layout.vertex(v.vertex, axis), v.channel, v.log_f[axis], v.length[axis]);
    for (const ScalarGradient& s : scalars) f(s.dof, s.channel, s.log_f, s.length);
  }
  bool empty() const { return vertices.empty() && scalars.empty(); }
};

/// Differentiates the path vertex[0..count-1] of a pixel, vertex[0] the camera or sensor point and vertex[count-1] on an emitter (or, where
/// `length_only`, only its length). Vertices flow as VertexFlows says; area factors of material points, and what F gains
/// where the flow spreads, count in ln F. Static vertices are left out. Empty where a segment lies exactly in a surface that it ends at:
/// F is zero there, or by rounding next to it, and ln F has no derivative.
void differentiate_path(const PreparedScene& scene, int pixel, const SurfacePoint* vertex, int count, bool length_only,
                        LocalDifferential& out);

/// Adds g . (velocity of the material point x) to `out`: entries on the triangle's three vertices, or
/// on the light that x is. Other points without a triangle (camera, sensor point, laser spot) are static.
void add_material_flow(const PreparedScene& scene, const SurfacePoint& x, const Vec3& g, LocalDifferential& out);

}  // namespace isochron
