// Bodies that touch and move against each other: their vertices follow each other (VertexFlows), so that derivatives have
// a variance, without bias.
//
// Statistics: z-tests at 4.5 standard errors of the difference from finite differences with other random numbers, fixed
// seeds (false alarms: 7e-6 each for normal errors, 15 of them; with 16 replicates Student's law makes that 4e-4), whose
// errors must be a few per cent of the larger term.
#include <gtest/gtest.h>

#include "core/math/constants.h"
#include "tests/render/scene_building.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

/// A room with an open front and a lamp under the ceiling. The floor reaches `floor` to all sides, the walls 1.
Scene room(double floor = 1) {
  Scene scene;
  scene.camera = {{0, 0.2, 3.9}, {0, -0.15, 0}, {0, 1, 0}, 36, 12, 12};
  add_shape(scene, "floor", quad({-floor, -1, floor}, {floor, -1, floor}, {floor, -1, -floor}, {-floor, -1, -floor}),
            diffuse(Rgb(0.7)));
  add_shape(scene, "ceiling", quad({-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}), diffuse(Rgb(0.6)));
  add_shape(scene, "back", quad({-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}), diffuse(Rgb(0.6)));
  add_shape(scene, "left", quad({-1, -1, 1}, {-1, -1, -1}, {-1, 1, -1}, {-1, 1, 1}), diffuse(Rgb(0.3)));
  add_shape(scene, "right", quad({1, -1, -1}, {1, -1, 1}, {1, 1, 1}, {1, 1, -1}), diffuse(Rgb(0.3)));
  add_shape(scene, "lamp", quad({-0.3, 0.98, -0.3}, {0.3, 0.98, -0.3}, {0.3, 0.98, 0.3}, {-0.3, 0.98, 0.3}),
            diffuse(Rgb(0.0)), Rgb(15.0));
  return scene;
}

constexpr Vec3 kCenter{0.2, -1, 0.1};

/// Turned about the vertical through kCenter.
Mesh standing_box() {
  Mesh mesh = box({-0.1, -1, -0.2}, {0.5, -0.4, 0.4});
  const double c = std::cos(0.3), s = std::sin(0.3);
  for (Vec3& p : mesh.positions) {
    const Vec3 d = p - kCenter;
    p = kCenter + Vec3{c * d.x - s * d.z, d.y, s * d.x + c * d.z};
  }
  return mesh;
}

/// A lumpy ball on kCenter, cut flat by the floor.
Mesh lump() {
  constexpr int kAround = 16, kDown = 10;
  constexpr double kRadius = 0.4;
  const Vec3 middle = kCenter + Vec3{0, 0.35, 0};
  Mesh mesh;
  mesh.positions.push_back(middle + Vec3{0, kRadius, 0});
  for (int j = 1; j < kDown; ++j)
    for (int i = 0; i < kAround; ++i) {
      const double theta = kPi * j / kDown, phi = kTwoPi * i / kAround;
      const double r = kRadius * (1 + 0.15 * std::sin(3 * phi) * std::sin(theta) * std::sin(2 * theta));
      mesh.positions.push_back(
          middle + Vec3{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)} * r);
    }
  mesh.positions.push_back(middle - Vec3{0, kRadius, 0});
  const auto id = [](int j, int i) { return 1 + (j - 1) * kAround + i % kAround; };
  const int last = static_cast<int>(mesh.positions.size()) - 1;
  for (int i = 0; i < kAround; ++i) {
    mesh.faces.push_back({0, id(1, i + 1), id(1, i)});
    mesh.faces.push_back({last, id(kDown - 1, i), id(kDown - 1, i + 1)});
    for (int j = 1; j + 1 < kDown; ++j) {
      mesh.faces.push_back({id(j, i), id(j, i + 1), id(j + 1, i)});
      mesh.faces.push_back({id(j, i + 1), id(j + 1, i + 1), id(j + 1, i)});
    }
  }
  for (Vec3& p : mesh.positions) p.y = std::max(p.y, kCenter.y);
  return mesh;
}

Material glass() {
  Material m = diffuse(Rgb(1.0));
  m.type = MaterialType::rough_dielectric;
  m.roughness = 0.3;
  m.ior = 1.5;
  return m;
}

