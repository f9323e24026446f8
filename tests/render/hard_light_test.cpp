// Hard places of the light and the gate, in light from a tiny lamp over a floor: a lamp just behind the camera
// or beside it (foci that nearly coincide, the ellipsoid is a sphere), lengths at the specular one (the
// ellipse shrinks to a point) and at the straight line's (the ellipsoid shrinks to a segment), foci in the
// plane of a wall, a floor with slivers. The lamp is so small that one point of it stands for all, and the
// image's mean is an integral that quadrature gives to 0.2 % for gates with jumps, better for others.
//
// Statistics: z-tests at 4.5 standard errors, plus those 0.2 %, with fixed seeds (false alarms: 7e-6 each,
// below 1e-3 for the file). Standard sampling and connections are compared; the best of them
// must have a standard error below 2 % of the image and 8 % of a derivative's scale (root of the terms'
// summed squares).
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/constants.h"
#include "tests/render/scene_building.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

constexpr double kAlbedo = 0.6, kRadiance = 7;

/// A floor in the plane y = 0 and a lamp, a parallelogram about `lamp` with half edges u and v, which emits
/// along u x v.
struct Place {
  Vec3 camera, look_at;
  double fov;
  Vec3 lamp, u, v;
  Mesh wall = {};
  std::vector<double> cuts = {-8, 8};  ///< the floor's strips along x
};

Scene make_scene(const Place& place) {
  Scene scene;
  scene.camera.position = place.camera;
  scene.camera.look_at = place.look_at;
  scene.camera.fov = place.fov;
  scene.camera.width = scene.camera.height = 8;
  Mesh floor;
  for (const double x : place.cuts) {
    const int i = static_cast<int>(floor.positions.size());
    floor.positions.push_back({x, 0, 8});
    floor.positions.push_back({x, 0, -8});
    if (i == 0) continue;
    floor.faces.push_back({i - 2, i, i + 1});
    floor.faces.push_back({i - 2, i + 1, i - 1});
  }
  add_shape(scene, "floor", floor, diffuse(Rgb(kAlbedo)));
  const Vec3 &b = place.lamp, &u = place.u, &v = place.v;
  add_shape(scene, "lamp", quad(b - u - v, b + u - v, b + u + v, b - u + v), diffuse(Rgb(0.0)), Rgb(kRadiance));
  if (!place.wall.faces.empty()) add_shape(scene, "wall", place.wall, diffuse(Rgb(0.8), true));
  return scene;
}

/// How far floor and lamp are moved.
struct LampShift {
  double floor = 0;
  Vec3 lamp;
};

/// Mean of the image under the gate, by the midpoint rule: what the floor reflects, over the image, and the
/// lamp itself, over its area.
double image_mean(const Place& place, const GateShape& gate, double center, const LampShift& shift) {
  const Vec3 forward = normalize(place.look_at - place.camera), right = normalize(cross(forward, Vec3{0, 1, 0}));
  const Vec3 up = cross(right, forward), area = cross(place.u, place.v) * 4.0, lamp = place.lamp + shift.lamp;
  const double t = std::tan(0.5 * place.fov * kPi / 180);
  double floor = 0, direct = 0;
  constexpr int kGrid = 1200, kLampGrid = 300;
  for (int i = 0; i < kGrid; ++i)
    for (int j = 0; j < kGrid; ++j) {
      const Vec3 d = forward + right * (t * ((2 * i + 1.0) / kGrid - 1)) + up * (t * ((2 * j + 1.0) / kGrid - 1));
      if (!(d.y < 0)) continue;
      const Vec3 to_x = d * ((shift.floor - place.camera.y) / d.y), x = place.camera + to_x, to_lamp = lamp - x;
      const double r = length(to_lamp), projected = -dot(area, to_lamp);
      if (!(projected > 0 && to_lamp.y > 0)) continue;
      floor += projected * to_lamp.y / (r * r * r * r) * gate.value(length(to_x) + r - center);
    }
  for (int i = 0; i < kLampGrid; ++i)
    for (int j = 0; j < kLampGrid; ++j) {
      const Vec3 d =
          lamp + place.u * ((2 * i + 1.0) / kLampGrid - 1) + place.v * ((2 * j + 1.0) / kLampGrid - 1) - place.camera;
      const double depth = dot(d, forward), projected = -dot(area, d);
      if (!(depth > 0 && projected > 0 && std::abs(dot(d, right)) < t * depth && std::abs(dot(d, up)) < t * depth))
        continue;
      direct += projected / (depth * depth * depth) * gate.value(length(d) - center);
    }
  return kRadiance *
         (kAlbedo / kPi * floor / (1.0 * kGrid * kGrid) + direct / (4 * t * t) / (1.0 * kLampGrid * kLampGrid));
}

