// Scenes of more triangles than the caches hold, whose paths take turns.
#include <gtest/gtest.h>

#include <cmath>

#include "subdivision.h"
#include "support.h"

namespace isochron::testing {
namespace {

// Cut into small triangles, the scene is the same: so are all paths, drawn by the same numbers, but for rounding. The lamp
// stays whole, as the choice of its triangles takes up the numbers. Where a ray just misses an edge in one scene and hits it
// in the other a pixel changes: 2 or 3 of 256, by more than a ten-thousandth of the picture's mean. Less is the rounding of what
// cancels or of a gate's tail. A Poisson number of mean 3 exceeds 16 with a probability of 4e-9 (false alarms); a path in
// another's place, pixel or numbers changes all that are lit.
TEST(LargeScene, TheSamePicturesAsInLargeTriangles) {
  const Scene coarse = load_scene(TEST_DATA "/validation/scene.yaml"), fine = subdivided(coarse, 30, "light");
  ASSERT_LT(coarse.triangles.size(), 100u);
  ASSERT_GT(fine.triangles.size(), 10'000u);
  const GateSet gates(GateShape::gaussian(0.2), {4.9, 5.3, 5.8});
  const auto run = [&](const Scene& scene) {
    const TangentBasis basis =
        make_basis(scene, {translate(scene, "block", {0.5, 0, 1}), change_material(scene, "grey", "albedo")});
    const Renderer renderer(scene, gates, {.max_bounces = 4, .sampling = Sampling::standard}, &basis);
    std::vector<GatedImage> images = renderer.derive(Term::interior, {5, 0, 1}, {0, 8});
    images.push_back(renderer.render({5, 0, 0}, {0, 8}));
    return images;
  };
  const std::vector<GatedImage> a = run(coarse), b = run(fine);
  for (std::size_t k = 0; k < a.size(); ++k) {
    const std::size_t values = a[k].data.size();
    double mean = 0;
    for (const double x : a[k].data) mean += std::abs(x) / static_cast<double>(values);
    int lit = 0, other = 0;  // pixels
    for (std::size_t pixel = 0; pixel < values; pixel += gates.size()) {
      bool is_lit = false, differs = false;
      for (std::size_t i = pixel; i < pixel + gates.size(); ++i) {
        is_lit |= a[k].data[i] != 0;
        differs |= std::abs(a[k].data[i] - b[k].data[i]) > 1e-4 * mean;
      }
      lit += is_lit;
      other += differs;
    }
    EXPECT_GT(lit, 80) << k;
    EXPECT_LE(other, 16) << k;
  }
}

}  // namespace
}  // namespace isochron::testing
