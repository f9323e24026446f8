#include "core/techniques/standard_paths.h"

namespace isochron {
namespace {

/// Scenes of more triangles are larger than the caches: their records take a megabyte.
constexpr std::size_t kCachedTriangles = 1 << 13;

}  // namespace

StandardPaths::StandardPaths(Worker& worker)
    : worker_(worker),
      large_(worker.scene.scene.triangles.size() > kCachedTriangles),
      slots_{Slot(worker), Slot(worker)} {}

void StandardPaths::start(int pixel, double scale, Rng& rng) {
  if (worker_.scene.captures()) {
    slots_[0].run_at_wall(pixel, scale, rng);
    return;
  }
  if (!large_) {
    slots_[0].run(pixel, scale, rng);
    return;
  }
  for (; slots_[next_slot_].active(); next_slot_ ^= 1) slots_[next_slot_].advance();
  slots_[next_slot_].start(pixel, scale, rng);
  next_slot_ ^= 1;
}

void StandardPaths::finish() {
  for (Slot& slot : slots_)
    while (slot.active()) slot.advance();
}

/// In one piece, so that the path's state stays in registers: a twentieth of the time.
[[gnu::flatten]] void StandardPaths::Slot::run(int pixel, double scale, Rng& rng) {
  Walk walk = begin(pixel, scale, rng);
  while (walk.intersect(rng) && walk.next_event_and_sample(rng)) {
  }
}

void StandardPaths::Slot::run_at_wall(int pixel, double scale, Rng& rng) {
  pixel_ = pixel;
  scale_ = scale * worker_.start_path(pixel, rng, worker_.area_steps.standard_first);
  if (scale_ == 0) return;
  std::swap(path_, worker_.path);
  walk_standard(worker_, path_, pixel, worker_.options.max_bounces, {worker_.gates.lower(), worker_.gates.upper()}, rng,
                Visitor{*this}, worker_.area_steps.later);
}

void StandardPaths::Slot::start(int pixel, double scale, const Rng& rng) {
  rng_ = rng;
  walk_.emplace(begin(pixel, scale, rng_));
}

void StandardPaths::Slot::advance() {
  if (!walk_->intersect(rng_) || !walk_->next_event_and_sample(rng_)) walk_.reset();
}

StandardPaths::Slot::Walk StandardPaths::Slot::begin(int pixel, double scale, Rng& rng) {
  pixel_ = pixel;
  scale_ = scale;
  Walk walk(worker_, path_, pixel, worker_.options.max_bounces, {worker_.gates.lower(), worker_.gates.upper()},
            Visitor{*this}, worker_.area_steps.later);
  walk.begin_at_camera(pixel, rng);
  return walk;
}

void StandardPaths::Slot::emit(const Rgb& value) {
  worker_.emit(path_, pixel_, value * (scale_ * worker_.balance.standard(path_, pixel_)), path_.length.back(),
               GateUse::value_and_slope);
}

}  // namespace isochron
