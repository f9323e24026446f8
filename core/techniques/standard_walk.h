// The standard estimator: a random walk from the camera side with next-event estimation, combined with BSDF sampling
// by multiple importance sampling (balance heuristic, solid-angle measure).
#pragma once
#include <cmath>
#include <type_traits>
#include <utility>

#include "core/techniques/worker.h"

namespace isochron {

/// Path lengths outside of which a complete path meets no gate.
struct LengthRange {
  double lower, upper;
  bool holds(double length) const { return length >= lower && length <= upper; }
};

/// Extends `path`, whose vertex 0 is the point that light is gathered for and vertex 1 the first surface point, by up to
/// `max_bounces` scattering vertices, a vertex at a time. Visits every complete path whose length is in `reach`: visitor.wants() is
/// asked first, while the path ends on the emitter; then visitor.take(value) gets contribution over density from vertex 1
/// on (seen from vertex 0, without the gate).
template <class Visitor>
class StandardWalk {
 public:
  /// `pixel`: whose light a capture's path ends at. `hidden_share`: the probability, in [0, 1), that a step is drawn by area,
  /// as long as the path has met no area-sampled shape.
  StandardWalk(Worker& worker, Path& path, int pixel, int max_bounces, LengthRange reach, Visitor visitor,
               double hidden_share = 0)
      : worker_(worker),
        path_(path),
        max_bounces_(max_bounces),
        reach_(reach),
        visitor_(std::move(visitor)),
        light_(worker.scene.captures() ? worker.scene.spot_of(pixel) : -1),
        light_is_given_(worker.scene.captures()),
        hidden_share_(hidden_share) {}

  /// At the first surface point, the path's last vertex; next_event_and_sample() continues.
  void begin(Rng& rng) {
    w_o_ = path_.vertex[path_.size() - 2].p - path_.back().p;
    distance_o_ = length(w_o_);
    w_o_ *= 1 / distance_o_;
    if (hidden_share_ > 0 && worker_.scene.hidden.holds(path_.back().triangle)) hidden_share_ = 0;
    if (worker_.scene.emits(path_.back().triangle)) take_emission(1);
    draw_light(rng);
    pick_light();
    bounce_ = 1;
  }
  /// At the camera, with a ray through a random point of `pixel`; intersect() continues.
  void begin_at_camera(int pixel, Rng& rng) {
    worker_.start_at_sensor(path_, pixel);
    const Vec3 direction = worker_.direction_through(pixel, rng);
    draw_light(rng);
    w_o_ = -direction;
    hit_triangle_ = worker_.closest_camera_hit(direction);
    pick_light();
    bounce_ = 0;
  }

  /// Next-event estimation at the last vertex, then a ray by BSDF sampling: prefetches the triangle that it hits. False
  /// where the walk ends.
  bool next_event_and_sample(Rng& rng) {
    const PreparedScene& scene = worker_.scene;
    const SurfacePoint& x = path_.back();
    if (path_.length.back() + scene.distance_to_emitters(x.p) > reach_.upper) return false;
    const double u1 = rng.uniform(), u2 = rng.uniform();
    const SurfacePoint y = scene.point_on_emitter(light_, u1, u2);
    const Scattering s(x, w_o_, distance_o_, y.p);
    const bool goes_on = bounce_ < max_bounces_;
    const double hidden =
        goes_on && !scene.transparent(x.triangle) ? scene.hidden.step(hidden_share_, bounce_ + 1 == max_bounces_) : 0;
    const bool has_extent = !is_light(light_);
    const double cos_y = has_extent ? -dot(y.n, s.w_i) : 1;
    if (cos_y > 0 && reach_.holds(path_.length.back() + s.distance_i * scene.index_between(x, y))) {
      const Bsdf& bsdf = scene.bsdf_of(x.triangle);
      if (const Rgb f = bsdf_value(scene, x, s); !f.is_black()) {
        const double to_area = cos_y / (s.distance_i * s.distance_i);
        const double pdf_walk = has_extent ? step_pdf(bsdf.pdf(s) * to_area, y.triangle, hidden) : 0;
        const bool is_confocal_return = path_.is_confocal_return(y);
        path_.push(scene, y, s.distance_i);
        if (visitor_.wants() && (is_confocal_return || worker_.visible(x, y)))
          visitor_.take(throughput_ * f * scene.emitted(y, -s.w_i) *
                        (std::abs(s.cos_i) * to_area / (scene.emitter_pdf(light_) + pdf_walk)));
        path_.pop();
      }
    }

    // Rays meet no light without an extent.
    if (!goes_on && !scene.emitters.have_extent) return false;
    hidden_ = hidden;
    if (hidden == 1 || (hidden > 0 && rng.uniform() < hidden)) return step_to_hidden(x, rng);
    const auto next = sample_bsdf(scene, x, w_o_, throughput_, rng);
    if (!next) return false;
    pdf_ = next->pdf;
    by_area_ = false;
    if (goes_on) draw_light(rng);
    w_o_ = -next->direction;
    hit_triangle_ = worker_.closest_hit(x, next->direction);
    if (goes_on) pick_light();
    return hit_triangle_ >= 0;
  }
  /// Appends the point that the ray hits to the path. False where the walk ends, for it scatters no more.
  bool intersect(Rng& rng) {
    const PreparedScene& scene = worker_.scene;
    const Vec3& origin = path_.back().p;
    const auto x = scene.end_point(hit_triangle_, origin, -w_o_);
    if (!x) return false;
    distance_o_ = length(x->p - origin);
    if (!(distance_o_ > 0)) return false;  // a camera on a surface sees nothing
    path_.push(scene, *x, distance_o_);
    const bool emits = scene.emits(x->triangle);
    if (emits || hidden_ > 0) {
      const double to_area = std::abs(dot(x->n, w_o_)) / (distance_o_ * distance_o_);
      if (hidden_ > 0 && by_area_ != scene.hidden.takes(x->triangle, hidden_, pdf_ * to_area)) return false;
      const double pdf_walk = step_pdf(pdf_ * to_area, x->triangle, hidden_);
      if (hidden_ > 0) throughput_ *= (by_area_ ? 1 : pdf_) * to_area / pdf_walk;
      if (emits) take_emission(bounce_ == 0 ? 1 : pdf_walk / (pdf_walk + scene.emitter_pdf(x->triangle)));
    }
    if (hidden_share_ > 0 && scene.hidden.holds(x->triangle)) hidden_share_ = 0;
    hidden_ = 0;
    return bounce_++ < max_bounces_ && russian_roulette(throughput_, bounce_ - 1, rng);
  }

