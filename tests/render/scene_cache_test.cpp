// Scenes kept from one evaluation to the next: the same bits as rebuilt scenes, whatever was rendered in between, and work
// only for what has moved.
#include "core/render/scene_cache.h"

#include <gtest/gtest.h>

#include "core/geometry/mesh_intersections.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

/// The validation scene with a block that the floor cuts through: a line where meshes intersect.
Scene small_box() {
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  scene.camera.width = scene.camera.height = 12;
  return scene;
}

std::vector<Motion> motions(const Scene& scene) {
  return {translate(scene, "block", {0.3, -1, 0.2}), rotate_y(scene, "panel", {0, 0, 0}),
          change_material(scene, "block", "albedo"), change_emission(scene, "light"), change_emission(scene, "block")};
}

Scene at(const Scene& scene, const std::vector<Motion>& all, const std::vector<double>& theta) {
  Scene moved = scene;
  for (std::size_t i = 0; i < all.size(); ++i) all[i].apply(moved, theta[i]);
  return moved;
}

/// Images and the gradient of every term, one after the other.
std::vector<double> everything(const Renderer& renderer, const Scene& scene, const GateSet& gates) {
  GatedImage image = renderer.render({1, 0, 0}, {0, 4});
  std::vector<double> result = image.data;
  GatedImage adjoint(scene.camera.width, scene.camera.height, gates.size(), image.channels);
  for (std::size_t i = 0; i < adjoint.data.size(); ++i) adjoint.data[i] = 0.1 + static_cast<double>(i % 7);
  for (const Term term : kTerms) {
    std::vector<double> gradient(DofLayout(scene).size(), 0.0);
    renderer.add_gradient(term, adjoint, {1, 0, 1}, {0, 4}, gradient);
    result.insert(result.end(), gradient.begin(), gradient.end());
  }
  return result;
}

/// One twice in a row, with the block going through the floor; in another the block becomes a lamp.
const std::vector<std::vector<double>> kPoints = {
    {0, 0, 0, 0, 0},        {0.1, 0.3, 0, 0, 0}, {0.45, 0.3, 0, 0, 0},     {0.45, 0.3, 0, 0, 0},
    {0.45, 0.3, 0.1, 2, 0}, {0, 0, 0, 0, 0},     {-0.2, -0.1, 0.05, 1, 0}, {-0.2, -0.1, 0.05, 1, 3}};

/// The box, what moves in it, and gates.
struct CacheSetting {
  Scene scene = small_box();
  std::vector<Motion> all = motions(scene);
  TangentBasis basis = make_basis(scene, all);
  GateSet gates{GateShape::boxcar(0.6), {5.0, 6.0}};
};

class Kept : public ::testing::TestWithParam<Sampling> {};

TEST_P(Kept, GivesTheBitsOfAFreshOne) {
  const auto [scene, all, basis, gates] = CacheSetting();
  const EstimatorOptions options{.max_bounces = 3, .sampling = GetParam(), .guiding_samples = 8};
  SceneCache cache(scene, CasterUpdate::rebuild);
  std::size_t intersections = 0;
  for (const auto& theta : kPoints) {
    const Scene moved = at(scene, all, theta);
    intersections = std::max(intersections, MeshIntersections(moved, ray_offset(moved)).segments().size());
    EXPECT_EQ(everything(Renderer(moved, gates, options, &basis, &cache), moved, gates),
              everything(Renderer(moved, gates, options, &basis), moved, gates));
  }
  EXPECT_GT(intersections, 0u);
}

INSTANTIATE_TEST_SUITE_P(, Kept, ::testing::Values(Sampling::standard, Sampling::ellipsoidal), [](const auto& test) {
  return test.param == Sampling::standard ? "Standard" : "Ellipsoidal";
});

TEST(KeptAndRefitted, DoesNotDependOnWhatCameBefore) {
  const CacheSetting rigid;
  const EstimatorOptions options{.max_bounces = 3, .sampling = Sampling::standard};
  for (const bool deforms : {false, true}) {
    auto [scene, all, basis, gates] = rigid;
    scene.shapes[scene.find_shape("block")].deforms = deforms;
    SceneCache cache(scene, CasterUpdate::refit);
    for (const auto& theta : kPoints) {
      const Scene moved = at(scene, all, theta);
      SceneCache fresh(scene, CasterUpdate::refit);
      const auto kept = everything(Renderer(moved, gates, options, &basis, &cache), moved, gates);
      EXPECT_EQ(kept, everything(Renderer(moved, gates, options, &basis, &fresh), moved, gates));
      // Rays meet the same triangles as those of a rebuilt hierarchy.
      EXPECT_EQ(kept, everything(Renderer(moved, gates, options, &basis), moved, gates));
    }
  }
}

TEST(KeptScenes, TimesOfPassesGoToTheirKind) {
  const auto [scene, all, basis, gates] = CacheSetting();
  SceneCache cache(scene, CasterUpdate::rebuild);
  const auto seconds = [&](PassKind kind) { return cache.times().seconds(kind); };
  const Renderer renderer(scene, gates, {.max_bounces = 2, .guiding_samples = 8}, &basis, &cache);
  EXPECT_GT(seconds(PassKind::scene), 0);
  EXPECT_EQ(seconds(PassKind::primal), 0);
  const GatedImage image = renderer.render({1, 0, 0}, {0, 4});
  EXPECT_GT(seconds(PassKind::primal), 0);
  for (const Term term : kTerms) {
    EXPECT_EQ(seconds(pass_kind(term)), 0);
    EXPECT_EQ(seconds(PassKind::edges) > 0, term == Term::path_length);  // that of visibility has been
    std::vector<double> gradient(DofLayout(scene).size(), 0.0);
    renderer.add_gradient(term, image, {1, 0, 1}, {0, 4}, gradient);
    const double once = seconds(pass_kind(term));
    EXPECT_GT(once, 0);
    renderer.derive(term, {1, 0, 1}, {0, 4});
    EXPECT_GT(seconds(pass_kind(term)), once);
  }
}

TEST(KeptScenes, TwoAtATimeDoNotMeet) {
  const auto [scene, all, basis, gates] = CacheSetting();
  const EstimatorOptions options{.max_bounces = 2, .sampling = Sampling::standard};
  SceneCache cache(scene, CasterUpdate::rebuild);
  const Scene a = at(scene, all, kPoints[1]), b = at(scene, all, kPoints[3]);
  const Renderer first(a, gates, options, &basis, &cache);
  const auto before = everything(first, a, gates);
  {
    const Renderer second(b, gates, options, &basis, &cache), images(b, gates, options, nullptr, &cache);
    EXPECT_NE(everything(second, b, gates), before);
    EXPECT_EQ(images.render({1, 0, 0}, {0, 4}).data, second.render({1, 0, 0}, {0, 4}).data);
  }
  EXPECT_EQ(everything(first, a, gates), before);
}

TEST(PreparedScene, TouchesWhatMovedAlone) {
  const auto [scene, all, basis, gates] = CacheSetting();
  PreparedScene prepared(scene, &basis);
  const int before = prepared.revision();
  prepared.update(at(scene, all, {0.1, 0, 0, 0, 0}), &basis, {});
  const int block = scene.find_shape("block");
  for (std::size_t t = 0; t < scene.triangles.size(); ++t)
    EXPECT_EQ(prepared.changed(static_cast<int>(t)) > before, scene.triangles[t].shape == block) << t;
}

}  // namespace
}  // namespace isochron::testing
