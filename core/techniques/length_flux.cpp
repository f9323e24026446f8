// What flows that keep the length carry across the ends of circles on emitters (theory section 7): where a circle begins, and where it
// meets a border of the emitter, as arcs between a vertex and a point of the border find it.
#include "core/paths/length_flow.h"
#include "core/techniques/ellipsoidal_impl.h"

namespace isochron {
namespace {

/// How far behind an emitter the second focus of front arcs is, over the lengths involved: lengths are off by about one over
/// this, and by rounding as many times the smallest number.
constexpr double kFarFocus = 0x1p23;

}  // namespace

void EllipsoidalConnections::connect_front(const TargetLength& target, int pixel, const Rgb& throughput, Rng& rng) {
  const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
  const double along = rng.uniform(), pick = rng.uniform(), thinning = rng.uniform();
  double pdf_area;
  const SurfacePoint on_emitter = scene_.sample_emitter(u0, u1, u2, pdf_area);
  const int emitter = on_emitter.triangle;
  const SurfacePoint& x = worker_.path.back();
  const double left = target.tau[0] - worker_.path.length.back();
  if (!(left > 0)) return;
  // Heights over the emitter's plane are distances from a focus far behind it: it need not be infinitely far.
  const double far = kFarFocus * (left + length(on_emitter.p - x.p));
  const Foci foci(x.p, on_emitter.p - on_emitter.n * far);
  const Ellipsoid ellipsoid(foci, far + left);
  if (!ellipsoid.valid()) return;
  const EllipsoidBvh& bvh =
      scene_.hierarchy(any_arc_contributes(emitter) ? PreparedScene::Part::all : PreparedScene::Part::moving);
  find_candidates(bvh, {foci.b, {0, 0, 0}, 0, 1, false}, ellipsoid.tau, ellipsoid.tau, thinning);

  const auto foot = [&](const SurfacePoint& q) {
    return SurfacePoint{q.p - on_emitter.n * scene_.height_over(emitter, q.p), on_emitter.n, emitter};
  };
  const auto holds_foot = [&](const SurfacePoint& q) {
    const auto b = scene_.barycentrics(foot(q));
    return scene_.height_over(emitter, q.p) > 0 && b[0] >= 0 && b[1] >= 0 && b[2] >= 0;
  };
  const Rgb factor = throughput * (target.scale / (pdf_area * scene_.area(emitter)));
  const auto choices = choose(pick, 2, [&](int t, ArcPair& arcs) {
    ArcPoint& q = arcs.side[0];
    surface_arc_point(ellipsoid, scene_.focal_triangle(foci, t), t, foot, leaves_emitter(), along, pixel, factor, q);
    if (!q.value.is_black() && !holds_foot(q.point)) q.value = {};
  });
  for_each_seen(choices, [&](int, const ArcPoint& q, double inverse_probability) {
    const SurfacePoint y = foot(q.point);
    if (!worker_.visible(q.point, y)) return;
    worker_.path.push(scene_, y);
    // A circle begins with radius zero: the length of its arc is 2 pi times the distance, per length of the path.
    const double circle = 2 * kPi * scene_.height_over(emitter, q.point.p);
    if (worker_.contributes(worker_.path))
      worker_.emit_length_flux(worker_.path, q.pixel, q.value * (-circle * inverse_probability), target.tau[0]);
    worker_.path.pop();
  });
}

void EllipsoidalConnections::connect_border(const TargetLength& target, int pixel, const Rgb& throughput, Rng& rng) {
  const double u_emitter = rng.uniform(), u_border = rng.uniform();
  const double along = rng.uniform(), pick = rng.uniform(), thinning = rng.uniform();
  const auto border = borders_.pick(u_emitter, u_border);
  if (!border) return;
  const SurfacePoint &y = border->y, &x = worker_.path.back();
  const double left = target.tau[0] - worker_.path.length.back();
  const Foci foci(x.p, y.p);
  const Ellipsoid ellipsoid(foci, left);
  if (!ellipsoid.valid()) return;
  const EllipsoidBvh& bvh =
      scene_.hierarchy(any_arc_contributes(y.triangle) ? PreparedScene::Part::all : PreparedScene::Part::moving);
  find_candidates(bvh, {y.p, y.n, 0, 1, true}, left, left, thinning);

  const Rgb factor = throughput * (target.scale / border->pdf);
  const auto choices = choose(pick, 2, [&](int t, ArcPair& arcs) {
    ArcPoint& q = arcs.side[0];
    surface_arc_point(
        ellipsoid, scene_.focal_triangle(foci, t), t, [&](const SurfacePoint&) { return y; }, leaves_emitter(), along,
        pixel, factor, q);
    if (q.value.is_black()) return;
    const double outwards = std::abs(borders_.outwards(q.point, *border));
    q.value = std::isfinite(outwards) ? q.value * outwards : Rgb();
  });
  for_each_seen(choices, [&](int, const ArcPoint& q, double inverse_probability) {
    if (!worker_.visible(q.point, y)) return;
    worker_.path.push(scene_, y);
    if (worker_.contributes(worker_.path)) {
      const double sign = std::copysign(1.0, borders_.outwards(q.point, *border));
      const double part =
          worker_.balance.border(worker_.path, q.pixel, target.tau[0], border->tangent, border->pdf, q.pdf);
      worker_.emit_length_flux(worker_.path, q.pixel, q.value * (sign * inverse_probability * part), target.tau[0]);
    }
    worker_.path.pop();
  });
}

}  // namespace isochron