  /// Of the last ray; unit.
  Vec3 direction() const { return -w_o_; }

 private:
  /// Density per area of a step's end, which the vertex before sees, with area sampling of probability `hidden`.
  double step_pdf(double pdf_bsdf, int triangle, double hidden) const {
    return hidden == 0 ? pdf_bsdf : worker_.scene.hidden.next_vertex_pdf(triangle, hidden, pdf_bsdf);
  }
  /// Takes the step by area sampling; intersect() continues. False if the walk ends.
  bool step_to_hidden(const SurfacePoint& x, Rng& rng) {
    const PreparedScene& scene = worker_.scene;
    double u0 = rng.fine_uniform();
    const double u1 = rng.uniform();
    const SurfacePoint z = scene.sample_hidden(u0, u1);
    draw_light(rng);
    const Scattering s(x, w_o_, distance_o_, z.p);
    if (!(s.distance_i > 0)) return false;
    if (path_.length.back() + s.distance_i * scene.least_index() + scene.distance_to_emitters(z.p) > reach_.upper)
      return false;
    if (!(dot(z.n, s.w_i) < 0) && !scene.two_sided(z.triangle) && !scene.transparent(z.triangle)) return false;
    const Rgb f = bsdf_value(scene, x, s);
    if (f.is_black() || !worker_.visible(x, z)) return false;
    throughput_ *= f * std::abs(s.cos_i);
    pdf_ = scene.bsdf_of(x.triangle).pdf(s);
    by_area_ = true;
    w_o_ = -s.w_i;
    hit_triangle_ = z.triangle;
    pick_light();
    return true;
  }
  /// Chooses the emitter of the following next-event estimation in two steps, so that memory is read meanwhile: the tables that
  /// choose it are prefetched during a ray, the emitter itself before the next vertex.
  void draw_light(Rng& rng) {
    if (light_is_given_) return;
    light_draw_ = rng.uniform();
    worker_.scene.emitters.prefetch(light_draw_);
  }
  void pick_light() {
    if (!light_is_given_) light_ = worker_.scene.pick_emitter(light_draw_);
  }

  void take_emission(double weight) {
    const SurfacePoint& x = path_.back();
    if (!reach_.holds(path_.length.back()) || !visitor_.wants()) return;
    const Rgb radiance = worker_.scene.emitted(x, w_o_);
    if (!radiance.is_black()) visitor_.take(throughput_ * radiance * weight);
  }

  Worker& worker_;
  Path& path_;
  const int max_bounces_;
  const LengthRange reach_;
  Visitor visitor_;
  Rgb throughput_{1.0};
  int bounce_ = 0;  ///< scattering vertices, with the last one
  Vec3 w_o_;        ///< unit, back along the last ray
  double distance_o_ = 0;
  double light_draw_ = 0;
  int light_;  ///< the emitter of the following next-event estimation
  const bool light_is_given_;
  int hit_triangle_ = -1;  ///< of the last ray; -1: none
  double pdf_ = 0;         ///< of the last ray's direction by BSDF sampling, per solid angle
  double hidden_share_;    ///< of the next steps
  double hidden_ = 0;      ///< of the last step
  bool by_area_ = false;   ///< the last step was taken by area sampling
};

/// A whole walk. Leaves the path as it was.
template <class Visitor>
void walk_standard(Worker& worker, Path& path, int pixel, int max_bounces, LengthRange reach, Rng& rng,
                   Visitor&& visitor, double hidden_share = 0) {
  const int base = path.size();
  StandardWalk<std::remove_cvref_t<Visitor>> walk(worker, path, pixel, max_bounces, reach,
                                                  std::forward<Visitor>(visitor), hidden_share);
  walk.begin(rng);
  for (bool goes_on = max_bounces > 0; goes_on;) goes_on = walk.next_event_and_sample(rng) && walk.intersect(rng);
  while (path.size() > base) path.pop();
}

}  // namespace isochron
