// How ellipsoidal connections choose arcs and put points on them, for all that connect.
#pragma once
#include <algorithm>
#include <cmath>

#include "core/base/systematic_sampling.h"
#include "core/techniques/ellipsoidal.h"

namespace isochron {

template <class F>
std::span<const EllipsoidalConnections::Choice> EllipsoidalConnections::choose(double pick, int rays, F&& sample) {
  const std::vector<int>& candidates = worker_.candidates;
  const int count = static_cast<int>(candidates.size());
  arcs_.clear();
  choices_.clear();
  const auto evaluate = [&](int candidate, double inverse_probability) {
    ArcPair& arcs = arcs_.emplace_back();
    sample(candidates[candidate], arcs);
    if (const double weight = arcs.weight(); weight > 0)
      choices_.push_back({static_cast<int>(arcs_.size()) - 1, weight * inverse_probability, inverse_probability});
    else
      arcs_.pop_back();
  };
  if (worker_.options.pick == ArcPick::uniform) {
    if (count > 0) evaluate(std::min(static_cast<int>(pick * count), count - 1), count);
    return choices_;
  }
  for (int i = 0; i < count; ++i) evaluate(i, worker_.inverse_probability[i]);
  // To hand on what is found takes about as long as its rays (profile of the sofa's path_length term).
  const int tested = std::max(1, static_cast<int>(count * kRaysPerArc / (2 * rays)));
  const int carrying = static_cast<int>(choices_.size());
  if (carrying > tested) choices_.resize(sample_systematically(choices_.data(), carrying, tested, pick));
  return choices_;
}

template <class F>
void EllipsoidalConnections::for_each_seen(std::span<const Choice> choices, F&& f) {
  const SurfacePoint x = worker_.path.back();
  for (const Choice& choice : choices)
    for (int i = 0; i < 2; ++i) {
      const ArcPoint& q = arcs_[choice.arc].side[i];
      if (q.value.is_black() || !worker_.visible(x, q.point)) continue;
      worker_.path.push(scene_, q.point);
      f(i, q, choice.inverse_probability);
      worker_.path.pop();
    }
}

template <class End, class Leaving>
void EllipsoidalConnections::surface_arc_point(const Ellipsoid& ellipsoid, const FocalTriangle& triangle, int t,
                                               End&& end, Leaving&& leaving, double along, int pixel, const Rgb& factor,
                                               ArcPoint& out) const {
  EllipseArcs arcs;
  if (!clip_ellipse(ellipsoid, triangle, arcs)) return;
  const SurfacePoint q{arcs.point_at(along), scene_.normal(t), t};
  const Path& path = worker_.path;
  const SurfacePoint& x = path.back();
  if (!scene_.outside(x, q)) return;
  const SurfacePoint y = end(q);
  const Scattering s(x.p, q, y.p);
  const Rgb light = leaving(y, -s.w_i);
  if (light.is_black()) return;
  const double distances = s.distance_i * s.distance_o;
  double carried = std::abs(s.cos_i * s.cos_o) / (distances * distances);
  Rgb f = bsdf_value(scene_, q, s);
  out.pixel = pixel;
  if (path.size() == 1) {
    if (!scene_.captures()) out.pixel = scene_.camera.project(q.p);
    if (out.pixel < 0) return;
    carried *= scene_.importance(out.pixel, -s.w_o);
  } else {
    const Directions at_x = scattering_to(-s.w_o);
    carried *= std::abs(at_x.cos_i);
    f *= bsdf_value(scene_, x, at_x);
  }
  if (!(carried > 0) || f.is_black()) return;
  const double to_focus = length(ellipsoid.b - q.p);
  const double area = arcs.total_span * area_per_angle_and_length(ellipsoid, s.distance_o, to_focus, q.n);
  out.pdf = 1 / area;
  out.value = factor * light * f * (carried * area);
  out.point = q;
}

}  // namespace isochron
