// How the techniques that may find a complete path share it.
//
// Surface arcs and emitter arcs (ellipsoidal connections) by the balance heuristic: their densities are per
// area at the path's last two vertices, without the camera walk that they have in common. Connections of the
// camera itself serve every pixel; so that they compare, walks count as starting at a random point of a
// random pixel.
//
// Standard sampling and ellipsoidal connections by a balance heuristic with an estimate for the latter:
// connections choose among all the arcs that an ellipsoid leaves on the scene, whose common length no single
// path knows.
#pragma once
#include "core/geometry/ellipsoid.h"
#include "core/paths/path.h"
#include "core/techniques/gate_pick.h"

namespace isochron {

struct ArcDensities {
  double surface = 0, emitter = 0;
};

class Techniques {
 public:
  Techniques(const PreparedScene& scene, const GatePick& pick) : scene_(scene), pick_(pick) {}

  /// Of the complete path x0 .. x(K), which technique `found` by a point whose density on its arc is `pdf_on_arc`, per
  /// area and length. `length_pdf(k)`: density of the path's length in connections of x(k), times the number of samples
  /// that make them.
  /// `walks_only`: x0 makes no connections (it is no camera).
  template <class LengthPdf>
  ArcDensities arcs(const Path& path, double ArcDensities::*found, double pdf_on_arc, bool walks_only,
                    LengthPdf&& length_pdf) const {
    const int last = path.size() - 1;
    const SurfacePoint& y = path.vertex[last];
    const bool by_emitter = found == &ArcDensities::emitter;
    if (is_light(y.triangle)) return {1, 0};  // no circle goes through a point
    if (last == 1) return {0, pdf_on_arc * length_pdf(0)};
    if (walks_only && last == 2) return {0, 1};
    const SurfacePoint &x = path.vertex[last - 2], &q = path.vertex[last - 1];
    ArcDensities d;
    if (!scene_.outside(q, y)) return d;
    d.emitter = step_pdf(path, last - 2, q) * (by_emitter ? pdf_on_arc : emitter_arc_pdf(q, y)) * length_pdf(last - 1);
    if (scene_.outside(x, q))
      d.surface =
          scene_.emitter_pdf(y.triangle) * (by_emitter ? surface_arc_pdf(x, q, y) : pdf_on_arc) * length_pdf(last - 2);
    return d;
  }

  /// Weight of the path under ellipsoidal connections when they are `share` of the samples and their density is
  /// multiplied by `pair_coupling_gain`; standard sampling has the rest.
  double ellipsoidal_weight(const Path& path, int pixel, double share, double pair_coupling_gain) const {
    const int last = path.size() - 1;
    const SurfacePoint& y = path.vertex[last];
    const double length = path.length[last], pdf_y = scene_.emitter_pdf(y.triangle);
    const double to_y = length - path.length[last - 1];
    // The arc that an emitter of this size leaves on a sphere of this radius.
    const double across = std::min(1 / std::sqrt(pdf_y), 2 * kPi * to_y);
    const double rate = pick_.rate(pixel);  // of walks through the pixel
    double standard, ellipsoidal;
    if (last == 1) {
      standard = rate * step_pdf(path, 0, y);
      ellipsoidal = pick_.length_pdf(GatePick::kImage, length) / across;
    } else {
      const SurfacePoint &x = path.vertex[last - 2], &q = path.vertex[last - 1];
      if (!scene_.outside(q, y)) return 0;
      const double to_q = path.length[last - 1] - path.length[last - 2], pdf_q = rate * step_pdf(path, last - 2, q);
      standard = pdf_q * (pdf_y + step_pdf(path, last - 1, y));
      // Ellipsoids cross the scene on a few closed curves, where dA = |q-a| |q-b| / sqrt(tau^2 - |P(b-a)|^2)
      // dphi dtau.
      constexpr double kCurves = 1;
      const Vec3 d = y.p - x.p;
      const double in_plane = isochron::length_squared(d) - dot(d, q.n) * dot(d, q.n);
      const double area_rate = to_q * to_y / std::sqrt((to_q + to_y) * (to_q + to_y) - in_plane);
      ellipsoidal = is_light(y.triangle) ? 0 : pdf_q * pick_.length_pdf(pixel, length) / across;
      if (scene_.outside(x, q))
        ellipsoidal +=
            pdf_y * (last == 2 ? pick_.length_pdf(GatePick::kImage, length) : rate * pick_.length_pdf(pixel, length)) /
            (2 * kPi * kCurves * area_rate);
    }
    const double ours = pair_coupling_gain * share * ellipsoidal;
    return ours / (ours + (1 - share) * standard);
  }

  /// Density per area with which a walk at the path's vertex `from` continues to q (from the
  /// camera: by a random point of a random pixel).
  double step_pdf(const Path& path, int from, const SurfacePoint& q) const {
    const SurfacePoint& x = path.vertex[from];
    const double to_area = solid_angle_to_area(x.p, q);
    if (from == 0)
      return scene_.camera.image_area_per_solid_angle(normalize(q.p - x.p)) * to_area / scene_.camera.pixels();
    const Scattering s(path.vertex[from - 1].p, x, q.p);
    return scene_.bsdf_of(x.triangle).pdf(s) * to_area;
  }

  /// Density of q on its triangle's arc between foci x and y, per area and length.
  double surface_arc_pdf(const SurfacePoint& x, const SurfacePoint& q, const SurfacePoint& y) const {
    const Ellipsoid ellipsoid(x.p, y.p, length(q.p - x.p) + length(q.p - y.p));
    EllipseArcs arcs;
    if (!ellipsoid.valid() || !scene_.clip(ellipsoid, q.triangle, arcs)) return 0;
    return 1 / (arcs.total_span * area_per_angle_and_length(ellipsoid, q.p, q.n));
  }

 private:
  /// Density of y on its emitter triangle's arc as seen from q, per area and length.
  double emitter_arc_pdf(const SurfacePoint& q, const SurfacePoint& y) const {
    const double distance = length(y.p - q.p);
    EllipseArcs arcs;
    if (!scene_.clip({q.p, q.p, 2 * distance}, y.triangle, arcs)) return 0;
    return 1 / (arcs.total_span * distance);
  }

  const PreparedScene& scene_;
  const GatePick& pick_;
};

}  // namespace isochron
