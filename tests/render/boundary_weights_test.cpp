// Multiple importance sampling of boundary segments: the parts that those techniques take which could have found a segment add
// up to one. Segments are found from edges; each is then looked for from the camera, along the same vertices. The two sides
// multiply the densities of the walk between in different order.
#include <gtest/gtest.h>

#include "core/techniques/secondary_boundary.h"
#include "support.h"
#include "tests/seed.h"

namespace isochron {

/// Sees what SecondaryBoundary knows of a segment.
class BoundaryWeights {
 public:
  BoundaryWeights(Worker& worker, const BoundaryEdges& edges, const BoundaryGuide& guide)
      : worker_(worker), edges_(edges), boundary_(worker, edges, guide, true) {}

  /// A segment from an edge, by a random direction in its wedge: f(bounces up to D, densities as seen from the edge and from the camera) for
  /// each way on to the camera.
  template <class F>
  void look_from_edge(int pixel, Rng& rng, F&& f) {
    SecondaryBoundary::Segment g;
    g.y = edges_.sample_secondary(boundary_.edge_warp().sample(rng.uniform()));
    const double u0 = rng.uniform(), u1 = rng.uniform();
    g.w = SecondaryBoundary::direction_in_wedge(g.y, u0, u1);
    if (!g.orient() || !boundary_.find_light_end(g) || !boundary_.find_camera_end(g)) return;
    boundary_.connections_.clear();
    boundary_.walk_to_camera(g, pixel, 1, worker_.options.max_bounces, rng);
    const auto connections = boundary_.connections_;
    const auto walk = boundary_.walk_;
    for (const auto& c : connections) {
      SecondaryBoundary::Segment h;
      h.y = g.y;
      if (!look_from_camera(h, c.pixel, {walk.data(), static_cast<std::size_t>(c.bounces)})) continue;
      const auto& d = boundary_.connections_[0];
      const double in_line = boundary_.draw_in_line(g, c, c.length + g.r_d + g.r_s, rng);
      f(c.bounces, boundary_.densities(g, c, c.length + g.r_d + g.r_s, in_line),
        boundary_.densities(h, d, d.length + h.r_d + h.r_s, in_line));
    }
  }

 private:
  /// `walk`: D first, then towards the camera.
  bool look_from_camera(SecondaryBoundary::Segment& h, int pixel, std::span<const SurfacePoint> walk) {
    worker_.start_at_sensor(worker_.path, pixel);
    for (std::size_t i = walk.size(); i-- > 0;) worker_.path.push(worker_.scene, walk[i]);
    boundary_.camera_densities_ = {};
    for (int bounce = 1; bounce < static_cast<int>(walk.size()); ++bounce) boundary_.extend_camera_densities(bounce);
    return boundary_.join_camera_path(h, pixel, Rgb(1.0));
  }

  Worker& worker_;
  const BoundaryEdges& edges_;
  SecondaryBoundary boundary_;
};

namespace testing {
namespace {

struct NoSink final : Sink {
  bool differential() const override { return true; }
  void add(int, const Rgb&, double, GateUse) override {}
};

/// One that has learned that some edges count more, by whichever technique.
BoundaryGuide uneven_guide() {
  BoundaryGuide::Each<double> cost;
  cost.fill(1000);
  std::vector<GuideRecord> records;
  Rng rng(Stream{test_seed(11), 0, 0}, 0, 0);
  for (const Technique technique : {Technique::from_edge, Technique::from_camera})
    for (int i = 0; i < 500; ++i) {
      const double u = rng.uniform();
      records.push_back({BoundaryGuide::table(technique), u * u, technique == Technique::from_edge ? 1.0 : 3.0, u});
    }
  return {{true, false, true, false, true}, records, cost};
}

TEST(BoundaryWeights, AddUpToOne) {
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  scene.camera.width = scene.camera.height = 8;
  replace_material(scene, "panel", conductor(Rgb(0.7), 0.4, true));
  const TangentBasis basis = make_basis(scene, {translate(scene, "block", {0.3, 1, 0.2})});
  const PreparedScene prepared(scene, &basis);
  const GateSet gates(GateShape::gaussian(0.5), {5.0, 5.5, 6.0});
  GatedImage adjoint(8, 8, 3, 1);
  Rng uneven(Stream{test_seed(12), 0, 0}, 0, 0);
  for (double& x : adjoint.data) x = 0.1 + uneven.uniform();
  const GatePick pick(gates, {&adjoint, 1}, true, 1);
  const EstimatorOptions options{.max_bounces = 3};
  NoSink sink;
  Worker worker(prepared, gates, options, pick, sink);
  const BoundaryEdges edges(prepared);
  const BoundaryGuide guide = uneven_guide();
  ASSERT_NE(guide.rate(Technique::from_edge), guide.rate(Technique::from_camera));
  BoundaryWeights weights(worker, edges, guide);
  int found[4] = {0, 0, 0, 0}, shared[4] = {0, 0, 0, 0}, from_camera_at_length = 0, from_edge_at_length = 0;
  for (int i = 0; i < 100000; ++i) {
    Rng rng(Stream{test_seed(13), 0, 0}, i, 0);
    weights.look_from_edge(0, rng, [&](int bounces, const BoundaryDensities& here, const BoundaryDensities& there) {
      const double edge = here.of_edge(), edge_at_length = edge * here.edge_at_length;
      const double camera = there.of_camera(), camera_at_length = camera * there.camera_at_length;
      EXPECT_NEAR(edge + edge_at_length + camera + camera_at_length, 1, 1e-8) << bounces << " bounces";
      EXPECT_NEAR(here.camera_part(), camera + camera_at_length, 1e-8);
      ++found[bounces];
      shared[bounces] += std::min(edge, camera) > 0.01;
      from_camera_at_length += camera_at_length > 0.01;
      from_edge_at_length += edge_at_length > 0.01;
    });
  }
  for (int bounces = 1; bounces <= 3; ++bounces) {
    EXPECT_GT(found[bounces], 100) << bounces;
    EXPECT_GT(shared[bounces], 50) << bounces;
  }
  EXPECT_GT(from_camera_at_length, 20);
  EXPECT_GT(from_edge_at_length, 20);
}

}  // namespace
}  // namespace testing
}  // namespace isochron
