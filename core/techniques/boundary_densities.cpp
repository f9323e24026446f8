// Densities by which the techniques that find a boundary segment share it (BoundaryDensities).
#include "core/techniques/secondary_boundary.h"

namespace isochron {

double SecondaryBoundary::direction_pdf(const Segment& g) const {
  const double wedge = 1 / (4 * g.y.edge->azimuths);
  double aimed = 0;
  if (scene_.emits(g.light.triangle) && dot(g.light.n, g.w) < 0)
    aimed = scene_.emitter_pdf(g.light.triangle) * g.r_s * g.r_s / -dot(g.light.n, g.w);
  return (1 - aimed_share_) * wedge + aimed_share_ * aimed;
}

double SecondaryBoundary::towards(const SurfacePoint& before, const SurfacePoint& x, const SurfacePoint& after) const {
  return scene_.bsdf_of(x.triangle).pdf(Scattering(before.p, x, after.p)) * solid_angle_to_area(x.p, after);
}

double SecondaryBoundary::back(const SurfacePoint& before, const SurfacePoint& x, const Vec3& after) const {
  return scene_.bsdf_of(x.triangle).pdf(Scattering(before.p, x, after).reversed()) * solid_angle_to_area(x.p, before);
}

void SecondaryBoundary::extend_camera_densities(int bounce) {
  const Path& path = worker_.path;
  const SurfacePoint &before = path.vertex[bounce - 1], &x = path.vertex[bounce], &after = path.vertex[bounce + 1];
  camera_densities_.towards_light *= towards(before, x, after);
  if (bounce > 1) camera_densities_.towards_camera *= back(before, x, after.p);
}

double SecondaryBoundary::camera_over_edge(const Segment& g, const SurfacePoint& x1, int k, int pixel,
                                           const WalkDensities& walk) const {
  if (!techniques_.from_camera) return 0;
  const Vec3 eye = scene_.sensor_point(pixel).p;
  const double received = scene_.importance(pixel, normalize(x1.p - eye)) * solid_angle_to_area(eye, x1);
  // Segments from an edge serve all pixels of a camera, but one of a capture.
  const double found = scene_.captures()
                           ? scene_.hidden.next_vertex_pdf(x1.triangle, worker_.area_steps.first, received)
                           : worker_.pick.rate(pixel) * received / scene_.pixels();
  const double by_camera = camera_over_edge_rate_ * camera_warp(pixel, k).density(g.y.x()) /
                           edge_warp().density(g.y.x()) * found * walk.towards_light;
  const double by_edge = direction_pdf(g) * solid_angle_to_area(g.y.y, g.camera_end) * walk.towards_camera;
  // Within round-off of the next vertex a path may seem impossible both ways.
  return by_camera > 0 ? by_camera / by_edge : 0;
}

}  // namespace isochron
