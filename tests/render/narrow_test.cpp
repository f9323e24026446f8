// A sensor with a field of view of 0.004 degrees looks at one point of a floor, which a lamp lights past the straight
// edge of an occluder, under gates as narrow as 0.2 % of the path. Image and derivatives are integrals over the lamp
// (or along one line on it) that quadrature gives to many digits.
//
// Statistics: every comparison is a z-test at 4.5 standard errors (false alarms: 7e-6 each), with fixed seeds; the
// standard error itself must be below 3 % of the derivative's scale (root of the terms' summed squares).
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/render/support.h"

namespace isochron::testing {
namespace {

constexpr double kEmission = 7, kReflected = 0.6;
constexpr double kLampHeight = 2, kLampHalf = 0.5, kOccluderHeight = 1, kOccluderEdge = 0.1;
const Vec3 kCamera{0.4, 3, 2};

/// Where the pieces are; zero is where the files put them.
struct Shift {
  Vec3 occluder, lamp, floor;
};

std::string write_scene() {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "isochron_narrow";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "floor.obj") << "v -3 0 -3\nv -3 0 3\nv 3 0 3\nv 3 0 -3\nf 1 2 3\nf 1 3 4\n";
  std::ofstream(folder / "lamp.obj") << "v -0.5 2 -0.5\nv 0.5 2 -0.5\nv 0.5 2 0.5\nv -0.5 2 0.5\nf 1 2 3\nf 1 3 4\n";
  std::ofstream(folder / "occluder.obj") << "v -2 1 -3\nv -2 1 3\nv 0.1 1 3\nv 0.1 1 -3\nf 1 2 3\nf 1 3 4\n";
  std::ofstream(folder / "scene.yaml")
      << "camera: {position: [0.4, 3, 2], look_at: [0, 0, 0], up: [0, 1, 0], fov: 0.004, resolution: [2, 2]}\n"
         "materials:\n"
         "  floor: {type: diffuse, albedo: 0.6}\n"
         "  black: {type: diffuse, albedo: 0}\n"
         "shapes:\n"
         "  - {name: floor, file: floor.obj, material: floor}\n"
         "  - {name: lamp, file: lamp.obj, material: black, emission: 7}\n"
         "  - {name: occluder, file: occluder.obj, material: black}\n";
  return (folder / "scene.yaml").string();
}

/// Composite Gauss-Legendre (5 points) over [a, b].
template <class F>
double integrate(double a, double b, int pieces, F&& f) {
  static constexpr double x[] = {0, 0.5384693101056831, 0.9061798459386640};
  static constexpr double w[] = {0.5688888888888889, 0.4786286704993665, 0.2369268850561891};
  double sum = 0;
  const double h = (b - a) / pieces;
  for (int i = 0; i < pieces; ++i) {
    const double c = a + (i + 0.5) * h;
    sum += w[0] * f(c);
    for (int k = 1; k < 3; ++k) sum += w[k] * (f(c - 0.5 * h * x[k]) + f(c + 0.5 * h * x[k]));
  }
  return 0.5 * h * sum;
}

/// The same where f may behave like a root at either end.
template <class F>
double integrate_between_roots(double a, double b, int pieces, F&& f) {
  return integrate(0, 1, pieces,
                   [&](double u) { return 6 * u * (1 - u) * (b - a) * f(a + (b - a) * u * u * (3 - 2 * u)); });
}

/// What the pixel sees, by quadrature over the lamp, piece by piece between the ends of the gate's support, where it may
/// jump: arcs of circles, which along x start and end at the lamp's sides or where they turn.
double pixel_value(const GateShape& gate, double center, const Shift& s) {
  // The camera's ray meets the shifted floor here; the pixel is so small that one point stands for it.
  const double t = (kCamera.y - s.floor.y) / kCamera.y;
  const Vec3 d = kCamera * (1 - t);
  const double first = length(kCamera - d);
  const double lamp_y = kLampHeight + s.lamp.y, edge_y = kOccluderHeight + s.occluder.y;
  const double edge_x = kOccluderEdge + s.occluder.x;
  // Lamp points to the right of this are seen past the edge.
  const double shadow_x = d.x + (edge_x - d.x) * (lamp_y - d.y) / (edge_y - d.y);
  const double left = std::max(-kLampHalf + s.lamp.x, shadow_x), right = kLampHalf + s.lamp.x;
  const double h = lamp_y - d.y, z_ends[2] = {-kLampHalf + s.lamp.z, kLampHalf + s.lamp.z};
  // centre +- sqrt(squared), where between the first two.
  const auto add_crossings = [](std::vector<double>& ends, double centre, double squared) {
    const double from = ends[0], to = ends[1];
    if (!(squared > 0)) return;
    for (const double x : {centre - std::sqrt(squared), centre + std::sqrt(squared)})
      if (x > from && x < to) ends.push_back(x);
  };
  const auto sum_of_pieces = [](std::vector<double>& ends, auto&& integral) {
    std::sort(ends.begin(), ends.end());
    double sum = 0;
    for (std::size_t i = 1; i < ends.size(); ++i) sum += integral(ends[i - 1], ends[i]);
    return sum;
  };
  const double radii[2] = {center + gate.lower() - first, center + gate.upper() - first};
  std::vector<double> x_ends = {left, right};
  for (const double r : radii)
    for (const double z : {0.0, z_ends[0] - d.z, z_ends[1] - d.z})
      if (r > 0) add_crossings(x_ends, d.x, r * r - h * h - z * z);
  return sum_of_pieces(x_ends, [&](double x0, double x1) {
    return integrate_between_roots(x0, x1, 100, [&](double x) {
      const double across = (x - d.x) * (x - d.x) + h * h;
      std::vector<double> ends = {z_ends[0], z_ends[1]};
      for (const double r : radii)
        if (r > 0) add_crossings(ends, d.z, r * r - across);
      return sum_of_pieces(ends, [&](double z0, double z1) {
        return integrate(z0, z1, 30, [&](double z) {
          const double r2 = across + (z - d.z) * (z - d.z);
          return kEmission * kReflected / kPi * h * h / (r2 * r2) * gate.value(first + std::sqrt(r2) - center);
        });
      });
    });
  });
}

struct NarrowCase {
  const char* name;
  GateShape gate;
};

void PrintTo(const NarrowCase& c, std::ostream* out) {
  *out << c.name;
}

class NarrowFieldOfView : public ::testing::TestWithParam<std::tuple<NarrowCase, Sampling>> {};

TEST_P(NarrowFieldOfView, MatchesQuadrature) {
  const auto& [c, sampling] = GetParam();
  const Scene scene = load_scene(write_scene());
  const double first = length(kCamera);
  const GateSet gates(c.gate, {first + 2.04, first + 2.06});
  const std::vector<std::pair<Motion, Shift>> motions = {
      {translate(scene, "occluder", {1, 0, 0}), {{1, 0, 0}, {}, {}}},
      {translate(scene, "occluder", {0.3, 1, 0}), {{0.3, 1, 0}, {}, {}}},
      {translate(scene, "lamp", {1, 0, 0}), {{}, {1, 0, 0}, {}}},
      {translate(scene, "lamp", {0.2, 0.5, 1}), {{}, {0.2, 0.5, 1}, {}}},
      {translate(scene, "floor", {0, 1, 0}), {{}, {}, {0, 1, 0}}}};
  std::vector<Motion> columns;
  for (const auto& [motion, shift] : motions) columns.push_back(motion);
  const TangentBasis basis = make_basis(scene, columns);
  EstimatorOptions options;
  options.max_bounces = 1;
  options.sampling = sampling;
  options.guiding_samples = 400;
  const Renderer renderer(scene, gates, options, &basis);

  // Standard sampling hits such a gate with few paths, and W' with fewer.
  const int samples = sampling == Sampling::standard ? 4000 : 1000;
  const int batches = 32, size = static_cast<int>(motions.size());
  const auto image = image_means(renderer, 2, samples, batches, {11, 0, 0});
  for (int g = 0; g < 2; ++g) {
    const double exact = pixel_value(c.gate, gates.center(g), {});
    EXPECT_LT(image[g].standard_error, scatter_of_errors(batches) * 0.02 * exact);
    EXPECT_LT(std::abs(image[g].mean - exact), 4.5 * image[g].standard_error) << "gate " << g << ": " << exact;
  }
  std::vector<std::vector<Estimate>> terms[3];
  for (int t = 0; t < 3; ++t)
    terms[t] = term_means(renderer, kTerms[t], size, 2, samples_of(kTerms[t], samples), batches, {11, 0, 0});
  for (int m = 0; m < size; ++m)
    for (int g = 0; g < 2; ++g) {
      const auto scaled = [&](double h) {
        const Shift& u = motions[m].second;
        return pixel_value(c.gate, gates.center(g), {u.occluder * h, u.lamp * h, u.floor * h});
      };
      // Richardson extrapolation of central differences.
      constexpr double h = 5e-5;  // no circle passes a corner of what is lit within 2 h
      const double coarse = (scaled(2 * h) - scaled(-2 * h)) / (4 * h), fine = (scaled(h) - scaled(-h)) / (2 * h);
      const double exact = fine + (fine - coarse) / 3;
      double total = 0, error = 0, scale = 0;
      for (const auto& term : terms) {
        total += term[m][g].mean;
        error = std::hypot(error, term[m][g].standard_error);
        scale = std::hypot(scale, term[m][g].mean);
      }
      EXPECT_LT(error, scatter_of_errors(batches) * 0.03 * scale) << "motion " << m << " gate " << g;
      EXPECT_LT(std::abs(total - exact), 4.5 * error)
          << "motion " << m << " gate " << g << ": " << total << " +- " << error << ", exact " << exact;
    }
}

// Total length is about 5.7: sigma 0.0114 is 0.2 %, 0.1 is 2 %.
INSTANTIATE_TEST_SUITE_P(
    Gates, NarrowFieldOfView,
    ::testing::Values(std::tuple(NarrowCase{"gaussian_narrow", GateShape::gaussian(0.0114)}, Sampling::ellipsoidal),
                      std::tuple(NarrowCase{"truncated_narrow", GateShape::truncated_gaussian(0.0114, 0.0171)},
                                 Sampling::ellipsoidal),
                      std::tuple(NarrowCase{"boxcar_narrow", GateShape::boxcar(0.0228)}, Sampling::ellipsoidal),
                      std::tuple(NarrowCase{"gaussian_wide", GateShape::gaussian(0.1)}, Sampling::standard),
                      std::tuple(NarrowCase{"boxcar_wide", GateShape::boxcar(0.2)}, Sampling::standard)),
    [](const auto& test) { return std::get<0>(test.param).name; });

}  // namespace
}  // namespace isochron::testing
