// How the vertices of a path flow when the scene moves.
//
// Theory section 2 keeps x1, the point that the camera sees, on its pixel ray (the pixel flow) and lets every other
// vertex move with its material. Where something that moves comes close to something that does not, both ends of a
// segment of length r then differ by a velocity that does not fall with r, the geometry term between them changes like
// 1 / r, and samples have no variance: along lines of contact, in corners that the camera sees, in moving glass. Any
// tangential velocity t_k may be added to a vertex, if its divergence counts in the interior term and what it carries
// across boundaries in the visibility term (theory section 8). So vertices follow their neighbours on the path.
//
// x_k, k >= 2, follows the material points of neighbours x_j that belong to other bodies (connected meshes):
//     t_k = P_k sum_j a_j (v_j - v_k),   w_j = (1 - |x_k - x_j|^2 / s^2)^2 within s, else 0,
// with P_k the projection into the plane of x_k, v material velocities and s the least of the distance from x_k to the
// creases and borders of its flat patch, so that nothing is carried across those, and `follow` times the radius of the
// smaller of the two bodies. Where x_j may follow x_k as well, the one on the larger patch comes first and the weight of
// the other gets the factor (1 - w) of the first: as r falls, at least one weight is 1 and the velocities agree. Two
// neighbours share x_k by a_1 = w_1 (1 - w_2) / (1 - w_1 w_2) and likewise a_2: as it comes close to either, it follows
// that one alone. Neighbours that stand still count, too, else x_k would follow one and leave the other.
//
// x1 has no crease to mind, for boundaries in the image are all looked for. With w_1 as above, but s some pixels' width at
// its depth, and w_2 the weight by which x2 follows it:
//     v_1 = pixel flow + w_1 P_1 ((1 - w_2) v_2 + w_2 v_1 - pixel flow)    with v the material velocities on the right.
#pragma once
#include <vector>

#include "core/geometry/bounds.h"
#include "core/scene/scene.h"
#include "core/scene/sensors/pinhole.h"

namespace isochron {

struct LocalDifferential;
struct MovingParts;
struct SurfacePoint;
class PreparedScene;

/// How far the vertices of a path follow what is close to them; see above.
struct FollowOptions {
  /// s of x1 in widths of a pixel; 0: x1 stays on its pixel ray.
  double radius_in_pixels = 0;
  /// s of the other vertices in radii of the smaller body (half the diagonal of its box); 0: they move with their material.
  double bodies = 0;
};

/// One neighbour's part of t_k.
struct Following {
  double weight = 0;  ///< a_j
  Vec3 gradient;      ///< of the weight with respect to x_k
};

/// t_k = P_k sum weight (material velocity of the neighbour - base velocity of x_k).
struct VertexFlow {
  Following before, after;  ///< neighbours on the camera's and on the light's side
  Following own;            ///< of x1 alone: its own material point
  bool follows() const { return before.weight > 0 || after.weight > 0 || own.weight > 0; }
};

class VertexFlows {
 public:
  explicit VertexFlows(const Scene& scene);
  /// For the scene as it is made ready but for its flows.
  void update(const PreparedScene& scene, const FollowOptions& options);

  /// Of a segment between neighbours x_k and x_(k+1): how either would follow the other, were there no further ones.
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

  /// Whether there may be points x1 and x2, one of which moves, close enough for x1 to follow.
  bool camera_possible() const { return camera_possible_; }
  /// The same for x1 on the ray from the camera along d, or at x1.
  bool camera_possible_along(const Vec3& d) const { return camera_possible_ && camera_near_.meets_ray(position_, d); }
  bool camera_possible_at(const Vec3& x1) const { return camera_possible_ && camera_near_.holds(x1); }
  /// s at x1: it does not follow what is farther off.
  double camera_radius_at(const Vec3& x1) const { return radius_ * dot(forward_, x1 - position_); }

  /// Whether there may be a neighbour of x_k = p, k > 1, that it follows.
  bool possible_at(const Vec3& p) const { return follows_bodies_ && near_.holds(p); }
  /// Holds all that moves, and every vertex but x1 that may follow or be followed.
  const Bounds& near() const { return near_; }

 private:
  struct Patch {
    int body = -1;
    int first_crease = 0, creases = 0;
    double area = 0;
  };
  /// Sets `possible_patches_` and what depends on it.
  void find_near_bodies(const PreparedScene& scene, double bodies);
  /// `near`: of each body, whether it may follow or be followed.
  void find_patches(const PreparedScene& scene, const std::vector<char>& near);
  void make_patches(const Scene& scene);
  Pair::Weight weight(const PreparedScene& scene, const Vec3& x, int patch, const Vec3& y, double largest,
                      Vec3& gradient_other) const;

  Vec3 position_, forward_;  ///< of the camera
  double radius_ = 0;        ///< s of x1 per depth
  bool camera_possible_ = false;
  Bounds camera_near_;  ///< holds every x1 that may follow
  Bounds near_;         ///< holds what moves and all others that may
  bool follows_bodies_ = false;
  std::vector<int> body_of_vertex_;  ///< connected meshes, which do not change when vertices move
  int bodies_ = 0;
  std::vector<double> body_radius_;  ///< times `follow`
  std::vector<char> joined_;         ///< of each edge: its faces are one plane, and near other bodies
  std::vector<char> near_triangle_;  ///< its body is near others
  std::vector<int> patch_;  ///< of each triangle that is: coplanar triangles of one mesh that share edges; else -1
  std::vector<Patch> patches_;
  std::vector<int> creases_;  ///< edges, patch by patch
};

/// Adds g . (velocity of x1 along its pixel ray) to `out`.
void add_pixel_flow(const PreparedScene& scene, const SurfacePoint& x1, const Vec3& g, LocalDifferential& out);

/// Adds g . t_k to `out`: what x, vertex k, does beyond its base velocity, which is the pixel flow for k = 1, else that of
/// its material. Neighbours whose weight is zero may be null.
void add_following_flow(const PreparedScene& scene, const VertexFlow& flow, const SurfacePoint* before,
                        const SurfacePoint& x, const SurfacePoint* after, int k, const Vec3& g, LocalDifferential& out);

}  // namespace isochron
