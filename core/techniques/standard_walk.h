// The standard estimator: a random walk from the camera side with next-event estimation, combined with BSDF sampling
// by multiple importance sampling (balance heuristic, solid-angle measure).
#pragma once
#include <array>
#include <optional>
#include <type_traits>
#include <utility>

#include "core/techniques/worker.h"

namespace isochron {

/// Path lengths outside of which a complete path meets no gate.
struct LengthRange {
  double lower, upper;
  bool holds(double length) const { return length >= lower && length <= upper; }
};

/// Extends `path`, whose vertex 0 is what looks and vertex 1 the first surface point, by up to `max_bounces`
/// scattering vertices, a vertex at a time. Visits every complete path whose length is in `reach`: visitor.wants() is
/// asked first, while the path ends on the emitter; then visitor.take(value) gets contribution over density from vertex 1
/// on (seen from vertex 0, without the gate).
template <class W, class Visitor>
class StandardWalk {
 public:
  StandardWalk(W& worker, Path& path, int max_bounces, LengthRange reach, Visitor visitor)
      : worker_(worker), path_(path), max_bounces_(max_bounces), reach_(reach), visitor_(std::move(visitor)) {}

  /// At the first surface point, the path's last vertex; scatter() goes on.
  void begin(Rng& rng) {
    w_o_ = path_.vertex[path_.size() - 2].p - path_.back().p;
    distance_o_ = length(w_o_);
    w_o_ *= 1 / distance_o_;
    if (worker_.scene.emits(path_.back().triangle)) see_emission(1);
    draw_light(rng);
    pick_light();
    bounce_ = 1;
  }
  /// At the camera, with a ray through a random point of `pixel`; arrive() goes on.
  void begin_at_camera(int pixel, Rng& rng) {
    worker_.start_at_camera(path_);
    const Vec3 direction = worker_.direction_through(pixel, rng);
    draw_light(rng);
    w_o_ = -direction;
    met_ = worker_.cast_camera(direction);
    pick_light();
    bounce_ = 0;
  }

  /// Next-event estimation at the last vertex, then a ray by BSDF sampling, which starts to bring the triangle that it meets
  /// from memory. False where the walk ends.
  bool scatter(Rng& rng) {
    const PreparedScene& scene = worker_.scene;
    const SurfacePoint& x = path_.back();
    if (path_.length.back() + scene.distance_to_emitters(x.p) > reach_.upper) return false;
    const Material& material = scene.material_of(x.triangle);

    const double u1 = rng.uniform(), u2 = rng.uniform();
    const SurfacePoint y = scene.point_on_emitter(light_, u1, u2);
    const Scattering s(x, w_o_, distance_o_, y.p);
    const double scattered = s.lobe(material) * std::abs(s.cos_i);
    const double cos_y = -dot(y.n, s.w_i);
    if (scattered > 0 && cos_y > 0 && reach_.holds(path_.length.back() + s.distance_i * scene.index_between(x, y))) {
      const double to_area = cos_y / (s.distance_i * s.distance_i);
      const double pdf_bsdf = s.pdf_towards_light(material) * to_area;
      path_.push(scene, y, s.distance_i);
      if (visitor_.wants() && worker_.visible(x, y))
        visitor_.take(throughput_ * material.albedo * scene.shape_of(y.triangle).emission *
                      (scattered * to_area / (scene.emitter_pdf(light_) + pdf_bsdf)));
      path_.pop();
    }

    const auto next = turn(scene, x, w_o_, throughput_, rng);
    if (!next) return false;
    pdf_ = next->pdf;
    const bool goes_on = bounce_ < max_bounces_;
    if (goes_on) draw_light(rng);
    w_o_ = -next->direction;
    met_ = worker_.cast(x, next->direction);
    if (goes_on) pick_light();
    return met_ >= 0;
  }
  /// Puts the end of the ray on the path. False where the walk ends, for it scatters no more.
  bool arrive(Rng& rng) {
    const PreparedScene& scene = worker_.scene;
    const Vec3& origin = path_.back().p;
    const auto x = scene.end_point(met_, origin, -w_o_);
    if (!x) return false;
    distance_o_ = length(x->p - origin);
    if (!(distance_o_ > 0)) return false;  // a camera on a surface sees nothing
    path_.push(scene, *x, distance_o_);
    if (scene.emits(x->triangle)) {
      const double pdf_bsdf = pdf_ * std::abs(dot(x->n, w_o_)) / (distance_o_ * distance_o_);
      see_emission(bounce_ == 0 ? 1 : pdf_bsdf / (pdf_bsdf + scene.emitter_pdf(x->triangle)));
    }
    return bounce_++ < max_bounces_ && survives(throughput_, bounce_ - 1, rng);
  }

 private:
  /// The emitter of the next estimation, in two steps: the tables that tell it come from memory during a ray, the
  /// emitter itself before the next vertex.
  void draw_light(Rng& rng) {
    light_draw_ = rng.uniform();
    worker_.scene.expect_emitter(light_draw_);
  }
  void pick_light() { light_ = worker_.scene.pick_emitter(light_draw_); }