Scene with(Scene scene, const char* name, const Mesh& mesh, const Material& material) {
  add_shape(scene, name, mesh, material);
  return scene;
}
Scene with_box(const Material& material = diffuse(Rgb(0.7))) {
  return with(room(), "box", standing_box(), material);
}

Motion slide(const Scene& scene) {
  return translate(scene, "box", {0.4, 0, 1});
}
/// Along z alone: past what stands beside it.
Motion pass(const Scene& scene) {
  return translate(scene, "box", {0, 0, 1});
}
Motion along_x(const Scene& scene) {
  return translate(scene, "box", {1, 0, 0});
}
Motion turn(const Scene& scene) {
  return rotate_y(scene, "box", kCenter);
}
/// Away from the vertical through kCenter, within the floor's plane.
Motion grow(const Scene& scene) {
  const auto away = [](const Vec3& p) { return Vec3{p.x - kCenter.x, 0, p.z - kCenter.z}; };
  return move_vertices(
      scene, "box", [](const Vec3&) { return true; }, [=](const Vec3& p, double t) { return p + away(p) * t; }, away);
}
/// The bottom's vertices alone, along the floor.
Motion shear(const Scene& scene) {
  return translate(scene, "box", {0.4, 0, 1}, [](const Vec3& p) { return p.y == -1; });
}
Motion slide_floor(const Scene& scene) {
  return translate(scene, "floor", {1, 0, 0});
}
Motion slide_neighbour(const Scene& scene) {
  return translate(scene, "low", {0, 0, 1});
}

struct ContactCase {
  const char* name;
  Scene (*scene)();
  Motion (*motion)(const Scene&);
  bool gated;
  Sampling sampling;
  int samples;          ///< per replicate of the interior term
  double error = 0.05;  ///< at most, over the larger term's mean
};
void PrintTo(const ContactCase& c, std::ostream* out) {
  *out << c.name;
}

class Contact : public ::testing::TestWithParam<ContactCase> {};