/// A small lamp that faces down.
Place facing_down(const Vec3& camera, const Vec3& look_at, double fov, const Vec3& lamp, double half = 1e-4) {
  return {camera, look_at, fov, lamp, {half, 0, 0}, {0, 0, half}};
}

/// The lamp just behind the camera, and beside it in one plane. (A camera within a face would see nothing
/// else.)
Place confocal() {
  return facing_down({0, 2, 0}, {0.5, 0, 0.3}, 50, {0, 2 + 1e-5, 0}, 1e-6);
}
Place beside_the_camera() {
  return facing_down({0, 2, 0}, {0.5, 0, 0.3}, 50, {2e-4, 2, 0});
}

Place bistatic() {
  return facing_down({-0.6, 1, 0.2}, {0, 0, 0}, 60, {0.5, 1.4, -0.1});
}
const double kSpecular = std::sqrt(1.1 * 1.1 + 0.3 * 0.3 + 2.4 * 2.4);

Place slivers() {
  Place place = bistatic();
  place.cuts = {-8, -0.2, -0.2 + 1e-9, -0.2 + 2e-6, 0.1, std::nextafter(0.1, 1.0), 8};
  return place;
}

/// The lamp's light grazes the floor on its way, so that its path is hardly longer than the straight line.
Place grazing() {
  return {{0, 0.02, 0}, {0, 0, -0.5}, 4, {0, 0.02, -1}, {3e-4, 0, 0}, {0, 3e-4, 0}};
}

/// A lamp that the camera sees.
Place seen() {
  return {{0, 1, 2}, {0, 1, 0}, 30, {0.1, 1.2, 0}, {0.15, 0, 0}, {0, 0.15, 0.04}};
}

/// Camera and lamp lie in the plane of a wall, which therefore neither gets light nor is seen. The lamp faces
/// away.
Place in_the_walls_plane() {
  return {{0, 1, 2},
          {0, 0, -0.5},
          40,
          {0, 1.2, -0.3},
          {0, 1e-4, 0},
          {0, 0, 1e-4},
          quad({0, 0.2, -0.9}, {0, 0.2, -0.3}, {0, 0.6, -0.3}, {0, 0.6, -0.9})};
}

struct LampCase {
  const char* name;
  Place (*place)();
  GateShape gate;
  double center, step;  ///< of the quadrature's finite difference
  Vec3 lamp_motion;
};
void PrintTo(const LampCase& c, std::ostream* out) {
  *out << c.name;
}

class HardLight : public ::testing::TestWithParam<LampCase> {};

TEST_P(HardLight, MatchesQuadrature) {
  const LampCase& c = GetParam();
  const Place place = c.place();
  const Scene scene = make_scene(place);
  const GateSet gates(c.gate, {c.center});
  const std::vector<LampShift> shifts = {{1, {}}, {0, c.lamp_motion}};
  std::vector<Motion> motions = {translate(scene, "floor", {0, 1, 0}), translate(scene, "lamp", c.lamp_motion)};
  if (!place.wall.faces.empty()) motions.push_back(translate(scene, "wall", {0, 1, 1}));
  const TangentBasis basis = make_basis(scene, motions);

  const double exact_image = image_mean(place, c.gate, c.center, {});
  double exact[2];
  for (int m = 0; m < 2; ++m) {
    const auto at = [&](double h) {
      return image_mean(place, c.gate, c.center, {shifts[m].floor * h, shifts[m].lamp * h});
    };
    // Richardson extrapolation of central differences.
    const double coarse = (at(2 * c.step) - at(-2 * c.step)) / (4 * c.step),
                 fine = (at(c.step) - at(-c.step)) / (2 * c.step);
    exact[m] = fine + (fine - coarse) / 3;
  }
  constexpr int kBatches = 32, kSamples = 40;
  constexpr double kQuadrature = 0.002;
  double least_error = INFINITY, least_relative[2] = {INFINITY, INFINITY};
  for (const bool connections : {true, false}) {
    EstimatorOptions options{.max_bounces = 1};
    options.mix = SamplingMix{connections, connections};
    const Renderer renderer(scene, gates, options, &basis);
    const Estimate image = image_means(renderer, 1, kSamples, kBatches, {61, 0, 0})[0];
    EXPECT_LT(std::abs(image.mean - exact_image), 4.5 * image.standard_error + kQuadrature * exact_image)
        << "connections " << connections << ": " << image.mean << " +- " << image.standard_error << ", exact "
        << exact_image;
    least_error = std::min(least_error, image.standard_error);
    std::vector<std::vector<Estimate>> terms[3];
    for (int t = 0; t < 3; ++t)
      terms[t] =
          term_means(renderer, kTerms[t], basis.columns, 1, samples_of(kTerms[t], kSamples), kBatches, {61, 0, 0});
    for (int m = 0; m < basis.columns; ++m) {
      double total = 0, error = 0, scale = 0;
      for (const auto& term : terms) {
        total += term[m][0].mean;
        error = std::hypot(error, term[m][0].standard_error);
        scale = std::hypot(scale, term[m][0].mean);
      }
      const double wanted = m < 2 ? exact[m] : 0;  // the wall has no part in it
      EXPECT_LE(std::abs(total - wanted), 4.5 * error + kQuadrature * std::abs(wanted))
          << "connections " << connections << " motion " << m << ": " << total << " +- " << error << ", exact "
          << wanted;
      if (m < 2) least_relative[m] = std::min(least_relative[m], scale > 0 ? error / scale : 0);
    }
  }
  EXPECT_LT(least_error, 0.02 * exact_image);
  for (const double relative : least_relative) EXPECT_LT(relative, 0.08);
}

