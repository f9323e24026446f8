#include "core/paths/options.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace isochron {

const char* name(Term term) {
  constexpr const char* kNames[] = {"interior", "visibility", "path_length"};
  return kNames[static_cast<std::size_t>(term)];
}

namespace {

/// Root of the area of the smallest emitter; infinite where there is none.
double emitter_size(const Scene& scene) {
  double least = std::numeric_limits<double>::infinity();
  for (const Shape& shape : scene.shapes) {
    if (!shape.emission.emits()) continue;
    double area = 0;
    for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
      const auto& v = scene.triangles[t].vertex;
      const Vec3 &a = scene.positions[v[0]], &b = scene.positions[v[1]], &c = scene.positions[v[2]];
      area += 0.5 * length(cross(b - a, c - a));
    }
    if (area > 0) least = std::min(least, std::sqrt(area));
  }
  return least;
}

}  // namespace

bool may_keep_length(const Scene& scene) {
  const auto is_glass = [&](const Shape& shape) { return scene.materials[shape.material].bsdf().transparent(); };
  return !scene.capture && scene.lights.empty() && std::ranges::none_of(scene.shapes, is_glass) &&
         std::isfinite(emitter_size(scene));
}

SamplingMix sampling_mix(const EstimatorOptions& options, const GateSet& gates, const Scene& scene) {
  // Gates that together cover less than this part of the path length: standard sampling throws too many paths away.
  constexpr double kNarrow = 0.02;
  // Gates so narrow, over the size of the smallest emitter, that coupled pairs are noisier than paths that keep their lengths: the two are
  // equal at 3 % on the cube, at 1 % in the reference box (isochron_gate_width). An emitter that a gate sees as a point has no room
  // for points to move.
  constexpr double kSteep = 0.02;
  const bool draws_lengths = !gates.shape().is_unbounded() && options.sampling != Sampling::standard;
  const bool chooses = options.sampling == Sampling::automatic && !gates.shape().is_dirac();
  SamplingMix mix;
  if (chooses && options.mix && !scene.capture)
    mix = *options.mix;
  else if (draws_lengths)  // area sampling serves all gates of a capture at once
    mix.image_connections = mix.interior_connections =
        !chooses || (!scene.capture && gates.relative_coverage() < kNarrow);
  if (!draws_lengths) mix.image_connections = mix.interior_connections = false;
  const bool possible = draws_lengths && may_keep_length(scene);
  if (possible && options.keep_length == true) mix.interior_connections = true;
  mix.keep_length = mix.interior_connections && possible &&
                    options.keep_length.value_or(gates.shape().width() < kSteep * emitter_size(scene));
  if (options.light && !scene.capture) mix.image_light = mix.interior_light = *options.light;
  if (options.max_bounces == 0) mix.image_light = mix.interior_light = 0;
  return mix;
}

}  // namespace isochron
