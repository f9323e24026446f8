#include "core/techniques/balance.h"

#include <cmath>

#include "core/techniques/light_walk.h"

namespace isochron {

double Balance::standard(const Path& path, int pixel) const {
  return light_rate > 0 ? 1 / (1 + light_rate * light_ratio(path, pixel).all) : 1;
}

double Balance::light(const Path& path, int pixel, int camera_vertices) const {
  const LightRatio ratio = light_ratio(path, pixel, camera_vertices);
  return light_rate * ratio.of_joint / (1 + light_rate * ratio.all);
}

LightRatio Balance::light_ratio(const Path& path, int pixel, int joint) const {
  const int last = path.size() - 1;
  const double rate = pick_.rate(pixel);
  if (last < 2 || !(rate > 0)) return {};
  const SurfacePoint& y = path.vertex[last];
  LightRatio ratio;
  // Over next-event estimation and BSDF sampling of y.
  const double pdf_y = scene_.emitter_pdf(y.triangle);
  double product = pdf_y / (pdf_y + (is_light(y.triangle) ? 0 : step_pdf(path, last)));
  for (int k = last - 1; k > 0; --k) {
    product *= step_from_light_pdf(path, k) / step_pdf(path, k);
    // A light subpath is drawn for every sample of any pixel, and may be seen in every other.
    const double of_joint = k == 1 ? product / rate : product;
    ratio.all += of_joint;
    if (k - 1 == joint) ratio.of_joint = of_joint;
  }
  return std::isfinite(ratio.all) ? ratio : LightRatio{};
}

/// `length_pdf(k)`: density of the path's length in connections of x(k), times the number of samples that make them.
template <class LengthPdf>
double Balance::part_of_arc(const Path& path, int on_arc, double pdf_on_arc, bool gathered,
                            LengthPdf&& length_pdf) const {
  const int last = path.size() - 1;
  const bool by_light = light_connections && !gathered;
  if (last == 1 || (gathered && last == 2)) return on_arc == last ? 1 : 0;  // x0 makes no other connections
  const SurfacePoint &q = path.vertex[last - 1], &y = path.vertex[last];
  if (is_light(y.triangle) && !by_light) return on_arc == last - 1 ? 1 : 0;  // no circle goes through a point
  double sum = 0, found = 0;
  // By the vertex k on an arc: the others' densities, which make a path of the length with an arc in its place.
  const auto count = [&](int k, double others) {
    const double pdf = k == on_arc ? pdf_on_arc
                       : k == last ? emitter_arc_pdf(q, y)
                                   : surface_arc_pdf(path.vertex[k - 1], path.vertex[k], path.vertex[k + 1]);
    const double density = others * pdf * length_pdf(k - 1);
    sum += density;
    if (k == on_arc) found = density;
  };
  const auto outside = [&](int k) { return scene_.outside(path.vertex[k], path.vertex[k + 1]); };
  const double pdf_y = scene_.emitter_pdf(y.triangle);
  if (outside(last - 1)) {
    if (!is_light(y.triangle)) count(last, step_pdf(path, last - 1));
    if (outside(last - 2)) count(last - 1, pdf_y);
  }
  if (by_light && last > 2) {
    double others = pdf_y * step_from_light_pdf(path, last - 1);
    for (int k = last - 2; k > 0; --k) {
      others /= step_pdf(path, k);
      if (outside(k - 1) && outside(k)) count(k, others * LightWalk::pick_probability(last - 2 - k));
      others *= step_from_light_pdf(path, k);
    }
  }
  return sum > 0 && std::isfinite(sum) ? found / sum : 0;
}

double Balance::connection(const Path& path, int pixel, const TargetLength& target, int side, int on_arc,
                           double pdf_on_arc) const {
  // Only where the camera's own connections, which serve the whole image, compete with another's do samples and
  // densities of the length differ between the two techniques.
  const bool same_length_pdf = pick_.uniform() || (path.size() != 3 && !light_connections);
  return part_of_arc(path, on_arc, pdf_on_arc, false, [&](int from) {
    if (same_length_pdf) return 1.0;
    const int served = from == 0 ? GatePick::kImage : pixel;
    // A pair serves one gate.
    return (from == 0 ? 1 : pick_.rate(pixel)) *
           (target.pair ? pick_.probability(served, target.gate) : pick_.length_pdf(served, target.tau[side]));
  });
}

double Balance::gathered(const Path& path, int on_arc, double pdf_on_arc) const {
  return part_of_arc(path, on_arc, pdf_on_arc, true, [](int) { return 1.0; });
}

double Balance::border(const Path& path, int pixel, double tau, const Vec3& tangent, double border_pdf,
                       std::optional<double> pdf_on_arc) const {
  const int last = path.size() - 1;
  const SurfacePoint &x = path.vertex[last - 2], &q = path.vertex[last - 1], &y = path.vertex[last];
  // How often each is tried, times the density of the length there.
  const auto tries = [&](int from) {
    return from == 0 ? pick_.length_pdf(GatePick::kImage, tau) : pick_.rate(pixel) * pick_.length_pdf(pixel, tau);
  };
  const double from_q = step_pdf(path, last - 1) * std::abs(dot(normalize(y.p - q.p), tangent)) * tries(last - 1);
  const double by_arcs =
      !scene_.outside(x, q) ? 0 : border_pdf * (pdf_on_arc ? *pdf_on_arc : surface_arc_pdf(x, q, y)) * tries(last - 2);
  const double sum = from_q + by_arcs;
  return sum > 0 ? (pdf_on_arc ? by_arcs : from_q) / sum : 0;
}

double Balance::step_pdf(const Path& path, int k) const {
  double& pdf = path.steps[k].from_camera;
  if (pdf >= 0) return pdf;
  const SurfacePoint &x = path.vertex[k - 1], &q = path.vertex[k];
  const double to_area = solid_angle_to_area(x.p, q);
  const double per_solid_angle =
      k == 1 ? scene_.camera.image_area_per_solid_angle(normalize(q.p - x.p)) / scene_.camera.pixels()
             : scene_.bsdf_of(x.triangle).pdf(Scattering(path.vertex[k - 2].p, x, q.p));
  return pdf = per_solid_angle * to_area;
}

double Balance::step_from_light_pdf(const Path& path, int k) const {
  double& pdf = path.steps[k].from_light;
  if (pdf >= 0) return pdf;
  const SurfacePoint &x = path.vertex[k], &from = path.vertex[k + 1];
  const double to_area = solid_angle_to_area(from.p, x);
  const double per_solid_angle =
      k + 2 == path.size() ? scene_.emission_pdf(from, normalize(x.p - from.p))
                           : scene_.bsdf_of(from.triangle).pdf(Scattering(x.p, from, path.vertex[k + 2].p).reversed());
  return pdf = per_solid_angle * to_area;
}

/// Density of q on its triangle's arc between foci x and y, per area and length.
double Balance::surface_arc_pdf(const SurfacePoint& x, const SurfacePoint& q, const SurfacePoint& y) const {
  const Ellipsoid ellipsoid(x.p, y.p, length(q.p - x.p) + length(q.p - y.p));
  EllipseArcs arcs;
  if (!ellipsoid.valid() || !scene_.clip(ellipsoid, q.triangle, arcs)) return 0;
  return 1 / (arcs.total_span * area_per_angle_and_length(ellipsoid, q.p, q.n));
}

/// Density of y on its emitter triangle's arc as seen from q, per area and length.
double Balance::emitter_arc_pdf(const SurfacePoint& q, const SurfacePoint& y) const {
  const double distance = length(y.p - q.p);
  EllipseArcs arcs;
  if (!scene_.clip({q.p, q.p, 2 * distance}, y.triangle, arcs)) return 0;
  return 1 / (arcs.total_span * distance);
}

}  // namespace isochron
