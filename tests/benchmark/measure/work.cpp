// How long a unit of Renderer::work takes: isochron_work CSV. Nanoseconds of CPU, by scene and by what paths are found by, and that over
// the median of all. Where work is counted well (kRaysPerArc, kRaysPerSegment) the last column is near one.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "core/base/cpu_time.h"
#include "core/base/parallel.h"
#include "core/render/renderer.h"
#include "tests/benchmark/measure/arguments.h"
#include "tests/render/support.h"

namespace isochron::benchmarks {
namespace {

using namespace testing;

struct Case {
  const char* name;
  const char* file;
  const char* moving;
  GateSet gates;
  int max_bounces;
};

struct Row {
  std::string of;
  double nanoseconds;
};

/// Rows of one scene: images and the terms of a derivative by a shape's motion upwards, by each mix of techniques.
void measure(const Case& c, std::vector<Row>& rows) {
  constexpr double kSeconds = 0.5;
  Scene scene = load_scene(std::string(PROJECT_ROOT "/") + c.file);
  scene.camera.width = scene.camera.height = 32;
  const TangentBasis basis = make_basis(scene, {translate(scene, c.moving, {0, 1, 0})});
  for (const bool connections : {false, true})
    for (const double light : {0.0, 0.5}) {
      EstimatorOptions options{.max_bounces = c.max_bounces, .keep_length = false};
      options.mix = SamplingMix{connections, connections, light, light};
      const auto add = [&](const char* what, auto&& run) {
        const Renderer renderer(scene, c.gates, options, &basis);
        run(renderer, 0u);  // prepares
        const double before = renderer.work(), start = cpu_seconds();
        unsigned pass = 0;
        while (cpu_seconds() < start + kSeconds) run(renderer, ++pass);
        rows.push_back({fmt::format("{},{},{:d},{:g}", c.name, what, connections, light),
                        1e9 * (cpu_seconds() - start) / (renderer.work() - before)});
      };
      add("image", [](const Renderer& r, unsigned pass) { r.render({7, 0, pass}, {0, 8}); });
      add("interior", [](const Renderer& r, unsigned pass) { r.derive(Term::interior, {7, 0, pass}, {0, 8}); });
      if (light == 0)
        add("visibility", [](const Renderer& r, unsigned pass) { r.derive(Term::visibility, {7, 0, pass}, {0, 8}); });
    }
}

std::vector<Case> cases() {
  std::vector<double> centers;
  for (int i = 0; i < 20; ++i) centers.push_back(3 + 0.5 * i);
  return {
      {"corridor", "scenes/corridor/scene.yaml", "corridor", GateSet(GateShape::gaussian(0.4), centers), 16},
      {"box", "tests/data/cornell/scene.yaml", "smallbox", GateSet(GateShape::gaussian(0.05), {8.1}), 4},
      {"cove", "scenes/cove/scene.yaml", "lamp", GateSet(GateShape::gaussian(0.5), {5, 6, 7, 8}), 6},
      {"cube", "scenes/cube/scene.yaml", "cube", GateSet(GateShape::gaussian(0.2), {5.4}), 4},
      {"tree", "scenes/tree/scene.yaml", "lamp", GateSet(GateShape::gaussian(0.1), {6, 7, 8}), 2},
  };
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  using namespace isochron::benchmarks;
  const Arguments arguments = read_arguments(argc, argv, 1, "isochron_work CSV", 0, 0);
  isochron::set_thread_count(1);
  std::vector<Row> rows;
  for (const Case& c : cases()) measure(c, rows);
  std::vector<double> sorted;
  for (const Row& row : rows) sorted.push_back(row.nanoseconds);
  std::ranges::sort(sorted);
  for (std::FILE* out : {arguments.csv.get(), stdout}) {
    std::fprintf(out, "scene,of,connections,light,ns,over median\n");
    for (const Row& row : rows)
      std::fprintf(out, "%s,%.0f,%.2f\n", row.of.c_str(), row.nanoseconds, row.nanoseconds / sorted[sorted.size() / 2]);
  }
}
