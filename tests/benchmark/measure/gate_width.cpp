// Cost of one unit of precision against gate width: isochron_gate_width cost CSV [BATCHES]. For the cube of
// experiments/cube.yaml (direct light dominates) and the reference box (diffuse, with shadow edges), gaussian gates
// from the whole path length to 1e-5 of it: variance of a pixel of the image, or of its derivative by a vertical motion (as many
// samples of the interior as of the visibility term), averaged over pixels, times the CPU seconds spent. Lower is better; standard
// against ellipsoidal sampling, uncoupled, coupled and with kept lengths, and what automatic sampling makes of them (its trial, once
// per scene and gates, not counted).
//
// Growth of the derivative's variance: isochron_gate_width growth CSV [BATCHES]. For a floor under a lamp, with and
// without a shadow on it, widths from 1 to 1e-5 of the path; variance per camera path.
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "core/base/cpu_time.h"
#include "core/base/parallel.h"
#include "core/render/measure_mix.h"
#include "tests/benchmark/measure/arguments.h"
#include "tests/render/support.h"
#include "tests/render/width_growth.h"

namespace isochron::benchmarks {
namespace {

using testing::Estimate;

struct Setting {
  const char* name;
  std::string file;
  const char* moving;
  double center;
  int max_bounces;
  int samples;  ///< per pixel and batch, standard sampling
};

constexpr double kGuidingSamples = 8;  ///< per pixel

struct Method {
  const char* name;
  Sampling sampling;
  bool antithetic;
  std::optional<bool> keep_length;
};

/// Variance of a pixel's mean over all batches, averaged over pixels, and the average pixel.
struct PixelEstimate {
  double mean = 0, variance = 0;
};

template <class Image>
PixelEstimate pixel_estimate(int samples, int batches, Image&& image) {
  std::vector<testing::Batches> pixels;
  for (int b = 0; b < batches; ++b) {
    const GatedImage batch = image(SampleRange{b * samples, (b + 1) * samples});
    pixels.resize(batch.data.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i].add(batch.data[i]);
  }
  PixelEstimate result;
  for (const testing::Batches& pixel : pixels) {
    const Estimate e = pixel.estimate();
    result.mean += e.mean / pixels.size();
    result.variance += e.standard_error * e.standard_error / pixels.size();
  }
  return result;
}

void measure(const Setting& setting, int batches, std::FILE* csv) {
  const Scene scene = load_scene(setting.file);
  const TangentBasis basis = testing::make_basis(scene, {testing::translate(scene, setting.moving, {0, 1, 0})});
  for (const double width : {1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 3e-4, 1e-4, 1e-5}) {
    const GateSet gates(GateShape::gaussian(width * setting.center), {setting.center});
    for (const Method& method : {Method{"standard", Sampling::standard, true, {}},
                                 Method{"ellipsoidal, uncoupled", Sampling::ellipsoidal, false, false},
                                 Method{"ellipsoidal, coupled pairs", Sampling::ellipsoidal, true, false},
                                 Method{"ellipsoidal, kept lengths", Sampling::ellipsoidal, true, true},
                                 Method{"automatic", Sampling::automatic, true, {}}}) {
      EstimatorOptions options;
      options.max_bounces = setting.max_bounces;
      options.sampling = method.sampling;
      options.antithetic = method.antithetic;
      options.keep_length = method.keep_length;
      options.guiding_samples = kGuidingSamples;
      const SamplingMix mix = measure_mix(scene, gates, options, &basis, {2, 0, 0}, Purpose::images);
      options.mix = mix;
      const Renderer renderer(scene, gates, options, &basis);
      const auto report = [&](const char* quantity, bool connections, auto&& image) {
        const int samples = connections ? (setting.samples + 3) / 4 : setting.samples;
        const double start = cpu_seconds();
        const PixelEstimate e = pixel_estimate(samples, batches, image);
        const double cost = e.variance * (cpu_seconds() - start);
        std::fprintf(csv, "%s,%g,\"%s\",%s,%d,%.6g,%.6g,%.6g\n", setting.name, width, method.name, quantity,
                     connections, e.mean, e.variance, cost);
        std::printf("%-5s %6g  %-28s %-9s connections %d mean % .4e   variance x seconds %.2e\n", setting.name, width,
                    method.name, quantity, connections, e.mean, cost);
        std::fflush(stdout);
      };
      report("image", mix.image_connections, [&](SampleRange range) { return renderer.render({1, 0, 0}, range); });
      report("derivative", mix.interior_connections, [&](SampleRange range) {
        GatedImage sum = renderer.derive(Term::interior, {1, 0, 1}, range)[0];
        const GatedImage visibility = renderer.derive(Term::visibility, {1, 0, 2}, range)[0];
        for (std::size_t i = 0; i < sum.data.size(); ++i) sum.data[i] += visibility.data[i];
        return sum;
      });
    }
  }
}

void measure_cost(int batches, std::FILE* csv) {
  std::fprintf(csv, "scene,relative_width,method,quantity,connections,mean,variance,variance_seconds\n");
  measure({"cube", PROJECT_ROOT "/scenes/cube/scene.yaml", "cube", 5.4, 4, 4}, batches, csv);
  measure({"box", PROJECT_ROOT "/tests/data/reference/scene.yaml", "block", 6.0, 3, 16}, batches, csv);
}

void measure_growth(int batches, std::FILE* csv) {
  std::fprintf(csv, "scene,relative_width,method,mean,standard_error,variance\n");
  for (const bool shadow : {false, true}) {
    const Scene scene = testing::growth_scene(shadow);
    for (const testing::GrowthMethod& method : testing::kGrowthMethods) {
      std::vector<double> narrow, variances;
      for (int step = 0; step <= 10; ++step) {
        const double width = std::pow(10.0, -0.5 * step);
        const int samples = method.sampling == Sampling::standard ? 800 : 50;
        const Estimate e = testing::growth_estimate(scene, method, width, samples, batches);
        const double variance =
            e.standard_error * e.standard_error * samples * batches * scene.camera.width * scene.camera.height;
        std::fprintf(csv, "%s,%.4g,\"%s\",%.6g,%.6g,%.6g\n", shadow ? "shadow" : "open", width, method.name, e.mean,
                     e.standard_error, variance);
        if (width < 0.011) narrow.push_back(width), variances.push_back(variance);
      }
      std::printf("%-6s %-28s variance ~ width^%.2f below 0.01\n", shadow ? "shadow" : "open", method.name,
                  testing::fitted_exponent(narrow, variances));
    }
  }
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  using namespace isochron::benchmarks;
  const std::string what = argc > 1 ? argv[1] : "";
  const bool known = what == "cost" || what == "growth";
  const Arguments arguments =
      read_arguments(known ? argc : 0, argv, 2, "isochron_gate_width cost|growth CSV [BATCHES]", 64, 2);
  std::FILE* const csv = arguments.csv.get();
  const int batches = arguments.number;
  isochron::set_thread_count(1);
  what == "cost" ? measure_cost(batches, csv) : measure_growth(batches, csv);
  return 0;
}
