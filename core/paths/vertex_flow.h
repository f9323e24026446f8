// The vertex velocity field: how path vertices move when a parameter changes (theory sections 2 and 8).
//
// Plain velocities: x1, the point that the camera sees, stays on its pixel's ray; every other vertex moves with its material.
// Where a moving shape comes close to a static one, samples then have no variance. The contact-aware reparameterisation lets a
// vertex x_k also follow the material points of its neighbours on the path, by a tangential velocity
//     t_k = P_k sum_j a_j (v_j - v_k)        P_k: projection into the plane of x_k, v: material velocities
// whose divergence counts in the interior term, and its flux across edges in the visibility term. Section 8 has the
// weights a_j, their gradients, and the rules for x1.
#pragma once
#include <vector>

#include "core/base/bounds.h"
#include "core/paths/flat_patches.h"
#include "core/scene/scene.h"
#include "core/scene/sensors/pinhole.h"

namespace isochron {

struct LocalDifferential;
struct Differentiable;
struct SurfacePoint;
class PreparedScene;

/// Within which distance the vertices of a path follow what is close to them; see above.
struct FollowOptions {
  /// s of x1 in widths of a pixel; 0: x1 stays on its pixel ray.
  double radius_in_pixels = 0;
  /// s of the other vertices in radii of the smaller body (half the diagonal of its box); 0: they move with their material.
  double bodies = 0;
  /// The emitter's point moves so that the path keeps its length (LengthFlow). Nothing follows it then, and it follows nothing.
  bool keep_length = false;
};

/// One neighbour's part of t_k.
struct Following {
  double weight = 0;  ///< a_j
  Vec3 gradient;      ///< of the weight with respect to x_k
};

/// t_k = P_k sum weight (material velocity of the neighbour - base velocity of x_k).
struct VertexFlow {
  Following before, after;  ///< neighbours on the camera's and on the light's side
  Following own;            ///< only of x1: its own material point
  bool follows() const { return before.weight > 0 || after.weight > 0 || own.weight > 0; }
};

class VertexFlows {
 public:
  explicit VertexFlows(const Scene& scene);
  /// For a scene that is prepared except for its flows.
  void update(const PreparedScene& scene, const FollowOptions& options);

  /// Of a segment between neighbours x_k and x_(k+1): how each would follow the other if there were no further neighbours.
  struct Pair {
    struct Weight {
      double value = 0;
      double missing = 1;  ///< 1 - value, precisely
      Vec3 gradient;       ///< with respect to the follower
    };
    Weight near, far;  ///< of x_k and x_(k+1)
    Following own;     ///< k = 1: of x1 to its own material point
  };
  Pair pair(const PreparedScene& scene, const SurfacePoint& x, const SurfacePoint& y, int k) const;

  /// Of x_k with both its segments; for k = 1, or at the end of a path, the missing one is left blank.
  static VertexFlow at(const Pair& before, const Pair& after, int k);

  /// Whether paths of one bounce or more keep their lengths. All emitters have an extent.
  bool keep_length() const { return keep_length_; }

  /// Whether there may be points x1 and x2, one of which moves, close enough for x1 to follow.
  bool camera_possible() const { return camera_possible_; }
  /// The same for x1 on the ray from the camera along d, or at x1.
  bool camera_possible_along(const Vec3& d) const { return camera_possible_ && camera_near_.meets_ray(position_, d); }
  bool camera_possible_at(const Vec3& x1) const { return camera_possible_ && camera_near_.holds(x1); }
  /// s at x1: it does not follow what is farther off.
  double camera_radius_at(const Vec3& x1) const { return radius_ * dot(forward_, x1 - position_); }

  /// Whether there may be a neighbour of x_k = p, k > 1, that it follows.
  bool possible_at(const Vec3& p) const { return follows_bodies_ && near_.holds(p); }
  /// Bounding box of moving geometry and of all points (x2, x3, ...) that may follow it or be followed.
  const Bounds& near() const { return near_; }

 private:
  /// Sets `follows_bodies_` and what depends on it.
  void find_near_bodies(const PreparedScene& scene, double bodies);
  void update_bodies(const PreparedScene& scene);
  /// Whether the shape has a static triangle inside `camera_near_`.
  bool has_still_triangle_in_reach(const PreparedScene& scene, std::size_t shape) const;
  Pair::Weight weight(const PreparedScene& scene, const Vec3& x, int patch, const Vec3& y, double largest,
                      Vec3& gradient_other) const;

  Vec3 position_, forward_;  ///< of the camera
  double radius_ = 0;        ///< s of x1 per depth
  bool camera_possible_ = false;
  Bounds camera_near_;  ///< holds every x1 that may follow
  Bounds near_;         ///< holds what moves and all others that may
  bool follows_bodies_ = false, keep_length_ = false;
  std::vector<int> body_of_vertex_;  ///< connected meshes, which do not change when vertices move
  std::vector<int> shape_of_body_;
  std::vector<Bounds> shape_bounds_, body_bounds_;
  std::vector<char> body_moves_;
  int bodies_revision_ = 0;          ///< of the scene that these are of
  std::vector<double> body_radius_;  ///< times `follow`
  FlatPatches patches_;              ///< where `follows_bodies_`
};

/// Adds g . (velocity of x1 along its pixel ray) to `out`; nothing where the camera sees x1 exactly edge-on.
void add_pixel_flow(const PreparedScene& scene, const SurfacePoint& x1, const Vec3& g, LocalDifferential& out);

/// Adds g . t_k to `out`: what x, vertex k, does beyond its base velocity, which is the pixel flow for k = 1, else that of
/// its material. Neighbours whose weight is zero may be null.
void add_following_flow(const PreparedScene& scene, const VertexFlow& flow, const SurfacePoint* before,
                        const SurfacePoint& x, const SurfacePoint* after, int k, const Vec3& g, LocalDifferential& out);

}  // namespace isochron
