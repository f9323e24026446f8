// Paths under construction, and scenes that have none.
#include "core/paths/path.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/render/support.h"

namespace isochron::testing {
namespace {

TEST(FixedStack, RefusesWhatItHasNoRoomFor) {
  FixedStack<int> stack(2);
  stack.start(1);
  stack.push_back(2);
  EXPECT_THROW(stack.push_back(3), std::logic_error);
  EXPECT_EQ(stack.size(), 2u);
  stack.pop_back();
  stack.push_back(4);
  EXPECT_EQ(stack.back(), 4);
}

/// Through the library: scene files have shapes.
TEST(EmptyScene, IsDark) {
  const Scene scene;
  const PreparedScene prepared(scene, nullptr);
  for (const auto part : {PreparedScene::Part::all, PreparedScene::Part::moving, PreparedScene::Part::emitting}) {
    std::vector<int> triangles;
    prepared.hierarchy(part).query_surfaces({0, 0, 0}, {1, 0, 0}, 1, 2, triangles);
    EXPECT_TRUE(triangles.empty());
  }
  Scene lit = scene;
  lit.camera.width = lit.camera.height = 4;
  PointLight light;
  light.position = {1, 1, 1};
  lit.lights.push_back(light);
  const GateSet gates(GateShape::gaussian(0.1), {2});
  for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
    const GatedImage image = Renderer(lit, gates, {.max_bounces = 2, .sampling = sampling}).render({}, {0, 4});
    for (const double value : image.data) EXPECT_EQ(value, 0);
  }
}

}  // namespace
}  // namespace isochron::testing
