// What the trial of automatic sampling chooses, and what that costs: isochron_technique_trial CSV [SEEDS]. Variance x CPU seconds over
// the mean square of standard sampling and of ellipsoidal connections, without light subpaths and with them; how often of so many
// trials connections and light subpaths were chosen, and the trials' mean cost over that of the best. Images, and the interior term of a
// derivative in pixels and in sums over blocks of pixels.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "core/base/parallel.h"
#include "core/render/measure_mix.h"
#include "tests/benchmark/measure/arguments.h"
#include "tests/benchmark/measure/relative_cost.h"
#include "tests/render/support.h"

namespace isochron::benchmarks {
namespace {

using namespace testing;

constexpr int kTrials = 8, kSamples = 64;

struct Case {
  std::string name;
  Scene scene;
  const char* moving;
  GateSet gates;
  int max_bounces;
};
enum class Of { image, pixels, sums };

void measure(const Case& c, Of of, int seeds, std::FILE* csv) {
  const TangentBasis basis = make_basis(c.scene, {translate(c.scene, c.moving, {0, 1, 0})});
  const Purpose purpose = of == Of::sums ? Purpose::gradients : Purpose::images;
  const bool image = of == Of::image;
  const EstimatorOptions plain{.max_bounces = c.max_bounces, .keep_length = false};
  std::vector<EstimatorOptions> options;
  for (const bool connections : {false, true})
    for (const double light : {0.0, 0.5}) {
      options.push_back(plain);
      options.back().mix = SamplingMix{connections, connections, light, light};
    }
  const SampleRange range{0, kSamples};
  const std::vector<double> costs =
      relative_costs(c.scene, c.gates, options, basis, seeds, [&](const Renderer& renderer, const Stream& stream) {
        if (image) return renderer.render(stream, range);
        GatedImage derivative = renderer.derive(Term::interior, stream, range)[0];
        return of == Of::pixels ? derivative : blocks(derivative, derivative.width / 4);
      });
  int by_connections = 0, with_light = 0;
  double mean = 0;
  for (int seed = 0; seed < kTrials; ++seed) {
    constexpr double kJob = 16 * kSamples;
    const SamplingMix mix = measure_mix(c.scene, c.gates, plain, image ? nullptr : &basis, {1u * seed, 7, 0}, purpose,
                                        image ? Job{kJob, 0} : Job{0, kJob, 0, 0});
    const bool connections = image ? mix.image_connections : mix.interior_connections;
    const bool light = (image ? mix.image_light : mix.interior_light) > 0;
    by_connections += connections;
    with_light += light;
    mean += costs[2 * connections + light] / kTrials;
  }
  for (std::FILE* out : {csv, stdout}) {
    std::fprintf(out, "%s,%s", c.name.c_str(), image ? "image" : of == Of::pixels ? "derivative" : "sums");
    std::fprintf(out, ",%d,%d,%.3g", by_connections, with_light, mean / *std::ranges::min_element(costs));
    write_costs(costs, out);
  }
}

std::vector<Case> cases() {
  std::vector<Case> result;
  const auto add = [&](const std::string& name, const char* file, const char* moving, GateShape shape, double center,
                       int bounces) {
    Scene scene = load_scene(std::string(PROJECT_ROOT "/") + file);
    scene.camera.height = scene.camera.height * 64 / scene.camera.width;
    scene.camera.width = 64;
    result.push_back({name, scene, moving, GateSet(shape, {center}), bounces});
  };
  for (const double width : {0.1, 0.05, 0.02, 0.01, 0.005})
    add(fmt::format("cube {:g}", width), "scenes/cube/scene.yaml", "cube", GateShape::gaussian(width * 5.4), 5.4, 4);
  for (const double width : {0.5, 0.2, 0.05, 0.02})
    add(fmt::format("box {:g}", width), "tests/data/cornell/scene.yaml", "smallbox", GateShape::boxcar(width),
        8 + width / 2, 4);
  for (const double width : {0.5, 0.1})
    add(fmt::format("validation {:g}", width), "tests/data/validation/scene.yaml", "block",
        GateShape::gaussian(width / std::sqrt(12)), 5.5, 3);
  return result;
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  using namespace isochron::benchmarks;
  const Arguments arguments = read_arguments(argc, argv, 1, "isochron_technique_trial CSV [SEEDS]", 16, 2);
  isochron::set_thread_count(1);
  for (std::FILE* out : {arguments.csv.get(), stdout})
    std::fprintf(
        out,
        "scene,of,trials for connections,trials for light,cost of trials,standard,standard with light,connections,"
        "connections with light\n");
  for (const Case& c : cases())
    for (const Of of : {Of::image, Of::pixels, Of::sums}) measure(c, of, arguments.number, arguments.csv.get());
}