TEST_P(Contact, DerivativeIsThatOfFiniteDifferences) {
  const ContactCase& c = GetParam();
  constexpr int kReplicates = 16;
  const Scene scene = c.scene();
  const Motion motion = c.motion(scene);
  const TangentBasis basis = make_basis(scene, {motion});
  const GateSet gates = c.gated ? GateSet(GateShape::gaussian(0.4), {8.5}) : GateSet(GateShape::steady(), {0});
  EstimatorOptions options{.max_bounces = 3, .sampling = c.sampling, .guiding_samples = 16};
  const Renderer renderer(scene, gates, options, &basis);
  const Estimate interior = term_means(renderer, Term::interior, 1, 1, c.samples, kReplicates, {51, 0, 0})[0][0];
  const Estimate visibility = term_means(renderer, Term::visibility, 1, 1, samples_of(Term::visibility, c.samples),
                                         kReplicates, {52, 0, 0})[0][0];
  options.sampling = Sampling::standard;
  const Estimate difference = finite_difference(scene, motion, 0.02, gates, options, 1024, kReplicates, {53, 0, 0})[0];
  const Estimate total{interior.mean + visibility.mean, std::hypot(interior.standard_error, visibility.standard_error)};
  const double scale = std::max(std::abs(interior.mean), std::abs(visibility.mean));
  EXPECT_LT(std::hypot(total.standard_error, difference.standard_error), c.error * scale);
  EXPECT_LT(std::abs(z_score(total, difference)), 4.5)
      << total.mean << " +- " << total.standard_error << " (interior " << interior.mean << " +- "
      << interior.standard_error << ", visibility " << visibility.mean << " +- " << visibility.standard_error
      << "), finite difference " << difference.mean << " +- " << difference.standard_error;
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, Contact,
    ::testing::Values(
        ContactCase{"slides", [] { return with_box(); }, slide, false, Sampling::standard, 64},
        ContactCase{"slides_gated", [] { return with_box(); }, slide, true, Sampling::standard, 64},
        ContactCase{"slides_ellipsoidal", [] { return with_box(); }, slide, true, Sampling::ellipsoidal, 64},
        ContactCase{"turns", [] { return with_box(); }, turn, false, Sampling::standard, 128, 0.07},
        ContactCase{"turns_ellipsoidal", [] { return with_box(); }, turn, true, Sampling::ellipsoidal, 96, 0.15},
        ContactCase{"grows", [] { return with_box(); }, grow, false, Sampling::standard, 64},
        ContactCase{"shears", [] { return with_box(); }, shear, false, Sampling::standard, 256, 0.14},
        ContactCase{"glossy", [] { return with_box(conductor(Rgb(0.8), 0.2)); }, slide, false, Sampling::standard, 64},
        ContactCase{"lump", [] { return with(room(), "box", lump(), diffuse(Rgb(0.7))); }, slide, false,
                    Sampling::standard, 96, 0.06},
        ContactCase{"screen",
                    [] {
                      return with(room(), "box", quad({0.3, -1, -0.6}, {0.3, -1, 0.6}, {0.3, 0, 0.6}, {0.3, 0, -0.6}),
                                  diffuse(Rgb(0.7), true));
                    },
                    along_x, false, Sampling::standard, 128, 0.07},
        ContactCase{"floor", [] { return with(room(1.3), "box", standing_box(), diffuse(Rgb(0.7))); }, slide_floor,
                    false, Sampling::standard, 256, 0.2},
        ContactCase{"floor_gated", [] { return with(room(1.3), "box", standing_box(), diffuse(Rgb(0.7))); },
                    slide_floor, true, Sampling::standard, 256, 0.2},
        ContactCase{"beside_a_lower_one",
                    [] {
                      return with(with(room(), "box", box({0, -1, -0.2}, {0.5, -0.4, 0.4}), diffuse(Rgb(0.7))), "low",
                                  box({-0.6, -1, -0.3}, {0, -0.7, 0.3}), diffuse(Rgb(0.7)));
                    },
                    pass, false, Sampling::standard, 96, 0.05},
        ContactCase{"the_lower_one",
                    [] {
                      return with(with(room(), "box", box({0, -1, -0.2}, {0.5, -0.4, 0.4}), diffuse(Rgb(0.7))), "low",
                                  box({-0.6, -1, -0.3}, {0, -0.7, 0.3}), diffuse(Rgb(0.7)));
                    },
                    slide_neighbour, false, Sampling::standard, 64},
        ContactCase{"beside_glass",
                    [] {
                      return with(with_box(), "glass", box({-0.5, -1, 0}, {-0.15, -0.6, 0.4}), glass());
                    },
                    slide, false, Sampling::standard, 64, 0.08}),
    [](const auto& test) { return test.param.name; });

/// Sum over pixels of the variance of the derivative's mean, by the box's motion, over four bounces.
double variance_of_pixels(double raised, double follow) {
  Scene scene = with_box();
  const Shape& shape = scene.shapes.back();
  for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v) scene.positions[v].y += raised;
  const TangentBasis basis = make_basis(scene, {slide(scene)});
  const GateSet gates(GateShape::steady(), {0});
  const Renderer renderer(scene, gates, {.max_bounces = 4, .sampling = Sampling::standard, .follow = follow}, &basis);
  constexpr int kBatches = 32, kSamples = 64;
  std::vector<Batches> pixels(scene.camera.width * scene.camera.height);
  for (int b = 0; b < kBatches; ++b) {
    const GatedImage image = renderer.derive(Term::interior, {54, 0, 0}, {b * kSamples, (b + 1) * kSamples})[0];
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i].add(image.data[i * image.channels]);
  }
  double sum = 0;
  for (const Batches& p : pixels) sum += std::pow(p.estimate().standard_error, 2);
  return sum;
}

// Measured: 0.8 to 1.9, and 9 to 50 where nothing follows.
TEST(Contact, StandingOnTheFloorIsAsQuietAsHangingAboveIt) {
  const double hanging = variance_of_pixels(0.1, 1);
  EXPECT_LT(variance_of_pixels(0, 1), 4 * hanging);
  EXPECT_GT(variance_of_pixels(0, 0), 6 * hanging) << "the test must notice what it is for";
}

}  // namespace
}  // namespace isochron::testing