  void see_emission(double weight) {
    const SurfacePoint& x = path_.back();
    if (!reach_.holds(path_.length.back()) || !visitor_.wants()) return;
    const Rgb radiance = worker_.scene.emitted(x, w_o_);
    if (!radiance.is_black()) visitor_.take(throughput_ * radiance * weight);
  }

  W& worker_;
  Path& path_;
  const int max_bounces_;
  const LengthRange reach_;
  Visitor visitor_;
  Rgb throughput_{1.0};
  int bounce_ = 0;  ///< scattering vertices, with the last one
  Vec3 w_o_;        ///< unit, back along the last ray
  double distance_o_ = 0;
  double light_draw_ = 0;
  int light_ = -1;  ///< the emitter of the next estimation
  int met_ = -1;    ///< triangle that the last ray leads to
  double pdf_ = 0;  ///< of the last ray's direction, per solid angle
};

/// A whole walk. Leaves the path as it was.
template <class W, class Visitor>
void walk_standard(W& worker, Path& path, int max_bounces, LengthRange reach, Rng& rng, Visitor&& visitor) {
  const int base = path.size();
  StandardWalk<W, std::remove_cvref_t<Visitor>> walk(worker, path, max_bounces, reach, std::forward<Visitor>(visitor));
  walk.begin(rng);
  for (bool goes_on = max_bounces > 0; goes_on;) goes_on = walk.scatter(rng) && walk.arrive(rng);
  while (path.size() > base) path.pop();
}

/// Camera paths by standard sampling. In a scene too large for the caches two are under way at a time and take turns: while
/// one's next triangle comes from main memory, the other goes on.
template <class Sink>
class StandardPaths {
 public:
  /// `pairs`: the slope of the gate is shared with ellipsoidal connections in coupled pairs.
  StandardPaths(Worker<Sink>& worker, bool pairs)
      : large_(worker.scene.scene.triangles.size() > kCachedTriangles),
        slots_{Slot(worker, pairs), Slot(worker, pairs)} {}

  /// Starts a path through `pixel`; contributions are scaled by `scale`. It ends during later calls, of finish() at the
  /// latest.
  void start(int pixel, double scale, Rng& rng) {
    if (!large_) {
      slots_[0].run(pixel, scale, rng);
      return;
    }
    for (; slots_[turn_].active(); turn_ ^= 1) slots_[turn_].advance();
    slots_[turn_].start(pixel, scale, rng);
    turn_ ^= 1;
  }
  void finish() {
    for (Slot& slot : slots_)
      while (slot.active()) slot.advance();
  }

 private:
  static constexpr std::size_t kCachedTriangles = 1 << 13;  ///< records of a megabyte

  class Slot {
   public:
    Slot(Worker<Sink>& worker, bool pairs) : worker_(worker), path_(worker.options.max_bounces), pairs_(pairs) {}
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;

    /// A path from its start to its end. In one piece, so that its state stays in registers: a twentieth of the time.
    [[gnu::flatten]] void run(int pixel, double scale, Rng& rng) {
      Walk walk = begin(pixel, scale, rng);
      while (walk.arrive(rng) && walk.scatter(rng)) {
      }
    }
    bool active() const { return walk_.has_value(); }
    void start(int pixel, double scale, const Rng& rng) {
      rng_ = rng;
      walk_.emplace(begin(pixel, scale, rng_));
    }
    void advance() {
      if (!walk_->arrive(rng_) || !walk_->scatter(rng_)) walk_.reset();
    }

   private:
    struct Visitor {
      Slot& slot;
      bool wants() const { return slot.worker_.matters(slot.path_); }
      void take(const Rgb& value) const { slot.emit(value); }
    };
    using Walk = StandardWalk<Worker<Sink>, Visitor>;

    Walk begin(int pixel, double scale, Rng& rng) {
      pixel_ = pixel;
      scale_ = scale;
      Walk walk(worker_, path_, worker_.options.max_bounces, {worker_.gates.lower(), worker_.gates.upper()},
                Visitor{*this});
      walk.begin_at_camera(pixel, rng);
      return walk;
    }
    void emit(const Rgb& value) {
      GateWeights weights;
      if (const double share = worker_.ellipsoidal_share; share > 0) {
        // This technique's share in the balance heuristic, over the share of the samples.
        const auto weight = [&](double gain) {
          return (1 - worker_.techniques.ellipsoidal_weight(path_, pixel_, share, gain)) / (1 - share);
        };
        weights.value = weight(1);
        weights.slope = pairs_ ? weight(worker_.pair_gain) : weights.value;
      }
      worker_.emit(path_, pixel_, value * scale_, path_.length.back(), weights);
    }

    Worker<Sink>& worker_;
    Path path_;
    const bool pairs_;
    int pixel_ = -1;
    double scale_ = 0;
    Rng rng_{Stream{}, 0, 0};
    std::optional<Walk> walk_;
  };

  const bool large_;
  std::array<Slot, 2> slots_;
  int turn_ = 0;
};

}  // namespace isochron
