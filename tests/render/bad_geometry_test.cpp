// Scenes and gates in which there is nothing to see, or in which parameters have gone too far.
#include <gtest/gtest.h>

#include "core/render/measure_mix.h"
#include "scene_building.h"
#include "support.h"

namespace isochron::testing {
namespace {

struct Everything {
  std::vector<double> numbers;
  int non_zero = 0, not_finite = 0;
};

Everything run_everything(const Scene& scene, const GateSet& gates, Sampling sampling, const TangentBasis& basis,
                          int samples = 16) {
  EstimatorOptions options{.max_bounces = 3, .sampling = sampling};
  if (sampling == Sampling::automatic)
    options.mix = measure_mix(scene, gates, options, &basis, {1, 0, 2}, Purpose::gradients);
  const Renderer renderer(scene, gates, options, &basis);
  Everything all;
  const GatedImage image = renderer.render({1, 0, 0}, {0, samples});
  all.numbers = image.data;
  GatedImage adjoint = image;
  std::fill(adjoint.data.begin(), adjoint.data.end(), 1.0);
  for (const Term term : kTerms) {
    for (const GatedImage& d : renderer.derive(term, {1, 0, 1}, {0, samples}))
      all.numbers.insert(all.numbers.end(), d.data.begin(), d.data.end());
    std::vector<double> gradient(DofLayout(scene).size(), 0.0);
    renderer.add_gradient(term, adjoint, {1, 0, 1}, {0, samples}, gradient);
    all.numbers.insert(all.numbers.end(), gradient.begin(), gradient.end());
  }
  for (double x : all.numbers) {
    all.non_zero += x != 0;
    all.not_finite += !std::isfinite(x);
  }
  return all;
}

class BadGeometry : public ::testing::TestWithParam<Sampling> {
 protected:
  BadGeometry() : scene_(load_scene(TEST_DATA "/validation/scene.yaml")) {
    scene_.camera.width = scene_.camera.height = 8;
  }
  TangentBasis basis() const {
    return make_basis(scene_, {translate(scene_, "block", {1, 0.3, 0}), translate(scene_, "panel", {0, 1, 0}),
                               translate(scene_, "light", {0, 1, 0.5}), change_material(scene_, "grey", "albedo")});
  }
  Scene scene_;
};

TEST_P(BadGeometry, GatesThatNoPathReachesAreExactlyDark) {
  const GateShape shapes[] = {GateShape::boxcar(0.3), GateShape::gaussian(0.05),
                              GateShape::truncated_gaussian(0.1, 0.2)};
  for (const GateShape& shape : shapes)
    // Shorter than any path, longer than any of three bounces, and partly below zero.
    for (const std::vector<double>& centers : {std::vector<double>{1.0, 1.2}, {60.0}, {0.0, 0.1}, {-3.0}}) {
      const GateSet gates(shape, centers);
      const Everything all = run_everything(scene_, gates, GetParam(), basis());
      EXPECT_EQ(all.not_finite, 0);
      EXPECT_EQ(all.non_zero, 0) << "centre " << centers[0];
    }
}

TEST_P(BadGeometry, FlattenedTrianglesGiveFiniteResults) {
  const GateSet gates(GateShape::truncated_gaussian(0.2, 0.4), {4.9, 5.6});
  const int lit = run_everything(scene_, gates, GetParam(), basis()).non_zero;
  ASSERT_GT(lit, 100);
  const Shape& panel = scene_.shapes[scene_.find_shape("panel")];
  const Shape& block = scene_.shapes[scene_.find_shape("block")];
  const Shape& light = scene_.shapes[scene_.find_shape("light")];
  const Scene whole = scene_;
  const auto check = [&](const char* what, bool dark = false) {
    const Everything all = run_everything(scene_, gates, GetParam(), basis());
    EXPECT_EQ(all.not_finite, 0) << what;
    if (dark) {
      EXPECT_EQ(all.non_zero, 0) << what;
    } else {
      EXPECT_GT(all.non_zero, 100) << what;
    }
    scene_ = whole;
  };
  scene_.positions[panel.first_vertex + 4] = scene_.positions[panel.first_vertex];
  check("two corners at one place");
  for (int axis = 0; axis < 3; ++axis)
    scene_.positions[panel.first_vertex][axis] =
        0.5 * (whole.positions[panel.first_vertex + 4][axis] + whole.positions[panel.first_vertex + 1][axis]);
  check("a corner on the opposite edge");
  for (int v = 0; v < block.vertex_count; ++v) scene_.positions[block.first_vertex + v].y = -0.5;
  check("a block without height");
  for (int v = 0; v < block.vertex_count; ++v) scene_.positions[block.first_vertex + v] = {-0.2, -0.5, 0.1};
  check("a block that is a point");
  scene_.positions[light.first_vertex + 2] = scene_.positions[light.first_vertex];
  check("a lamp without area", true);
  scene_.positions[light.first_vertex + 1] = scene_.positions[light.first_vertex];
  check("half a lamp without area");
  for (int v = 0; v < block.vertex_count; ++v) scene_.positions[block.first_vertex + v] += Vec3{0, 0, 1.6};
  check("a block through the others");
  // A camera on a surface sees nothing but that surface, at no distance: dark or not, but finite.
  scene_.camera.position = whole.positions[panel.first_vertex];
  EXPECT_EQ(run_everything(scene_, gates, GetParam(), basis()).not_finite, 0);
}

TEST_P(BadGeometry, EdgeOnFacesGiveFiniteResults) {
  const GateSet gates(GateShape::truncated_gaussian(0.2, 0.4), {4.9, 5.6});
  const Shape& block = scene_.shapes[scene_.find_shape("block")];
  const Shape& light = scene_.shapes[scene_.find_shape("light")];
  const Vec3 camera = scene_.camera.position, look_at = scene_.camera.look_at;
  int places = 0, lit = 0;
  const auto check = [&](const char* what, const Vec3& position) {
    scene_.camera.position = position;
    const Everything all = run_everything(scene_, gates, GetParam(), basis());
    EXPECT_EQ(all.not_finite, 0) << what;
    ++places;
    lit += all.non_zero > 100;
  };
  // Exactly, as all heights of the plane are the same number.
  double top = -INFINITY;
  for (int i = 0; i < block.vertex_count; ++i) top = std::max(top, scene_.positions[block.first_vertex + i].y);
  check("the plane of the block's top", {camera.x, top, camera.z});
  check("the plane of the light", {camera.x, scene_.positions[light.first_vertex].y, camera.z});
  // An upright edge, from straight above: its direction and the ray's are the same numbers.
  int upright = 0;
  for (int i = 0; i < block.vertex_count; ++i)
    for (int j = 0; j < block.vertex_count; ++j) {
      const Vec3 low = scene_.positions[block.first_vertex + i], high = scene_.positions[block.first_vertex + j];
      if (!(low.x == high.x && low.z == high.z && low.y < high.y)) continue;
      scene_.camera.look_at = high + Vec3{0.05, 0, 0};
      check("an upright edge from above", {high.x, high.y + 0.25, high.z});
      ++upright;
    }
  EXPECT_EQ(upright, 4);
  scene_.camera.look_at = look_at;
  for (const int t : {0, 3, 6}) {
    const auto& v = scene_.triangles[block.first_triangle + t].vertex;
    const Vec3 p = scene_.positions[v[0]], q = scene_.positions[v[1]], r = scene_.positions[v[2]];
    const Vec3 n = normalize(cross(q - p, r - p));
    check("a plane of the block", camera - n * dot(n, camera - p));
    check("an edge seen as a point", p + (p - q) * 2.0);
    check("an edge seen as a point from its other end", q + (q - p) * 2.0);
  }
  EXPECT_GE(lit, places / 2);  // some are outside of the room
}

TEST_P(BadGeometry, SceneWithoutLampIsDark) {
  scene_.shapes[scene_.find_shape("light")].emission = {};
  const TangentBasis moving = basis();
  EXPECT_EQ(run_everything(scene_, GateSet(GateShape::boxcar(0.5), {5.0}), GetParam(), moving).non_zero, 0);
  EXPECT_EQ(run_everything(scene_, GateSet(GateShape::steady(), {0}), GetParam(), moving).non_zero, 0);
}

/// A flap on a floor, at 45 degrees, so far from the origin that rays, which are traced in single precision,
/// start 0.004 off their surface: next to the crease that is behind the flap, whose back they may meet. That
/// point lies behind them, so the path through both seems impossible, from either end. The camera sees that
/// back, and the shadow of the rim ends in the crease.
TEST_P(BadGeometry, PathsAcrossACreaseAreFinite) {
  Scene scene;
  scene.camera = {.position = {-1, 2, 0}, .look_at = {0.1, 0.1, 0}, .fov = 30, .width = 8, .height = 8};
  const Material grey = diffuse(Rgb(0.7), true);
  add_shape(scene, "floor", quad({0, 0, -0.5}, {0, 0, 0.5}, {1, 0, 0.5}, {1, 0, -0.5}), grey);
  add_shape(scene, "flap", quad({0, 0, -0.5}, {0, 0, 0.5}, {0.5, 0.5, 0.5}, {0.5, 0.5, -0.5}), grey);
  add_shape(scene, "lamp", quad({2, 1.5, -0.5}, {2, 1.5, 0.5}, {1.5, 2, 0.5}, {1.5, 2, -0.5}), diffuse(Rgb(0)),
            Rgb(10));
  const Vec3 away{4000, 0, 0};
  for (Vec3& p : scene.positions) p += away;
  scene.camera.position += away;
  scene.camera.look_at += away;
  const TangentBasis moving = make_basis(scene, {translate(scene, "flap", {0, 1, 0})});
  const GateSet gates(GateShape::truncated_gaussian(0.2, 0.4), {5.0});
  EstimatorOptions options{.max_bounces = 3, .sampling = GetParam()};
  if (GetParam() == Sampling::automatic)
    options.mix = measure_mix(scene, gates, options, &moving, {1, 0, 2}, Purpose::gradients);
  const Renderer renderer(scene, gates, options, &moving);
  const GatedImage d = renderer.derive(Term::visibility, {41, 0, 2}, {0, 4096})[0];
  int lit = 0;
  for (const double x : d.data) {
    EXPECT_TRUE(std::isfinite(x));
    lit += x != 0;
  }
  EXPECT_GT(lit, 8);
}

INSTANTIATE_TEST_SUITE_P(, BadGeometry,
                         ::testing::Values(Sampling::standard, Sampling::ellipsoidal, Sampling::automatic),
                         [](const auto& test) {
                           return std::string(test.param == Sampling::standard      ? "Standard"
                                              : test.param == Sampling::ellipsoidal ? "Ellipsoidal"
                                                                                    : "Automatic");
                         });

}  // namespace
}  // namespace isochron::testing
