// Primary visibility boundary: a camera ray grazes an edge (theory section 5, "Primary") or the border of a
// pixel. Light crosses it where the edge moves, and where the points beside it follow others (see
// VertexFlows): per length,
//     L (velocity of the boundary - flow of x1) . n_B / distance, with the sign of the side.
#pragma once
#include "core/techniques/boundary_edges.h"
#include "core/techniques/boundary_guide.h"
#include "core/techniques/light_side.h"

namespace isochron {

class PrimaryBoundary {
 public:
  /// `narrow_gates`: use the techniques that draw lengths from the gates.
  PrimaryBoundary(Worker& worker, const BoundaryEdges& edges, const BoundaryGuide& guide, bool narrow_gates);

  /// One edge point, where there are any (`has_primary`); contributions are scaled by `scale` (one over the number of edge
  /// points).
  void sample(double scale, Rng& rng);

  /// One point on the border of a pixel, left or above, where what the camera sees may follow something; contributions are
  /// scaled by `scale` (one over the number of points).
  void sample_pixel_border(double scale, Rng& rng);

 private:
  /// Hands the light that x1 sends to the camera from points that it follows to add(value, length), the sink
  /// being bound to g . (how x1 follows); breakdowns attribute it to `triangle`.
  template <class Add>
  void follow(const SurfacePoint& x1, int pixel, int triangle, const Vec3& g, Rng& rng, Add&& add);

  Worker& worker_;
  const PreparedScene& scene_;
  const BoundaryEdges& edges_;
  const BoundaryGuide& guide_;
  LightSide light_side_;
  SurfacePoint eye_;
  LocalDifferential following_;
};

}  // namespace isochron
