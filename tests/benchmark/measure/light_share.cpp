// What light subpaths bring: isochron_light_share CSV [SEEDS]. Variance x CPU seconds over the mean square, summed over pixels and
// gates, of images and of a derivative, by shares of samples with light subpaths, and by the
// share that is measured by default (its trial not counted). Lower is better.
#include <fmt/format.h>

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

constexpr double kShares[] = {0, 0.2, 0.35, 0.5, 0.65, 0.8};

struct Case {
  std::string name;
  Scene scene;
  const char* moving;
  GateSet gates;
  int max_bounces, samples;
};

void measure(const Case& c, bool derivative, int seeds, std::FILE* csv) {
  const TangentBasis basis = make_basis(c.scene, {translate(c.scene, c.moving, {0, 1, 0})});
  std::vector<EstimatorOptions> options;
  for (const double share : kShares) options.push_back({.max_bounces = c.max_bounces, .light = share});
  options.push_back({.max_bounces = c.max_bounces});
  for (EstimatorOptions& o : options)
    o.mix = measure_mix(c.scene, c.gates, o, &basis, {2, 0, 0}, Purpose::images,
                        {double(seeds * c.samples), double(seeds * c.samples)});
  const SamplingMix& chosen = *options.back().mix;
  const SampleRange range{0, c.samples};
  const std::vector<double> costs =
      relative_costs(c.scene, c.gates, options, basis, seeds, [&](const Renderer& renderer, const Stream& stream) {
        if (!derivative) return renderer.render(stream, range);
        GatedImage sum = renderer.derive(Term::interior, stream, range)[0];
        for (const Term term : {Term::visibility, Term::path_length}) {
          if (!renderer.has(term)) continue;
          const Stream own{stream.seed, stream.iteration, stream.pass + static_cast<std::uint32_t>(term)};
          const GatedImage part = renderer.derive(term, own, range)[0];
          for (std::size_t i = 0; i < sum.data.size(); ++i) sum.data[i] += part.data[i];
        }
        return sum;
      });
  for (std::FILE* out : {csv, stdout}) {
    std::fprintf(out, "%s,%s,%d,%g", c.name.c_str(), derivative ? "derivative" : "image",
                 derivative ? chosen.interior_connections : chosen.image_connections,
                 derivative ? chosen.interior_light : chosen.image_light);
    write_costs(costs, out);
  }
}

std::vector<Case> cases() {
  std::vector<Case> result;
  const Scene cove = load_scene(PROJECT_ROOT "/scenes/cove/scene.yaml");
  result.push_back({"cove", cove, "lamp", GateSet(GateShape::boxcar(0.75), {5.0, 5.75, 6.5, 7.25, 8.0, 8.75}), 6, 64});
  result.push_back({"cove steady", cove, "lamp", GateSet(GateShape::steady(), {0}), 6, 64});
  const Scene box = load_scene(PROJECT_ROOT "/tests/data/cornell/scene.yaml");
  const auto add = [&](const std::string& name, const GateSet& gates) {
    result.push_back({name, box, "smallbox", gates, 4, 64});
  };
  add("box steady", GateSet(GateShape::steady(), {0}));
  for (const double width : {0.5, 0.2, 0.1, 0.02, 0.005})
    add(fmt::format("box {:g}", width), GateSet(GateShape::boxcar(width), {8 + width / 2}));
  return result;
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  using namespace isochron::benchmarks;
  const Arguments arguments = read_arguments(argc, argv, 1, "isochron_light_share CSV [SEEDS]", 16, 2);
  isochron::set_thread_count(1);
  for (std::FILE* out : {arguments.csv.get(), stdout}) {
    std::fprintf(out, "scene,of,share of connections,measured share");
    for (const double share : kShares) std::fprintf(out, ",%g", share);
    std::fprintf(out, ",default\n");
  }
  for (const Case& c : cases())
    for (const bool derivative : {false, true}) measure(c, derivative, arguments.number, arguments.csv.get());
}
