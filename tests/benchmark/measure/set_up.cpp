// What it costs to make a scene of 70 000 triangles ready for an evaluation, beside the evaluation with 4 samples per pixel:
// isochron_set_up CSV [ROUNDS]. Wall times of all cores, medians; set-up includes the edges of the visibility term.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include "core/base/large_blocks.h"
#include "core/render/renderer.h"
#include "core/render/scene_cache.h"
#include "tests/benchmark/measure/arguments.h"
#include "tests/benchmark/scenes.h"

namespace isochron::benchmarks {
namespace {

double median_ms(int rounds, const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < rounds; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

struct Case {
  const char* name;
  bool lamp, deforms;
};

void measure(const Case& c, int size, bool kept, int rounds, std::FILE* csv) {
  Scene scene = large_scene();
  scene.camera.width = scene.camera.height = size;
  const int shape = static_cast<int>(c.lamp ? std::find_if(scene.shapes.begin(), scene.shapes.end(),
                                                           [](const Shape& s) { return s.emission.emits(); }) -
                                                  scene.shapes.begin()
                                            : static_cast<std::ptrdiff_t>(scene.shapes.size()) - 1);
  const TangentBasis basis = c.deforms ? all_vertices(scene) : translation(scene, scene.shapes[shape]);
  const GateSet gates = wide_gates();
  const EstimatorOptions options{.max_bounces = 4, .sampling = Sampling::standard};
  SceneCache cache(scene, CasterUpdate::refit);
  Scene moved = scene;
  moved.shapes[shape].deforms = c.deforms;
  const auto move = [&] {
    for (int v = 0; v < scene.shapes[shape].vertex_count; ++v)
      moved.positions[scene.shapes[shape].first_vertex + v].x += 1e-4;
  };
  std::vector<double> gradient(DofLayout(scene).size());
  GatedImage adjoint(size, size, gates.size(), 1);
  std::fill(adjoint.data.begin(), adjoint.data.end(), 1.0);
  const auto set_up = [&] {
    move();
    const Renderer renderer(moved, gates, options, &basis, kept ? &cache : nullptr);
    renderer.add_gradient(Term::visibility, adjoint, {.seed = 1}, {0, 0}, gradient);
  };
  set_up();
  const double ready = median_ms(rounds, set_up);
  const Renderer renderer(moved, gates, options, &basis, kept ? &cache : nullptr);
  const SampleRange samples{0, 4};
  const double image = median_ms(rounds, [&] { renderer.render({.seed = 1}, samples); });
  const auto term = [&](Term t) {
    renderer.add_gradient(t, adjoint, {.seed = 1, .pass = 1}, samples, gradient);
    return median_ms(rounds, [&] { renderer.add_gradient(t, adjoint, {.seed = 1, .pass = 1}, samples, gradient); });
  };
  const double interior = term(Term::interior), visibility = term(Term::visibility);
  for (std::FILE* out : {csv, stdout})
    std::fprintf(out, "%s,%d,%s,%.3g,%.3g,%.3g,%.3g,%.3g\n", c.name, size, kept ? "kept" : "fresh", ready, image,
                 interior, visibility, ready / (image + interior + visibility));
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  using namespace isochron::benchmarks;
  const Arguments arguments = read_arguments(argc, argv, 1, "isochron_set_up CSV [ROUNDS]", 15, 1);
  isochron::keep_freed_memory();
  std::fprintf(arguments.csv.get(), "moves,pixels,scene,set_up_ms,image_ms,interior_ms,visibility_ms,fraction\n");
  for (const Case& c : {Case{"lamp", true, false}, {"ball", false, false}, {"every vertex of the ball", false, true}})
    for (const int size : {32, 128})
      for (const bool kept : {false, true}) measure(c, size, kept, arguments.number, arguments.csv.get());
}
