// Bodies that touch and move against each other: a case for each way.
#pragma once
#include <algorithm>
#include <cmath>
#include <ostream>
#include <vector>

#include "core/base/constants.h"
#include "tests/render/scene_building.h"
#include "tests/render/support.h"

namespace isochron::testing::contact {

/// A room with an open front and a lamp under the ceiling. The floor reaches `floor` to all sides, the walls 1.
inline Scene room(double floor = 1) {
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

inline constexpr Vec3 kCenter{0.2, -1, 0.1};

/// Turned about the vertical through kCenter.
inline Mesh standing_box() {
  Mesh mesh = box({-0.1, -1, -0.2}, {0.5, -0.4, 0.4});
  const double c = std::cos(0.3), s = std::sin(0.3);
  for (Vec3& p : mesh.positions) {
    const Vec3 d = p - kCenter;
    p = kCenter + Vec3{c * d.x - s * d.z, d.y, s * d.x + c * d.z};
  }
  return mesh;
}

/// A lumpy ball on kCenter, cut flat by the floor.
inline Mesh lump() {
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

inline Scene with(Scene scene, const char* name, const Mesh& mesh, const Material& material) {
  add_shape(scene, name, mesh, material);
  return scene;
}
inline Scene with_box(const Material& material = diffuse(Rgb(0.7))) {
  return with(room(), "box", standing_box(), material);
}

inline Motion slide(const Scene& scene) {
  return translate(scene, "box", {0.4, 0, 1});
}
/// Along z alone: past what stands beside it.
inline Motion pass(const Scene& scene) {
  return translate(scene, "box", {0, 0, 1});
}
inline Motion along_x(const Scene& scene) {
  return translate(scene, "box", {1, 0, 0});
}
inline Motion turn(const Scene& scene) {
  return rotate_y(scene, "box", kCenter);
}
/// Away from the vertical through kCenter, within the floor's plane.
inline Motion grow(const Scene& scene) {
  const auto away = [](const Vec3& p) { return Vec3{p.x - kCenter.x, 0, p.z - kCenter.z}; };
  return move_vertices(
      scene, "box", [](const Vec3&) { return true; }, [=](const Vec3& p, double t) { return p + away(p) * t; }, away);
}
/// The bottom's vertices alone, along the floor.
inline Motion shear(const Scene& scene) {
  return translate(scene, "box", {0.4, 0, 1}, [](const Vec3& p) { return p.y == -1; });
}
inline Motion slide_floor(const Scene& scene) {
  return translate(scene, "floor", {1, 0, 0});
}
inline Motion slide_neighbour(const Scene& scene) {
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
inline void PrintTo(const ContactCase& c, std::ostream* out) {
  *out << c.name;
}

inline std::vector<ContactCase> cases() {
  return {
      ContactCase{"slides", [] { return with_box(); }, slide, false, Sampling::standard, 64},
      ContactCase{"slides_gated", [] { return with_box(); }, slide, true, Sampling::standard, 64},
      ContactCase{"slides_ellipsoidal", [] { return with_box(); }, slide, true, Sampling::ellipsoidal, 64},
      ContactCase{"turns", [] { return with_box(); }, turn, false, Sampling::standard, 128, 0.07},
      ContactCase{"turns_ellipsoidal", [] { return with_box(); }, turn, true, Sampling::ellipsoidal, 192, 0.12},
      ContactCase{"grows", [] { return with_box(); }, grow, false, Sampling::standard, 64},
      ContactCase{"shears", [] { return with_box(); }, shear, false, Sampling::standard, 512, 0.08},
      ContactCase{"glossy", [] { return with_box(conductor(Rgb(0.8), 0.2)); }, slide, false, Sampling::standard, 64},
      ContactCase{"lump", [] { return with(room(), "box", lump(), diffuse(Rgb(0.7))); }, slide, false,
                  Sampling::standard, 96, 0.06},
      ContactCase{"screen",
                  [] {
                    return with(room(), "box", quad({0.3, -1, -0.6}, {0.3, -1, 0.6}, {0.3, 0, 0.6}, {0.3, 0, -0.6}),
                                diffuse(Rgb(0.7), true));
                  },
                  along_x, false, Sampling::standard, 128, 0.07},
      ContactCase{"floor", [] { return with(room(1.3), "box", standing_box(), diffuse(Rgb(0.7))); }, slide_floor, false,
                  Sampling::standard, 512, 0.12},
      ContactCase{"floor_gated", [] { return with(room(1.3), "box", standing_box(), diffuse(Rgb(0.7))); }, slide_floor,
                  true, Sampling::standard, 512, 0.12},
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
                    return with(with_box(), "glass", box({-0.5, -1, 0}, {-0.15, -0.6, 0.4}), glass(0.3, 1.5));
                  },
                  slide, false, Sampling::standard, 64, 0.08}};
}

/// Of the image's mean.
struct Comparison {
  Estimate interior, visibility, total, difference;
  /// The errors over the larger term.
  double error() const {
    return std::hypot(total.standard_error, difference.standard_error) /
           std::max(std::abs(interior.mean), std::abs(visibility.mean));
  }
  double z() const { return z_score(total, difference); }
};

inline GateSet gates_of(const ContactCase& c) {
  return c.gated ? GateSet(GateShape::gaussian(0.4), {8.5}) : GateSet(GateShape::steady(), {0});
}

/// The case's derivative with `factor` times its samples, and central differences of images with other random numbers.
inline Comparison compare(const ContactCase& c, int factor, int replicates) {
  const Scene scene = c.scene();
  const Motion motion = c.motion(scene);
  const TangentBasis basis = make_basis(scene, {motion});
  const GateSet gates = gates_of(c);
  EstimatorOptions options{.max_bounces = 3, .sampling = c.sampling, .guiding_samples = 16};
  const Renderer renderer(scene, gates, options, &basis);
  const int samples = factor * c.samples;
  Comparison r;
  r.interior = term_means(renderer, Term::interior, 1, 1, samples, replicates, {51, 0, 0})[0][0];
  r.visibility =
      term_means(renderer, Term::visibility, 1, 1, samples_of(Term::visibility, samples), replicates, {52, 0, 0})[0][0];
  r.total = {r.interior.mean + r.visibility.mean, std::hypot(r.interior.standard_error, r.visibility.standard_error)};
  options.sampling = Sampling::standard;
  r.difference = finite_difference(scene, motion, 0.02, gates, options, 1024 * factor, replicates, {53, 0, 0})[0];
  return r;
}

}  // namespace isochron::testing::contact
