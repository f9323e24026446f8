// The primal against closed forms: directly seen emitters, one bounce off a floor by quadrature, and the
// white furnace. Statistical limits: |z| < 4.5 with 38 batches each (Student's t: 6e-5 a comparison); about
// 500 comparisons with fixed seeds, so that a change of the random numbers alone makes one fail 3 times in
// 100.
#include <gtest/gtest.h>

#include <functional>

#include "scene_building.h"
#include "support.h"

namespace isochron::testing {
namespace {

constexpr double kLimit = 4.5;
constexpr int kEnergyBatches = 38;

struct Rule {
  std::vector<double> x, w;  ///< on (0, 1)
};

Rule gauss_legendre(int n) {
  Rule rule;
  for (int i = 0; i < n; ++i) {
    double x = std::cos(kPi * (i + 0.75) / (n + 0.5)), slope = 0;
    for (int step = 0; step < 100; ++step) {
      double p = 1, previous = 0;
      for (int k = 1; k <= n; ++k) {
        const double next = ((2 * k - 1) * x * p - (k - 1) * previous) / k;
        previous = p;
        p = next;
      }
      slope = n * (x * p - previous) / (x * x - 1);
      x -= p / slope;
      if (std::abs(p / slope) < 1e-16) break;
    }
    rule.x.push_back(0.5 * (1 + x));
    rule.w.push_back(1 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

/// Gates by their definition in theory section 1, independent of GateShape.
struct PlainGate {
  enum Kind { steady, gaussian, boxcar, truncated } kind;
  double sigma = 0, half_width = 0;
  double operator()(double x) const {
    if (kind == steady) return 1;
    if (kind == boxcar) return std::abs(x) < half_width ? 1 / (2 * half_width) : 0;
    if (kind == truncated && std::abs(x) > half_width) return 0;
    return std::exp(-0.5 * x * x / (sigma * sigma)) / (sigma * std::sqrt(kTwoPi));
  }
  bool jumps() const { return kind == boxcar || kind == truncated; }
  GateShape shape() const {
    switch (kind) {
      case steady:
        return GateShape::steady();
      case gaussian:
        return GateShape::gaussian(sigma);
      case boxcar:
        return GateShape::boxcar(2 * half_width);
      default:
        return GateShape::truncated_gaussian(sigma, half_width);
    }
  }
};

struct NamedGate {
  const char* name;
  PlainGate gate;
};
const NamedGate kGates[] = {{"Steady", {PlainGate::steady}},
                            {"Gaussian", {PlainGate::gaussian, 0.12}},
                            {"Boxcar", {PlainGate::boxcar, 0, 0.15}},
                            {"Truncated", {PlainGate::truncated, 0.15, 0.18}}};

std::vector<Sampling> samplings(const PlainGate& gate) {
  if (gate.kind == PlainGate::steady) return {Sampling::standard};
  return {Sampling::standard, Sampling::ellipsoidal};
}

/// The camera's mapping written independently: direction (not unit) through image coordinates in pixels.
struct PlainCamera {
  Vec3 position, forward, right, up;
  double size;
  int width, height;
  explicit PlainCamera(const Camera& c)
      : position(c.position), forward(normalize(c.look_at - c.position)), width(c.width), height(c.height) {
    right = normalize(cross(forward, c.up));
    up = cross(right, forward);
    size = 2 * std::tan(c.fov * kPi / 360) / c.width;
  }
  Vec3 direction(double u, double v) const {
    return forward + right * (size * (u - 0.5 * width)) + up * (size * (0.5 * height - v));
  }
};

class ClosedForm : public ::testing::TestWithParam<NamedGate> {};

TEST_P(ClosedForm, EmitterSeenDirectly) {
  const PlainGate& gate = GetParam().gate;
  Scene scene;
  scene.camera = {{0.1, 0.2, 1.0}, {0, 0, 0}, {0, 1, 0}, 60, 4, 3};
  const Rgb radiance(3, 5, 7);
  scene.grey = false;
  add_shape(scene, "light", quad({-3, -3, -0.5}, {3, -3, 0.4}, {3, 3, 0.4}, {-3, 3, -0.5}), diffuse(Rgb(0.5)),
            radiance);
  const Vec3 normal = normalize(cross(Vec3{6, 0, 0.9}, Vec3{0, 6, 0}));
  const GateSet gates(gate.shape(),
                      gate.kind == PlainGate::steady ? std::vector<double>{0} : std::vector<double>{1.0, 1.3});
  const PlainCamera camera(scene.camera);
  const int cells = 400;
  for (const Sampling sampling : samplings(gate)) {
    const Renderer renderer(scene, gates, {.max_bounces = 0, .sampling = sampling});
    std::vector<Batches> batches(12 * gates.size());
    for (int b = 0; b < kEnergyBatches; ++b) {
      const GatedImage image = renderer.render({5, 0, 0}, {b * 200, (b + 1) * 200});
      for (int pixel = 0; pixel < 12; ++pixel)
        for (int g = 0; g < gates.size(); ++g) {
          batches[pixel * gates.size() + g].add(image.at(pixel, g, 0));
          for (int c = 1; c < 3; ++c)
            EXPECT_NEAR(image.at(pixel, g, c) * 3, image.at(pixel, g, 0) * radiance[c], 1e-12 * radiance[c] * 30);
        }
    }
    for (int pixel = 0; pixel < 12; ++pixel)
      for (int g = 0; g < gates.size(); ++g) {
        double sum = 0;  // midpoint rule: good to 1e-4 in spite of the jumps
        for (int i = 0; i < cells; ++i)
          for (int j = 0; j < cells; ++j) {
            const Vec3 d = camera.direction(pixel % 4 + (i + 0.5) / cells, pixel / 4 + (j + 0.5) / cells);
            const double t = dot(normal, Vec3{-3, -3, -0.5} - camera.position) / dot(normal, d);
            sum += gate(t * length(d) - gates.center(g) * (gate.kind != PlainGate::steady));
          }
        const double expected = radiance.r * sum / cells / cells;
        const Estimate e = batches[pixel * gates.size() + g].estimate();
        EXPECT_NEAR(e.mean, expected, kLimit * e.standard_error + 1e-3 * expected)
            << "sampling " << static_cast<int>(sampling) << " pixel " << pixel << " gate " << g;
        if (expected > 0.1) {
          EXPECT_LT(e.standard_error, scatter_of_errors(kEnergyBatches) * 0.05 * (expected + 1));
        }
        if (gate.kind == PlainGate::steady) {
          EXPECT_NEAR(e.mean, radiance.r, 1e-12);
        }
      }
  }
}

/// A diffuse floor (y = 0) that fills the image, lit by a horizontal rectangle [-0.4, 0.5] x [-0.3, 0.4] at y
/// = 0.9.
constexpr double kLightHeight = 0.9, kLightX[] = {-0.4, 0.5}, kLightZ[] = {-0.3, 0.4};

Scene floor_scene() {
  Scene scene;
  scene.camera = {{1.6, 1.2, 0.3}, {0.6, 0, 0.1}, {0, 1, 0}, 40, 4, 3};
  add_shape(scene, "floor", quad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}), diffuse(Rgb(0.7)));
  const double y = kLightHeight;
  add_shape(scene, "light",
            quad({kLightX[0], y, kLightZ[0]}, {kLightX[1], y, kLightZ[0]}, {kLightX[1], y, kLightZ[1]},
                 {kLightX[0], y, kLightZ[1]}),
            diffuse(Rgb(0.0)), Rgb(4.0));
  return scene;
}

/// Image mean by quadrature of `n` points a dimension. Along the innermost one, the light's z, the gate's
/// jumps are found in closed form.
double floor_mean(const Scene& scene, const PlainGate& gate, double center, int n) {
  const Rule rule = gauss_legendre(n), inner = gauss_legendre(12);
  const PlainCamera camera(scene.camera);
  double total = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vec3 d = camera.direction(camera.width * rule.x[i], camera.height * rule.x[j]);
      const double t = -camera.position.y / d.y, first = t * length(d);
      const Vec3 x = camera.position + d * t;
      for (int k = 0; k < n; ++k) {
        const double light_x = kLightX[0] + (kLightX[1] - kLightX[0]) * rule.x[k];
        const double across = std::hypot(light_x - x.x, kLightHeight);
        std::vector<double> cuts{kLightZ[0], kLightZ[1]};
        if (gate.jumps())
          for (const double side : {-1.0, 1.0}) {
            const double r = center + side * gate.half_width - first;
            if (r <= across) continue;
            const double z = std::sqrt(r * r - across * across);
            for (const double cut : {x.z - z, x.z + z})
              if (cut > kLightZ[0] && cut < kLightZ[1]) cuts.push_back(cut);
          }
        std::sort(cuts.begin(), cuts.end());
        double sum = 0;
        for (std::size_t piece = 0; piece + 1 < cuts.size(); ++piece)
          for (std::size_t q = 0; q < inner.x.size(); ++q) {
            const double z = cuts[piece] + (cuts[piece + 1] - cuts[piece]) * inner.x[q];
            const double r2 = across * across + (z - x.z) * (z - x.z);
            sum += (cuts[piece + 1] - cuts[piece]) * inner.w[q] * kLightHeight * kLightHeight / (r2 * r2) *
                   gate(first + std::sqrt(r2) - center);
          }
        total += rule.w[i] * rule.w[j] * rule.w[k] * (kLightX[1] - kLightX[0]) * sum;
      }
    }
  return total * 0.7 / kPi * 4.0;
}

TEST_P(ClosedForm, DirectLightOnAFloor) {
  const PlainGate& gate = GetParam().gate;
  const Scene scene = floor_scene();
  std::vector<double> centers{0};
  if (gate.kind != PlainGate::steady) centers = {2.4, 2.65, 2.9};
  const GateSet gates(gate.shape(), centers);
  for (const Sampling sampling : samplings(gate)) {
    const Renderer renderer(scene, gates, {.max_bounces = 1, .sampling = sampling});
    const auto means = image_means(renderer, gates.size(), 600, kEnergyBatches, {8, 0, 0});
    for (int g = 0; g < gates.size(); ++g) {
      const int n = gate.jumps() ? 80 : 20;  // jumps leave kinks along the outer dimensions
      const double expected = floor_mean(scene, gate, centers[g], n);
      const double coarse = floor_mean(scene, gate, centers[g], 3 * n / 4);
      ASSERT_NEAR(coarse, expected, 1e-3 * expected) << "the quadrature itself";
      EXPECT_NEAR(means[g].mean, expected, kLimit * means[g].standard_error + 1e-3 * expected) << "gate " << g;
      EXPECT_GT(expected, 0.01);
      EXPECT_LT(means[g].standard_error, scatter_of_errors(kEnergyBatches) * 8e-3 * expected) << "gate " << g;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, ClosedForm, ::testing::ValuesIn(kGates),
                         [](const auto& test) { return std::string(test.param.name); });

/// A closed box whose walls all emit 1 and reflect `albedo`: after n bounces the radiance anywhere is a
/// geometric sum.
Scene white_furnace(double albedo) {
  Scene scene;
  scene.camera = {{0.1, 0.2, 0.3}, {0.5, -0.2, -1}, {0, 1, 0}, 70, 4, 4};
  add_shape(scene, "walls", box({-1, -0.8, -1.2}, {1, 0.9, 1}, true), diffuse(Rgb(albedo)), Rgb(1.0));
  return scene;
}

TEST(Furnace, EveryBounceAddsItsPower) {
  const double albedo = 0.6;
  const Scene scene = white_furnace(albedo);
  // Steady, and a boxcar so wide that it holds every path of up to three bounces: the diagonal is below 3.45.
  const GateSet steady(GateShape::steady(), {0}), wide(GateShape::boxcar(14), {7});
  const struct {
    const GateSet& gates;
    Sampling sampling;
    double weight, error;
    int samples;
  } runs[] = {{steady, Sampling::standard, 1, 2e-3, 100},
              {wide, Sampling::standard, 1.0 / 14, 2e-3, 100},
              {wide, Sampling::ellipsoidal, 1.0 / 14, 2e-2, 400}};
  for (const auto& run : runs) {
    double expected = 0, power = 1;
    Estimate previous;
    for (int bounces = 0; bounces <= 3; ++bounces, power *= albedo) {
      expected += power;
      const Renderer renderer(scene, run.gates, {.max_bounces = bounces, .sampling = run.sampling});
      const Stream stream{static_cast<std::uint64_t>(12 + bounces), 0, 0};
      const Estimate e = image_means(renderer, 1, run.samples, kEnergyBatches, stream)[0];
      EXPECT_NEAR(e.mean, expected * run.weight, kLimit * e.standard_error + 1e-12) << bounces << " bounces";
      EXPECT_LT(e.standard_error, scatter_of_errors(kEnergyBatches) * run.error * expected * run.weight)
          << bounces << " bounces";
      // The last bounce alone: nothing beyond it arrives, nothing short of it is missing.
      const double last = power * run.weight, error = std::hypot(e.standard_error, previous.standard_error);
      EXPECT_NEAR(e.mean - previous.mean, last, kLimit * error + 1e-12);
      EXPECT_LT(kLimit * error, 0.5 * last);
      previous = e;
    }
  }
}

/// Many bounces: Russian roulette keeps the mean.
TEST(Furnace, RouletteKeepsTheMean) {
  const double albedo = 0.5;
  const Scene scene = white_furnace(albedo);
  const GateSet steady(GateShape::steady(), {0});
  const Renderer renderer(scene, steady, {.max_bounces = 12});
  const Estimate e = image_means(renderer, 1, 200, kEnergyBatches, {16, 0, 0})[0];
  EXPECT_NEAR(e.mean, (1 - std::pow(albedo, 13)) / (1 - albedo), kLimit * e.standard_error);
  EXPECT_LT(e.standard_error, scatter_of_errors(kEnergyBatches) * 2e-3);
}

class Agreement : public ::testing::TestWithParam<std::tuple<bool, int>> {};

/// Standard and ellipsoidal sampling share nothing but the scene.
TEST_P(Agreement, OfStandardAndEllipsoidalPerBlock) {
  const auto [glossy, bounces] = GetParam();
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  scene.camera.look_at = {0, 0.2, 0};  // the lamp itself is in view
  if (glossy)
    for (const auto& [name, reflectance, two_sided] :
         {std::tuple{"grey", 0.5, false}, {"panel", 0.7, true}, {"block", 0.6, false}})
      replace_material(scene, name, conductor(Rgb(reflectance), 0.4, two_sided));
  const std::vector<double> centers =
      bounces == 0 ? std::vector<double>{3.7, 4.0, 4.3} : std::vector<double>{4.6, 5.3, 6.0};
  const GateSet gates(GateShape::gaussian(0.25), centers);
  const int block = 4, across = scene.camera.width / block, blocks = across * across;
  std::vector<std::vector<Estimate>> results;
  for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
    const Renderer renderer(scene, gates, {.max_bounces = bounces, .sampling = sampling});
    const int samples = sampling == Sampling::standard ? 32 : 24;
    std::vector<Batches> sums((blocks + 1) * gates.size());
    for (int b = 0; b < kEnergyBatches; ++b) {
      const GatedImage image =
          renderer.render({sampling == Sampling::standard ? 1u : 2u, 0, 0}, {b * samples, (b + 1) * samples});
      for (int g = 0; g < gates.size(); ++g) {
        std::vector<double> mean(blocks, 0.0);
        for (int pixel = 0; pixel < image.pixels(); ++pixel)
          mean[pixel / image.width / block * across + pixel % image.width / block] +=
              image.at(pixel, g) / (block * block);
        for (int i = 0; i < blocks; ++i) sums[i * gates.size() + g].add(mean[i]);
        sums[blocks * gates.size() + g].add(image.mean(g));
      }
    }
    results.emplace_back();
    for (const Batches& s : sums) results.back().push_back(s.estimate());
  }
  for (std::size_t i = 0; i < results[0].size(); ++i) {
    EXPECT_LT(std::abs(z_score(results[0][i], results[1][i])), kLimit)
        << "block " << i / gates.size() << " gate " << i % gates.size() << ": " << results[0][i].mean << " +- "
        << results[0][i].standard_error << " and " << results[1][i].mean << " +- " << results[1][i].standard_error;
  }
  for (int g = 0; g < gates.size(); ++g)
    for (const auto& r : results) {
      const Estimate& whole = r[blocks * gates.size() + g];
      EXPECT_GT(whole.mean, 0);
      EXPECT_LT(whole.standard_error, scatter_of_errors(kEnergyBatches) * 0.03 * whole.mean)
          << "too noisy to tell, gate " << g;
    }
}

INSTANTIATE_TEST_SUITE_P(, Agreement, ::testing::Combine(::testing::Bool(), ::testing::Values(0, 1, 3)),
                         [](const auto& test) {
                           return std::string(std::get<0>(test.param) ? "Glossy" : "Diffuse") +
                                  std::to_string(std::get<1>(test.param));
                         });

}  // namespace
}  // namespace isochron::testing