INSTANTIATE_TEST_SUITE_P(
    Places, HardLight,
    ::testing::Values(
        LampCase{"confocal", confocal, GateShape::gaussian(0.02), 4.3, 1e-3, {1, 0.3, 0}},
        LampCase{"confocal_specular", confocal, GateShape::gaussian(0.004), 4.0, 1e-4, {0.5, 1, 0}},
        LampCase{"beside_boxcar", beside_the_camera, GateShape::boxcar(0.04), 4.0, 2e-3, {0.5, 1, 0}},
        LampCase{"specular", bistatic, GateShape::gaussian(1e-3 * kSpecular), kSpecular, 2e-4, {1, 1, 0}},
        LampCase{"specular_boxcar", bistatic, GateShape::boxcar(4e-3 * kSpecular), kSpecular, 1e-3, {1, 1, 0}},
        LampCase{"slivers", slivers, GateShape::gaussian(1e-3 * kSpecular), 1.002 * kSpecular, 2e-4, {1, 1, 0}},
        LampCase{"straight_grazing", grazing, GateShape::gaussian(1e-3), 1.0, 2e-4, {0, 1, 0}},
        LampCase{"straight_seen", seen, GateShape::gaussian(2e-3), std::sqrt(0.01 + 0.04 + 4), 2e-4, {0.2, 0.3, 1}},
        LampCase{"in_plane", in_the_walls_plane, GateShape::gaussian(0.02), 3.21, 1e-3, {0, 1, 0.2}}),
    [](const auto& test) { return test.param.name; });

/// Values of images and derivative images that are not zero; none may fail to be finite.
int non_zero_values(const Scene& scene, const GateSet& gates, const TangentBasis& basis,
                    const EstimatorOptions& options) {
  const Renderer renderer(scene, gates, options, &basis);
  std::vector<GatedImage> images = {renderer.render({62, 0, 0}, {0, 200})};
  for (const Term term : kTerms)
    for (GatedImage& d : renderer.derive(term, {62, 0, 1}, {0, 200})) images.push_back(std::move(d));
  int count = 0;
  for (const GatedImage& image : images)
    for (const double x : image.data) {
      EXPECT_TRUE(std::isfinite(x));
      count += x != 0;
    }
  return count;
}

TEST(ShortestPath, GatesThatEndThereAreExactlyDark) {
  // Of all lamp points the corner nearest to the camera has the shortest path over the floor.
  const Scene scene = make_scene(facing_down({-0.6, 1, 0.2}, {0, 0, 0}, 60, {0.5, 1.4, -0.1}, 0.05));
  const double shortest = std::sqrt(1.05 * 1.05 + 0.25 * 0.25 + 2.4 * 2.4);
  const TangentBasis basis =
      make_basis(scene, {translate(scene, "floor", {0, 1, 0}), translate(scene, "lamp", {0.3, 1, 0}),
                         change_material(scene, "floor", "albedo")});
  for (const double width : {1e-6, 3e-3, 0.3})
    for (const bool connections : {false, true}) {
      EstimatorOptions options{.max_bounces = 2};
      options.mix = SamplingMix{connections, connections};
      const auto lit = [&](double center) {
        return non_zero_values(scene, GateSet(GateShape::boxcar(width), {center}), basis, options);
      };
      EXPECT_EQ(lit(shortest - 0.5 * width), 0) << "width " << width << ", connections " << connections;
      if (width > 1e-3) {
        EXPECT_GT(lit(shortest + 0.5 * width), 0) << "width " << width << ", connections " << connections;
      }
    }
}

}  // namespace
}  // namespace isochron::testing
