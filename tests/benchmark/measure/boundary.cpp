// What each technique of the visibility term brings: isochron_boundary CSV [BATCHES]. Variance times CPU seconds of the
// term, with all techniques and with one left out at a time (guiding learns from 6 % of the samples,
// in the time measured), on
//   cube     experiments/cube.yaml's scene and a narrow gate: direct light past a glossy cube
//   box      the reference box (diffuse, three bounces), under a wide and a narrow gate
//   sensor   a field of view of 0.004 degrees that looks at one point of a floor past an occluder
//   ball     a ball of 320 faces, of whose edges few are silhouettes at a time; under both gates
// The variance is that of the image derivative's mean over pixels, and the mean over pixels of each pixel's variance.
#include <cstdio>
#include <cstdlib>
#include <map>

#include "core/base/cpu_time.h"
#include "core/base/parallel.h"
#include "tests/benchmark/measure/arguments.h"
#include "tests/render/scene_building.h"
#include "tests/render/support.h"

namespace isochron::benchmarks {
namespace {

struct Setting {
  const char* name;
  Scene scene;
  const char* moving;
  GateSet gates;
  int max_bounces;
  Sampling sampling;
  int samples;  ///< per pixel and batch
};

struct Variant {
  const char* name;
  void (*change)(EstimatorOptions&);
};
constexpr Variant kVariants[] = {
    {"all", [](EstimatorOptions&) {}},
    {"without guiding", [](EstimatorOptions& o) { o.guiding_samples = 0; }},
    {"without wedge", [](EstimatorOptions& o) { o.boundary.wedge = false; }},
    {"without aimed", [](EstimatorOptions& o) { o.boundary.aimed = false; }},
    {"without from camera", [](EstimatorOptions& o) { o.boundary.from_camera = false; }},
    {"without at length", [](EstimatorOptions& o) { o.boundary.at_length = false; }},
    {"without light arcs", [](EstimatorOptions& o) { o.boundary.light_arcs = false; }},
};

/// Of the samples, spent on learning.
constexpr double kLearningShare = 0.06;

struct Result {
  double mean = 0, of_mean = 0, of_pixels = 0;  ///< variances for one second
  double learning = 0;                          ///< share of the time
};

Result measure(const Setting& s, const EstimatorOptions& options, int batches) {
  const TangentBasis basis = testing::make_basis(s.scene, {testing::translate(s.scene, s.moving, {0.3, 1, 0.2})});
  const Renderer renderer(s.scene, s.gates, options, &basis);
  testing::Batches mean;
  std::vector<testing::Batches> pixels;
  const double start = cpu_seconds();
  renderer.derive(Term::visibility, {5, 0, 2}, {0, 0});  // learns
  const double learning = cpu_seconds() - start;
  for (int b = 0; b < batches; ++b) {
    const GatedImage image = renderer.derive(Term::visibility, {5, 0, 2}, {b * s.samples, (b + 1) * s.samples}).front();
    mean.add(image.mean(0));
    pixels.resize(image.data.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i].add(image.data[i]);
  }
  const double seconds = cpu_seconds() - start;
  const auto variance = [](const testing::Batches& x) {
    return x.estimate().standard_error * x.estimate().standard_error;
  };
  Result result{mean.estimate().mean, variance(mean) * seconds, 0, learning / seconds};
  for (const auto& pixel : pixels) result.of_pixels += variance(pixel) * seconds / static_cast<double>(pixels.size());
  return result;
}

void measure(const Setting& setting, int batches, std::FILE* csv) {
  Result all;
  for (const Variant& variant : kVariants) {
    EstimatorOptions options;
    options.max_bounces = setting.max_bounces;
    options.sampling = setting.sampling;
    options.guiding_samples = kLearningShare * setting.samples * batches;
    variant.change(options);
    const Result r = measure(setting, options, batches);
    if (&variant == kVariants) all = r;
    std::fprintf(csv, "%s,%s,%.6g,%.6g,%.6g,%.3g\n", setting.name, variant.name, r.mean, r.of_mean, r.of_pixels,
                 r.learning);
    std::printf(
        "%-12s %-22s mean % .4e   variance x seconds: of the mean %.2e (%6.2f), of pixels %.2e (%6.2f)   learning "
        "%2.0f %%\n",
        setting.name, variant.name, r.mean, r.of_mean, r.of_mean / all.of_mean, r.of_pixels,
        r.of_pixels / all.of_pixels, 100 * r.learning);
    std::fflush(stdout);
  }
}

/// The scene of tests/render/narrow_test.cpp.
Scene sensor() {
  using namespace testing;
  Scene scene;
  scene.camera = {{0.4, 3, 2}, {0, 0, 0}, {0, 1, 0}, 0.004, 2, 2};
  add_shape(scene, "floor", quad({-3, 0, -3}, {-3, 0, 3}, {3, 0, 3}, {3, 0, -3}), diffuse(Rgb(0.6)));
  add_shape(scene, "lamp", quad({-0.5, 2, -0.5}, {0.5, 2, -0.5}, {0.5, 2, 0.5}, {-0.5, 2, 0.5}), diffuse(Rgb(0)),
            Rgb(7));
  add_shape(scene, "occluder", quad({-2, 1, -3}, {-2, 1, 3}, {0.1, 1, 3}, {0.1, 1, -3}), diffuse(Rgb(0)));
  return scene;
}

/// A twice subdivided icosahedron on a floor, under a lamp.
Mesh ball(const Vec3& center, double radius) {
  const double g = 0.5 * (1 + std::sqrt(5.0));
  Mesh mesh{{{-1, g, 0},
             {1, g, 0},
             {-1, -g, 0},
             {1, -g, 0},
             {0, -1, g},
             {0, 1, g},
             {0, -1, -g},
             {0, 1, -g},
             {g, 0, -1},
             {g, 0, 1},
             {-g, 0, -1},
             {-g, 0, 1}},
            {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
             {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
             {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
  for (int level = 0; level < 2; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [place, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<int>(mesh.positions.size()));
      if (fresh) mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]) * 0.5);
      return place->second;
    };
    std::vector<std::array<int, 3>> faces;
    for (const auto& [a, b, c] : mesh.faces) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      faces.insert(faces.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.faces.assign(faces.begin(), faces.end());
  }
  for (Vec3& p : mesh.positions) p = center + normalize(p) * radius;
  return mesh;
}

Scene ball_scene() {
  using namespace testing;
  Scene scene;
  scene.camera = {{0, 2.5, 4}, {0, 0.5, 0}, {0, 1, 0}, 40, 32, 32};
  add_shape(scene, "floor", quad({-3, 0, -3}, {-3, 0, 3}, {3, 0, 3}, {3, 0, -3}), diffuse(Rgb(0.6)));
  add_shape(scene, "lamp", quad({0.5, 3, -0.5}, {1.5, 3, -0.5}, {1.5, 3, 0.5}, {0.5, 3, 0.5}), diffuse(Rgb(0)), Rgb(7));
  add_shape(scene, "ball", ball({0, 0.8, 0}, 0.5), diffuse(Rgb(0.5)));
  return scene;
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  using namespace isochron;
  using namespace isochron::benchmarks;
  const Arguments arguments = read_arguments(argc, argv, 1, "isochron_boundary CSV [BATCHES]", 64, 2);
  std::FILE* const csv = arguments.csv.get();
  const int batches = arguments.number;
  std::fprintf(csv, "scene,techniques,mean,variance_seconds_of_mean,variance_seconds_of_pixels,learning_share\n");
  set_thread_count(1);
  const Scene cube = load_scene(PROJECT_ROOT "/scenes/cube/scene.yaml");
  const Scene box = load_scene(PROJECT_ROOT "/tests/data/reference/scene.yaml");
  const auto gauss = [](double sigma, double center) { return GateSet(GateShape::gaussian(sigma), {center}); };
  measure({"cube", cube, "cube", gauss(0.0108, 5.4), 4, Sampling::ellipsoidal, 4}, batches, csv);
  measure({"box wide", box, "block", gauss(0.3, 6), 3, Sampling::standard, 16}, batches, csv);
  measure({"box narrow", box, "block", gauss(0.012, 6), 3, Sampling::ellipsoidal, 16}, batches, csv);
  measure({"sensor", sensor(), "occluder", gauss(0.0114, 5.7), 1, Sampling::ellipsoidal, 4000}, batches, csv);
  measure({"ball wide", ball_scene(), "ball", gauss(0.3, 8), 2, Sampling::standard, 16}, batches, csv);
  measure({"ball narrow", ball_scene(), "ball", gauss(0.016, 8), 2, Sampling::ellipsoidal, 16}, batches, csv);
  return 0;
}
