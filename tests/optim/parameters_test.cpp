#include "optim/problem/parameters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/base/error.h"
#include "tests/seed.h"

namespace isochron {
namespace {

/// Two shapes: a tetrahedron of four vertices and a quad of four, a diffuse, a rough and a glass material.
Scene two_shapes(bool grey) {
  Scene scene;
  scene.grey = grey;
  scene.materials = {Material("diffuse", "white"), Material("rough_conductor", "metal"),
                     Material("rough_dielectric", "glass")};
  scene.positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {-2, 0, -2}, {-2, 0, 2}, {2, 0, 2}, {2, 0, -2}};
  scene.triangles = {{{0, 2, 1}, 0}, {{0, 1, 3}, 0}, {{0, 3, 2}, 0}, {{1, 2, 3}, 0}, {{4, 5, 6}, 1}, {{4, 6, 7}, 1}};
  scene.shapes = {{.name = "tetra",
                   .file = "",
                   .material = 1,
                   .emission = {},
                   .first_vertex = 0,
                   .vertex_count = 4,
                   .first_triangle = 0,
                   .triangle_count = 4},
                  {.name = "quad",
                   .file = "",
                   .material = 0,
                   .emission = Rgb(5.0),
                   .first_vertex = 4,
                   .vertex_count = 4,
                   .first_triangle = 4,
                   .triangle_count = 2}};
  return scene;
}

ParameterSpec spec(const std::string& name, ParameterType type, const std::string& of, double initial) {
  ParameterSpec s;
  s.name = name;
  s.type = type;
  s.shape = of;
  s.initial = {initial};
  s.target = {initial};
  return s;
}

ParameterSpec of_material(const std::string& name, const std::string& quantity, const std::string& material,
                          double initial) {
  ParameterSpec s = spec(name, ParameterType::material, "", initial);
  s.quantity = quantity;
  s.material = material;
  return s;
}

std::vector<ParameterSpec> every_kind() {
  std::vector<ParameterSpec> specs;
  specs.push_back(spec("move", ParameterType::translation, "tetra", 0.3));
  specs.back().direction = {0.5, 1, -2};
  specs.push_back(spec("dent", ParameterType::vertices, "tetra", 0.1));
  specs.back().direction_kind = VertexDirection::normal;
  specs.back().selection = {Selection::Kind::list, {3, 1}, {}, {}};
  specs.push_back(spec("turn", ParameterType::rotation, "tetra", 25));
  specs.back().axis = {1, 2, -0.5};
  specs.back().pivot = {0.2, -0.4, 1};
  specs.push_back(spec("free", ParameterType::vertices, "tetra", -0.2));
  specs.back().direction_kind = VertexDirection::free;
  specs.back().selection = {Selection::Kind::box, {}, {-0.1, -0.1, -0.1}, {1.1, 0.1, 0.1}};
  specs.push_back(spec("turn_more", ParameterType::rotation, "tetra", -70));
  specs.back().axis = {0, 0, 3};
  specs.push_back(spec("lift", ParameterType::vertices, "quad", 0.0));
  specs.back().direction = {0, 2, 0};
  specs.push_back(of_material("colour", "albedo", "white", 0.4));
  specs.push_back(of_material("rough", "roughness", "metal", 0.25));
  specs.push_back(of_material("bend", "ior", "glass", 1.5));
  specs.push_back(spec("power", ParameterType::emission, "quad", 3));
  return specs;
}

/// All degrees of freedom of a scene in the order of DofLayout.
std::vector<double> dofs(const Scene& scene) {
  std::vector<double> all;
  for (const Vec3& p : scene.positions) all.insert(all.end(), {p.x, p.y, p.z});
  for (const Material& m : scene.materials)
    for (int k = 0; k < m.numbers(); ++k) all.push_back(m.number(k));
  for (const Shape& s : scene.shapes)
    for (int c = 0; c < 3; ++c) all.push_back(s.emission.radiance[c]);
  all.insert(all.end(), scene.texture.begin(), scene.texture.end());
  for (const PointLight& light : scene.lights)
    for (const Vec3& v :
         {light.position, light.direction, Vec3{light.intensity.r, light.intensity.g, light.intensity.b}})
      all.insert(all.end(), {v.x, v.y, v.z});
  all.push_back(scene.detector.gain);
  all.insert(all.end(), scene.detector.time_offset.begin(), scene.detector.time_offset.end());
  all.insert(all.end(), scene.detector.background.begin(), scene.detector.background.end());
  return all;
}

std::vector<double> point_near_initial(const Parameters& parameters, unsigned seed) {
  std::mt19937 generator(test_seed(seed));
  std::uniform_real_distribution<double> shift(-0.05, 0.05);
  std::vector<double> theta = parameters.initial();
  for (double& value : theta) value += shift(generator);
  return theta;
}

/// The tangent's columns are derivatives of all degrees of freedom; its rows' entries are sorted.
void expect_central_differences(const Parameters& parameters, const std::vector<double>& theta,
                                const TangentBasis& basis) {
  for (int column = 0; column < basis.columns; ++column) {
    const double h = 1e-5;  // truncation h^2 and cancellation 1e-15 / h are both below 1e-9
    std::vector<double> up = theta, down = theta;
    up[column] += h, down[column] -= h;
    const std::vector<double> above = dofs(parameters.apply(up)), below = dofs(parameters.apply(down));
    for (std::size_t row = 0; row < above.size(); ++row) {
      double coefficient = 0;
      for (int e = basis.row_begin[row]; e < basis.row_begin[row + 1]; ++e) {
        if (e > basis.row_begin[row]) {
          EXPECT_LT(basis.entries[e - 1].column, basis.entries[e].column);
        }
        if (basis.entries[e].column == column) coefficient = basis.entries[e].coefficient;
      }
      EXPECT_NEAR(coefficient, (above[row] - below[row]) / (2 * h), 1e-8) << "row " << row << " column " << column;
    }
  }
}

TEST(Parameters, TangentIsTheDerivativeOfApply) {
  for (bool grey : {true, false}) {
    const Scene scene = two_shapes(grey);
    const Parameters parameters(scene, every_kind());
    ASSERT_EQ(parameters.size(), 1 + 2 + 1 + 6 + 1 + 4 + (grey ? 1 : 3) + 1 + 1 + (grey ? 1 : 3));
    const std::vector<double> theta = point_near_initial(parameters, 5);
    const TangentBasis basis = parameters.tangent(theta);
    ASSERT_EQ(basis.columns, parameters.size());
    ASSERT_EQ(static_cast<int>(basis.row_begin.size()), DofLayout(scene).size() + 1);
    ASSERT_EQ(basis.row_begin.back(), static_cast<int>(basis.entries.size()));
    expect_central_differences(parameters, theta, basis);
  }
}

/// Motions of the tetrahedron with pivots that follow it: of all its vertices but for `part`, which carries no pivot
/// that all of them turn about.
std::vector<ParameterSpec> carried_pivots() {
  std::vector<ParameterSpec> specs;
  specs.push_back(spec("move", ParameterType::translation, "tetra", 5));
  specs.back().direction = {0.5, 1, -2};
  specs.push_back(spec("part", ParameterType::translation, "tetra", 0.4));
  specs.back().direction = {1, 0, 0};
  specs.back().selection = {Selection::Kind::list, {0, 2}, {}, {}};
  specs.push_back(spec("turn", ParameterType::rotation, "tetra", 25));
  specs.back().axis = {1, 2, -0.5};
  specs.back().pivot_kind = PivotKind::center;
  specs.push_back(spec("shift", ParameterType::translation, "tetra", -0.7));
  specs.back().direction = {0, 0.3, 1};
  specs.push_back(spec("hinge", ParameterType::rotation, "tetra", 40));
  specs.back().axis = {0, 1, 0};
  specs.back().pivot_kind = PivotKind::follow;
  specs.back().pivot = {1, 0, 0};
  specs.push_back(spec("part_turn", ParameterType::rotation, "tetra", -30));
  specs.back().axis = {0, 0, 1};
  specs.back().pivot_kind = PivotKind::center;
  specs.back().selection = {Selection::Kind::list, {0, 2}, {}, {}};
  return specs;
}

TEST(Parameters, TangentOfPivotsThatMoveWithTheShape) {
  const Scene scene = two_shapes(true);
  const Parameters parameters(scene, carried_pivots());
  const std::vector<double> theta = point_near_initial(parameters, 8);
  const TangentBasis basis = parameters.tangent(theta);
  expect_central_differences(parameters, theta, basis);
}

TEST(Parameters, PivotsMoveWithTheShape) {
  const Scene scene = two_shapes(true);
  std::vector<ParameterSpec> specs = {spec("move", ParameterType::translation, "tetra", 0),
                                      spec("turn", ParameterType::rotation, "tetra", 0)};
  specs[0].direction = {1, 0, 0};
  specs[1].axis = {0, 0, 1};
  // The mean of the tetrahedron's vertices is (0.25, 0.5, 0.75): wherever the shape goes, it turns about it.
  specs[1].pivot_kind = PivotKind::center;
  const std::vector<Vec3> spun = Parameters(scene, specs).apply({5, 90}).positions;
  EXPECT_NEAR(length((spun[0] + spun[1] + spun[2] + spun[3]) / 4 - Vec3{5.25, 0.5, 0.75}), 0, 1e-14);
  EXPECT_NEAR(length(spun[1] - Vec3{5.75, 1.25, 0}), 0, 1e-14);
  // A vertex as hinge stays where the translation has put it.
  specs[1].pivot_kind = PivotKind::follow;
  specs[1].pivot = {1, 0, 0};
  EXPECT_NEAR(length(Parameters(scene, specs).apply({5, 90}).positions[1] - Vec3{6, 0, 0}), 0, 1e-14);
  // A pivot of the world stays.
  specs[1].pivot_kind = PivotKind::fixed;
  EXPECT_NEAR(length(Parameters(scene, specs).apply({5, 90}).positions[1] - Vec3{1, 5, 0}), 0, 1e-14);
}

TEST(Parameters, ScalesByTypeAndAsGiven) {
  const Scene scene = two_shapes(false);
  std::vector<ParameterSpec> specs = every_kind();
  specs.back().initial = {1e3, 4e3, 2e3};
  specs.back().target = {2e3, 4e3, 2e3};
  specs[0].scale = 0.25;
  specs[0].target = {0.8};  // 0.5 from its initial value
  const Parameters parameters(scene, specs);
  const auto scale_of = [&](const std::string& name) {
    for (const Parameters::Block& block : parameters.blocks())
      if (block.name == name) return block.scale;
    return 0.0;
  };
  EXPECT_EQ(scale_of("move"), 0.25);
  EXPECT_EQ(scale_of("dent"), 1);
  EXPECT_NEAR(scale_of("turn"), 57.29577951308232, 1e-13);
  EXPECT_EQ(scale_of("colour"), 1);
  EXPECT_EQ(scale_of("power"), 4e3);
  EXPECT_EQ(parameters.scales()[0], 0.25);
  // Two scales of `move` and a quarter of a scale of `power` off, over all unknowns.
  const double squares = 2 * 2 + 0.25 * 0.25;
  EXPECT_NEAR(parameters.distance_to_target(parameters.initial()), std::sqrt(squares / parameters.size()), 1e-12);
  EXPECT_NEAR(parameters.distance_to_target(parameters.initial(), parameters.blocks().front()), 0.5, 1e-12);
  EXPECT_NEAR(parameters.distance_to_target(parameters.initial(), parameters.blocks().back()), 1e3 / std::sqrt(3),
              1e-9);
}

/// Texture, lights, the detector and the camera's pose.
TEST(Parameters, TangentIsTheDerivativeOfApplyForDetectorLightsAndPaint) {
  Scene scene = two_shapes(true);
  scene.camera.position = {0.3, -0.2, 5};
  scene.lights.resize(2);
  scene.lights[0].name = "flash";
  scene.lights[0].position = {1, 2, 3};
  scene.lights[1] = scene.lights[0];
  scene.lights[1].name = "torch";
  scene.lights[1].kind = PointLight::Kind::spot;
  scene.lights[1].direction = {0, 0.6, 0.8};
  scene.capture.emplace();
  scene.capture->sensor.resize(3);
  std::vector<ParameterSpec> specs;
  specs.push_back(spec("move", ParameterType::translation, "tetra", 0.3));
  specs.back().direction = {0.5, 1, -2};
  specs.push_back(spec("pan", ParameterType::camera_rotation, "", 20));
  specs.back().axis = {0.1, 1, 0.3};
  specs.push_back(spec("step", ParameterType::camera_translation, "", 0.4));
  specs.back().direction = {1, -0.5, 0.2};
  specs.push_back(spec("tilt", ParameterType::camera_rotation, "", -35));
  specs.back().axis = {1, 0.2, 0};
  specs.push_back(spec("paint", ParameterType::texture, "quad", 0.4));
  specs.push_back(spec("light_x", ParameterType::translation, "", 0.2));
  specs.back().light = "torch";
  specs.back().direction = {1, 0, 2};
  specs.push_back(spec("light_turn", ParameterType::rotation, "", 15));
  specs.back().light = "torch";
  specs.back().axis = {1, 0, 0.5};
  specs.push_back(spec("bright", ParameterType::intensity, "", 3));
  specs.back().light = "flash";
  specs.push_back(spec("gain", ParameterType::gain, "", 2));
  specs.push_back(spec("dark", ParameterType::background, "", 0.5));
  specs.back().per = Per::pixel;
  specs.push_back(spec("late", ParameterType::time_offset, "", 0.1));
  specs.back().per = Per::pixel;
  make_room(scene, specs);
  EXPECT_TRUE(scene.shapes[0].hidden && scene.shapes[1].hidden && scene.shapes[1].textured);
  const Parameters parameters(scene, specs, 0.3);
  ASSERT_EQ(parameters.size(), 4 + 4 + 2 + 1 + 1 + 3 + 3);
  const std::vector<double> theta = point_near_initial(parameters, 5);
  EXPECT_EQ(parameters.apply(theta).detector.time_offset[2], 0.3 * theta.back());
  expect_central_differences(parameters, theta, parameters.tangent(theta));
}

/// The camera is where it was, and all else where it is seen from the moved camera: distances to it are those in the world.
TEST(Parameters, CameraPoseIsAMotionOfAllElse) {
  Scene scene = two_shapes(true);
  scene.camera.position = {0.3, -0.2, 5};
  std::vector<ParameterSpec> specs{spec("step", ParameterType::camera_translation, "", 0.4),
                                   spec("pan", ParameterType::camera_rotation, "", 90)};
  specs[0].direction = {1, 0, 0};
  specs[1].axis = {0, 1, 0};
  const Parameters parameters(scene, specs);
  const Scene seen = parameters.apply(parameters.initial());
  // The camera moves by 0.4 along x and turns by 90 degrees about y: its axis -z turns to -x.
  const Vec3 camera{0.7, -0.2, 5};
  for (std::size_t v = 0; v < scene.positions.size(); ++v) {
    const Vec3 d = scene.positions[v] - camera, e = seen.positions[v] - scene.camera.position;
    EXPECT_NEAR(length(d), length(e), 1e-12);
    EXPECT_NEAR(e.z, d.x, 1e-12);  // what lies ahead of the turned camera, along -x, lies along -z
    EXPECT_NEAR(e.y, d.y, 1e-12);
  }
  // Files of meshes are in the coordinates of the scene.
  EXPECT_TRUE(parameters.in_place(parameters.initial()).positions == scene.positions);
  EXPECT_TRUE(parameters.moving_shapes().empty());
}

TEST(Parameters, TransposeIsTheAdjointOfTheTangent) {
  const Scene scene = two_shapes(false);
  const Parameters parameters(scene, every_kind());
  const std::vector<double> theta = point_near_initial(parameters, 6);
  std::mt19937 generator(test_seed(7));
  std::normal_distribution<double> normal;
  std::vector<double> x(parameters.size()), y(DofLayout(scene).size());
  for (double& value : x) value = normal(generator);
  for (double& value : y) value = normal(generator);
  // The directional derivative of apply along x, by differences: no use of the basis on this side.
  const double h = 1e-5;
  std::vector<double> up = theta, down = theta;
  for (std::size_t i = 0; i < x.size(); ++i) up[i] += h * x[i], down[i] -= h * x[i];
  const std::vector<double> above = dofs(parameters.apply(up)), below = dofs(parameters.apply(down));
  double left = 0, right = 0;
  for (std::size_t i = 0; i < y.size(); ++i) left += y[i] * (above[i] - below[i]) / (2 * h);
  const std::vector<double> transposed = parameters.tangent(theta).transpose_apply(y);
  for (std::size_t i = 0; i < x.size(); ++i) right += transposed[i] * x[i];
  EXPECT_NEAR(left, right, 1e-7);
}

TEST(Parameters, ActInTheListedOrder) {
  const Scene scene = two_shapes(true);
  std::vector<ParameterSpec> specs = {spec("move", ParameterType::translation, "tetra", 1),
                                      spec("turn", ParameterType::rotation, "tetra", 90)};
  specs[0].direction = {1, 0, 0};
  specs[1].axis = {0, 0, 2};
  specs[1].pivot = {0, 1, 0};
  // (1, 0, 0) + (1, 0, 0) turned by 90 degrees about z through (0, 1, 0): (2, -1, 0) -> (1, 2, 0), plus the
  // pivot.
  const Vec3 moved_first = Parameters(scene, specs).apply({1, 90}).positions[1];
  EXPECT_NEAR(length(moved_first - Vec3{1, 3, 0}), 0, 1e-15 * 8);
  // Turned first: (1, -1, 0) -> (1, 1, 0), plus the pivot and the shift.
  std::swap(specs[0], specs[1]);
  const Vec3 turned_first = Parameters(scene, specs).apply({90, 1}).positions[1];
  EXPECT_NEAR(length(turned_first - Vec3{2, 2, 0}), 0, 1e-15 * 8);
}

TEST(Parameters, NormalsAreAreaWeighted) {
  const Scene scene = two_shapes(true);
  ParameterSpec dent = spec("dent", ParameterType::vertices, "tetra", 0);
  dent.direction_kind = VertexDirection::normal;
  // At the origin three faces meet: areas 1 (z = 0), 3/2 (y = 0), 3 (x = 0), all facing outwards.
  const Vec3 expected = normalize(Vec3{-3, -1.5, -1});
  const Vec3 moved = Parameters(scene, {dent}).apply({1, 0, 0, 0}).positions[0];
  EXPECT_NEAR(length(moved - expected), 0, 1e-15);
}

TEST(Parameters, ComponentsAndPoints) {
  const Scene scene = two_shapes(true);
  const Parameters parameters(scene, every_kind());
  EXPECT_EQ(parameters.component_names()[0], "move");
  EXPECT_EQ(parameters.component_names()[2], "dent[1]");
  const std::vector<double> theta = parameters.parse_point("move=0.7,dent=0.25,free[4]=-1");
  EXPECT_EQ(theta[0], 0.7);
  EXPECT_EQ(theta[1], 0.25);
  EXPECT_EQ(theta[2], 0.25);
  EXPECT_EQ(theta[3], 25);
  EXPECT_EQ(theta[4 + 4], -1);
  EXPECT_THROW(parameters.parse_point("nothing=1"), InputError);
  EXPECT_THROW(parameters.parse_point("move"), InputError);
  EXPECT_THROW(parameters.parse_point("move=1e400"), InputError);
  EXPECT_THROW(parameters.parse_point("colour=1.5"), InputError);
  EXPECT_THROW(parameters.parse_point(""), InputError);
}

TEST(Parameters, PointsAreReadWithBlanksAndWithoutRepetition) {
  const Scene scene = two_shapes(true);
  const Parameters parameters(scene, every_kind());
  EXPECT_EQ(parameters.parse_point(" move = 0.7 , dent[1]\t= 0.5"), parameters.parse_point("move=0.7,dent[1]=0.5"));
  EXPECT_EQ(parameters.parse_point("target , move = 0.7"), parameters.parse_point("target,move=0.7"));
  EXPECT_THROW(parameters.parse_point("move = "), InputError);
  EXPECT_THROW(parameters.parse_point("move=0.1 0.2"), InputError);
  EXPECT_THROW(parameters.parse_point("move=0.1,dent=0.2,move=0.1"), InputError);
  EXPECT_EQ(parameters.parse_point("dent=0.25,dent[1]=0.5")[2], 0.5);
  // Coordinates that Embree does not survive.
  EXPECT_NO_THROW(parameters.parse_point("move=1e11"));
  EXPECT_THROW(parameters.parse_point("move=1e25"), InputError);
}

TEST(Parameters, SelectedColumnsAreThoseOfTheWhole) {
  const Scene scene = two_shapes(true);
  const Parameters parameters(scene, every_kind());
  const TangentBasis whole = parameters.tangent(parameters.initial());
  std::vector<double> y(DofLayout(scene).size());
  for (std::size_t i = 0; i < y.size(); ++i) y[i] = std::sin(1.0 + static_cast<double>(i));
  const std::vector<double> all = whole.transpose_apply(y);
  const std::vector<double> some = select_columns(whole, 2, 5).transpose_apply(y);
  EXPECT_EQ(some, std::vector<double>(all.begin() + 2, all.begin() + 7));
}

TEST(Parameters, RejectWhatDoesNotFitTheScene) {
  const Scene scene = two_shapes(true);
  const auto message = [&](const ParameterSpec& s) -> std::string {
    try {
      Parameters(scene, {s});
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  ParameterSpec s = spec("p", ParameterType::translation, "cube", 0);
  EXPECT_EQ(message(s), "parameter p: shape: there is no shape 'cube' in the scene (allowed: tetra, quad)");
  s = of_material("p", "roughness", "white", 0.2);
  EXPECT_EQ(message(s), "parameter p: material: material 'white' is diffuse and has no roughness");
  s = of_material("p", "albedo", "gold", 0.2);
  EXPECT_EQ(message(s),
            "parameter p: material: there is no material 'gold' in the scene (allowed: white, metal, glass)");
  s = spec("p", ParameterType::translation, "tetra", 0);
  s.selection = {Selection::Kind::box, {}, {5, 5, 5}, {6, 6, 6}};
  EXPECT_EQ(message(s), "parameter p: selection: selects no vertex of shape 'tetra'");
  s.selection = {Selection::Kind::list, {4}, {}, {}};
  EXPECT_EQ(message(s), "parameter p: selection: there is no vertex 4 in shape 'tetra' (0 to 3)");
  s.selection = {Selection::Kind::list, {2, 2}, {}, {}};
  EXPECT_EQ(message(s), "parameter p: selection: vertex 2 is listed twice");
  s = of_material("p", "ior", "metal", 1.5);
  EXPECT_EQ(message(s), "parameter p: material: material 'metal' is rough_conductor and has no ior");
  s = of_material("p", "albedo", "glass", 0.5);
  EXPECT_EQ(message(s), "parameter p: material: material 'glass' is rough_dielectric and has no albedo");
  // An index keeps to its side of one.
  s = of_material("p", "ior", "glass", 1.5);
  s.target = {0.9};
  EXPECT_EQ(message(s), "parameter p: target: 0.9 is out of bounds (1.001 to inf)");
  s = of_material("p", "ior", "glass", 0.7);
  s.target = {1};
  EXPECT_EQ(message(s), "parameter p: target: 1 is out of bounds (0.001 to 0.999)");
  s = of_material("p", "albedo", "white", 1.2);
  EXPECT_EQ(message(s), "parameter p: initial: 1.2 is out of bounds (0.0001 to 1)");
  s = of_material("p", "albedo", "white", 0.5);
  s.target = {0.2};
  s.lower = {0.3};
  EXPECT_EQ(message(s), "parameter p: target: 0.2 is out of bounds (0.3 to 1)");
  s = spec("p", ParameterType::emission, "quad", 0);
  EXPECT_EQ(message(s), "parameter p: initial: is no emission (a number above 0)");
  s = spec("p", ParameterType::rotation, "quad", 0);
  s.axis = {0, 0, 1};
  s.initial = {1, 2};
  EXPECT_EQ(message(s), "parameter p: initial: 2 values are given (1)");
}

}  // namespace
}  // namespace isochron
