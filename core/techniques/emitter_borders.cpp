#include "core/techniques/emitter_borders.h"

#include <cmath>

#include "core/base/quadratic.h"
#include "core/base/systematic_sampling.h"
#include "core/paths/length_flow.h"

namespace isochron {
namespace {

/// Crossings of one circle whose visibility is tested at most: about as many as a circle has with a rectangle.
constexpr int kTested = 4;

}  // namespace

void EmitterBorders::sample(double tau, int pixel, const Rgb& throughput, Rng& rng) {
  const double pick = rng.uniform(), thinning = rng.uniform();
  const SurfacePoint q = worker_.path.back();
  const double radius = tau - worker_.path.length.back();
  if (!(radius > 0)) return;
  std::vector<int>& candidates = worker_.candidates;
  std::vector<double>& inverse_probability = worker_.inverse_probability;
  candidates.clear();
  inverse_probability.clear();
  const EllipsoidBvh::Focus anywhere{q.p, {0, 0, 0}, 0, 1, false};
  scene_.hierarchy(PreparedScene::Part::emitting)
      .sample_surfaces(anywhere, anywhere, 2 * radius, 2 * radius, thinning, candidates, inverse_probability);
  worker_.counts.arcs += 1 + candidates.size();
  crossings_.clear();
  for (std::size_t i = 0; i < candidates.size(); ++i) cross(candidates[i], radius, inverse_probability[i], throughput);
  const int count = static_cast<int>(crossings_.size());
  if (count > kTested) crossings_.resize(sample_systematically(crossings_.data(), count, kTested, pick));
  for (const Crossing& crossing : crossings_) {
    if (!worker_.visible(q, crossing.point.y)) continue;
    worker_.path.push(scene_, crossing.point.y);
    if (worker_.contributes(worker_.path)) {
      const Point& at = crossing.point;
      const double part = worker_.balance.border(worker_.path, pixel, tau, at.tangent, at.pdf, {});
      worker_.emit_length_flux(worker_.path, pixel, crossing.value * (crossing.inverse_probability * part), tau);
    }
    worker_.path.pop();
  }
}

double EmitterBorders::border_length(int triangle) const {
  const auto corners = scene_.corners(triangle);
  double sum = 0;
  for (int i = 0; i < 3; ++i)
    if (scene_.is_emitter_border(triangle, i)) sum += length(corners[(i + 1) % 3] - corners[i]);
  return sum;
}

std::optional<EmitterBorders::Point> EmitterBorders::pick(double u_emitter, double u_border) const {
  const int t = scene_.pick_emitter(u_emitter);
  const auto corners = scene_.corners(t);
  const double whole = border_length(t);
  double at = u_border * whole;
  for (int i = 0; i < 3; ++i) {
    if (!scene_.is_emitter_border(t, i)) continue;
    const Vec3 along = corners[(i + 1) % 3] - corners[i];
    const double edge = length(along);
    if (at < edge)
      return Point{{corners[i] + along * (at / edge), scene_.normal(t), t},
                   along / edge,
                   scene_.emitter_pdf(t) * scene_.area(t) / whole};
    at -= edge;
  }
  return std::nullopt;
}

double EmitterBorders::outwards(const SurfacePoint& q, const Point& border) const {
  return dot(LengthFlow(q, border.y).x, isochron::cross(border.tangent, border.y.n));
}

void EmitterBorders::cross(int triangle, double radius, double inverse_probability, const Rgb& throughput) {
  const Path& path = worker_.path;
  const SurfacePoint& q = path.back();
  const Vec3& n = scene_.normal(triangle);
  const auto corners = scene_.corners(triangle);
  const double border_pdf = scene_.emitter_pdf(triangle) * scene_.area(triangle) / border_length(triangle);
  for (int i = 0; i < 3; ++i) {
    if (!scene_.is_emitter_border(triangle, i)) continue;
    const Vec3 a = corners[i] - q.p, along = corners[(i + 1) % 3] - corners[i];
    // |a + s along| = radius
    const double c2 = length_squared(along), c1 = dot(a, along), c0 = length_squared(a) - radius * radius;
    const auto roots = quadratic_roots(c2, c1, c0);
    if (!roots) continue;
    for (const double s : *roots) {
      if (!(s > 0 && s < 1)) continue;
      const Vec3 tangent = along / std::sqrt(c2);
      const Point point{{corners[i] + along * s, n, triangle}, tangent, border_pdf};
      const SurfacePoint& y = point.y;
      if (!scene_.outside(q, y)) continue;
      const Scattering at_q(path.vertex[path.size() - 2].p, q, y.p);
      const double cos_y = -dot(n, at_q.w_i);
      if (!(cos_y > 0)) continue;
      const Rgb f = bsdf_value(scene_, q, at_q) * scene_.emitted(y, -at_q.w_i);
      if (f.is_black()) continue;
      // By the rate of the length along the border.
      const double value =
          outwards(q, point) * std::abs(at_q.cos_i) * cos_y / (radius * radius * std::abs(dot(at_q.w_i, tangent)));
      if (!(std::isfinite(value) && value != 0)) continue;
      const Rgb carried = throughput * f;
      crossings_.push_back(
          {point, carried * value, carried.max() * std::abs(value) * inverse_probability, inverse_probability});
    }
  }
}

}  // namespace isochron
