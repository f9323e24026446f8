#include "core/techniques/boundary_edges.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "core/base/random.h"
#include "scene_building.h"
#include "support.h"

namespace isochron::testing {
namespace {

Scene cube_scene() {
  Scene scene;
  scene.camera.position = {0, 0, 5};
  add_shape(scene, "cube", box({-1, -1, -1}, {1, 1, 1}), diffuse(Rgb(0.5)));
  return scene;
}

using Pair = std::pair<int, int>;

/// The edges that come up, with how often they do, out of `n` evenly spread numbers.
template <class Draw>
std::map<Pair, int> tally(int n, Draw&& draw) {
  std::map<Pair, int> counts;
  for (int i = 0; i < n; ++i) {
    const BoundaryEdges::Sample s = draw((i + 0.5) / n);
    ++counts[{s.edge->vertex[0], s.edge->vertex[1]}];
  }
  return counts;
}

TEST(BoundaryEdges, OfACube) {
  const Scene scene = cube_scene();
  ASSERT_EQ(scene.edges.size(), 18u);  // twelve, and six diagonals
  const PreparedScene prepared(scene, nullptr);
  const BoundaryEdges edges(prepared);
  EXPECT_FALSE(edges.has_primary()) << "nothing moves";
  ASSERT_TRUE(edges.has_secondary());
  const int n = 24000;
  const auto counts = tally(n, [&](double u) {
    const auto s = edges.sample_secondary(u);
    const BoundaryEdge& e = *s.edge;
    EXPECT_NEAR(length(e.end - e.origin - s.tangent * 2), 0, 1e-14);
    EXPECT_NEAR(e.azimuths, kPi / 2, 1e-14);
    EXPECT_NEAR(s.pdf, 1.0 / 24, 1e-14) << "per length, all edges alike";
    EXPECT_NEAR(length(s.y - (e.origin + s.tangent * (s.s * 2))), 0, 1e-14);
    for (int i = 0; i < 2; ++i) {
      // Along the face, off the edge, towards the cube's middle.
      EXPECT_NEAR(dot(e.inward[i], s.tangent), 0, 1e-14);
      EXPECT_NEAR(dot(e.inward[i], prepared.normal(e.face[i])), 0, 1e-14);
      EXPECT_NEAR(length(e.inward[i]), 1, 1e-14);
      EXPECT_LT(dot(e.inward[i], s.y), -0.9);
    }
    return s;
  });
  EXPECT_EQ(counts.size(), 12u);
  for (const auto& [edge, count] : counts) {
    EXPECT_EQ(std::popcount(static_cast<unsigned>(edge.first ^ edge.second)), 1) << "no diagonal";
    EXPECT_NEAR(count, n / 12, 1);
  }
}

TEST(BoundaryEdges, SlantedRoofAndBorders) {
  // Two slopes of 30 degrees: one ridge of dihedral opening 120 degrees, six border edges.
  const double rise = std::tan(kPi / 6);
  Mesh roof{{{-1, 0, -1}, {-1, 0, 1}, {0, rise, -1}, {0, rise, 1}, {1, 0, -1}, {1, 0, 1}},
            {{0, 1, 3}, {0, 3, 2}, {2, 3, 5}, {2, 5, 4}}};
  Scene scene;
  scene.camera.position = {0, 5, 0.1};
  add_shape(scene, "roof", roof, diffuse(Rgb(0.5)));
  const TangentBasis basis = make_basis(scene, {translate(scene, "roof", {0, 1, 0})});
  const PreparedScene prepared(scene, &basis);
  const BoundaryEdges edges(prepared);
  std::set<Pair> secondary, primary;
  for (int i = 0; i < 7000; ++i) {
    const auto s = edges.sample_secondary((i + 0.5) / 7000);
    const BoundaryEdge& e = *s.edge;
    secondary.insert({e.vertex[0], e.vertex[1]});
    if (e.vertex[0] == 2 && e.vertex[1] == 3) {
      EXPECT_EQ(e.faces(), 2);
      EXPECT_NEAR(e.azimuths, kPi / 3, 1e-14);
    } else {
      EXPECT_EQ(e.faces(), 1);
      EXPECT_EQ(e.azimuths, kPi);
    }
    const auto p = edges.sample_primary((i + 0.5) / 7000);
    primary.insert({p.edge->vertex[0], p.edge->vertex[1]});
  }
  const std::set<Pair> expected{{2, 3}, {0, 1}, {4, 5}, {0, 2}, {1, 3}, {2, 4}, {3, 5}};
  EXPECT_EQ(secondary, expected);
  EXPECT_EQ(primary, expected);
}

TEST(BoundaryEdges, DensityIsTheFrequency) {
  Scene scene = cube_scene();
  for (Vec3& p : scene.positions) p = {p.x * 0.3 + 0.1 * p.y, p.y * 1.7, p.z + 0.4 * p.x};
  add_shape(scene, "still", box({3, -1, -1}, {4, 1, 1}), diffuse(Rgb(0.5)));
  const TangentBasis basis = make_basis(scene, {translate(scene, "cube", {0, 1, 0})});
  const PreparedScene prepared(scene, &basis);
  const BoundaryEdges edges(prepared);
  const int n = 200000;
  for (const bool primary : {true, false}) {
    std::map<Pair, double> density;
    const auto counts = tally(n, [&](double u) {
      const auto s = primary ? edges.sample_primary(u) : edges.sample_secondary(u);
      density[{s.edge->vertex[0], s.edge->vertex[1]}] = s.pdf * length(s.edge->end - s.edge->origin);
      return s;
    });
    double total = 0, moving = 0;
    for (const auto& [edge, count] : counts) {
      EXPECT_NEAR(static_cast<double>(count) / n, density[edge], 2.0 / n);
      total += density[edge];
      if (edge.first < 8) moving += density[edge];
    }
    EXPECT_NEAR(total, 1, 1e-12);
    EXPECT_NEAR(moving, primary ? 1 : 0.5, 1e-12) << "static and moving edges share secondary samples";
  }
}

// They are looked at shape by shape: those of none would be passed over.
TEST(BoundaryEdges, BelongToShapes) {
  Scene scene = cube_scene();
  scene.edges.push_back(scene.edges.back());
  EXPECT_THROW(PreparedScene(scene, nullptr), std::logic_error);
}

// Static edges weigh 1 + 3 + 2, moving ones 4 + 5 + 5; either kind gets half. Group 1 has both, group 2 none of a weight.
TEST(EdgeChoice, MovingAndStaticEdgesInEqualShares) {
  const std::vector<double> weights{1, 3, 0, 4, 2, 5, 0, 0, 5};
  const std::vector<std::uint8_t> moves{0, 0, 0, 1, 0, 1, 0, 1, 1};
  EdgeChoice choice;
  choice.resize(4);
  const auto set_group = [&](std::size_t group, std::size_t first, std::size_t count) {
    choice.set_group(group, static_cast<int>(first), std::span(weights).subspan(first, count),
                     std::span(moves).subspan(first, count));
  };
  EXPECT_TRUE(choice.empty());
  set_group(0, 0, 3);
  set_group(1, 3, 3);
  set_group(2, 6, 2);
  set_group(3, 8, 1);
  choice.finish();
  constexpr int kDraws = 12000;
  std::vector<int> counts(weights.size());
  double last = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double u = (i + 0.5) / kDraws;
    double rest = u;
    const EdgeChoice::Pick pick = choice.pick(rest);
    ++counts[pick.edge];
    EXPECT_NEAR(pick.begin + rest * pick.share, u, 1e-14);
    EXPECT_NEAR(pick.share, weights[pick.edge] / (moves[pick.edge] ? 14 : 6) / 2, 1e-15);
    EXPECT_GE(pick.begin, last);
    last = pick.begin;
  }
  for (std::size_t i = 0; i < weights.size(); ++i)
    EXPECT_NEAR(counts[i], kDraws * weights[i] / (moves[i] ? 14 : 6) / 2, 1) << i;
  // Without static edges.
  set_group(0, 2, 1);
  set_group(1, 5, 1);
  choice.finish();
  double u = 0.3;
  const EdgeChoice::Pick pick = choice.pick(u);
  EXPECT_EQ(pick.edge, 5);
  EXPECT_NEAR(pick.share, 0.5, 1e-15);
}

/// A camera sees three faces of a cube from a corner, and one from straight ahead; what it cannot see is not looked at, save
/// where its back reflects or lets light through. No edge is lost that is partly in the image.
TEST(BoundaryEdges, OnlyThoseThatTheCameraCanSee) {
  const auto seen = [](Scene scene) {
    const TangentBasis basis = make_basis(scene, {translate(scene, "cube", {0, 1, 0})});
    const PreparedScene prepared(scene, &basis);
    const BoundaryEdges edges(prepared);
    return edges.has_primary() ? tally(20000, [&](double u) { return edges.sample_primary(u); })
                               : std::map<Pair, int>();
  };
  Scene corner = cube_scene();
  corner.camera.position = {5, 5, 5};
  EXPECT_EQ(seen(corner).size(), 9u) << "six of the outline, three inside it";
  corner.materials[0].bsdf().set_two_sided(true);
  EXPECT_EQ(seen(corner).size(), 12u);

  Scene ahead = cube_scene();
  EXPECT_EQ(seen(ahead).size(), 4u);
  ahead.camera.look_at = {5, 0, 5};
  EXPECT_EQ(seen(ahead).size(), 0u) << "beside the image";
  ahead.camera.look_at = {0, 0, 10};
  EXPECT_EQ(seen(ahead).size(), 0u) << "behind the camera";
  // So close that the image holds part of the left edge alone, no corner.
  ahead.camera.position = {-0.99, 0, 1.5};
  ahead.camera.look_at = {-0.99, 0, 0};
  ahead.camera.fov = 20;
  const auto left = seen(ahead);
  ASSERT_EQ(left.size(), 1u);
  for (const int v : {left.begin()->first.first, left.begin()->first.second}) EXPECT_EQ(ahead.positions[v].x, -1) << v;
}

/// Inside the outline an edge counts by the angle between its faces, on it by its length in the image alone.
TEST(BoundaryEdges, PrimaryOnesByLengthInTheImageAndAngle) {
  const double angle = 0.1, rise = std::tan(angle / 2);
  Scene scene;
  scene.camera.position = {0, 1000, 0};  // far: lengths in the image are those seen from above
  scene.camera.up = {0, 0, 1};
  scene.camera.fov = 1;
  add_shape(scene, "roof",
            Mesh{{{-1, 0, -1}, {-1, 0, 1}, {0, rise, -1}, {0, rise, 1}, {1, 0, -1}, {1, 0, 1}},
                 {{0, 1, 3}, {0, 3, 2}, {2, 3, 5}, {2, 5, 4}}},
            diffuse(Rgb(0.5)));
  const TangentBasis basis = make_basis(scene, {translate(scene, "roof", {0, 1, 0})});
  const PreparedScene prepared(scene, &basis);
  const BoundaryEdges edges(prepared);
  std::map<Pair, double> density;
  tally(20000, [&](double u) {
    const auto s = edges.sample_primary(u);
    density[{s.edge->vertex[0], s.edge->vertex[1]}] = s.share;
    return s;
  });
  const double outline = density[{0, 1}];
  EXPECT_NEAR((density[{2, 3}] / outline), angle, 1e-4) << "the ridge";
  EXPECT_NEAR((density[{0, 2}] / outline), 0.5, 1e-4) << "a gable, half as long";
}

/// The side is right if points just off the edge, to either side of the grazing plane, lie in the solid or
/// not.
TEST(BoundaryEdges, OccluderSideOfACube) {
  const Scene scene = cube_scene();
  const PreparedScene prepared(scene, nullptr);
  const BoundaryEdges edges(prepared);
  Rng rng(Stream{3, 0, 0}, 0, 0);
  int boundaries = 0, none = 0;
  for (int i = 0; i < 5000; ++i) {
    const auto s = edges.sample_secondary(rng.uniform());
    const Vec3 w{2 * rng.uniform() - 1, 2 * rng.uniform() - 1, 2 * rng.uniform() - 1};
    const Vec3 n_b = normalize(cross(s.tangent, w));
    // A line through y grazes the cube exactly when it does not enter it; then one side of the plane holds
    // the cube.
    const auto inside = [](const Vec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 1; };
    const Vec3 mid = s.edge->point(0.5), across = normalize(w - s.tangent * dot(w, s.tangent)) * 1e-6;
    const int side = BoundaryEdges::occluder_side(*s.edge, n_b);
    EXPECT_EQ(BoundaryEdges::occluder_side(*s.edge, -n_b), -side);
    if (inside(mid + across) || inside(mid - across)) {
      EXPECT_EQ(side, 0);
      ++none;
    } else {
      EXPECT_EQ(side, dot(n_b, -mid) > 0 ? 1 : -1);
      ++boundaries;
    }
  }
  EXPECT_GT(boundaries, 1000);
  EXPECT_GT(none, 1000);
}

TEST(BoundaryEdges, OccluderSideOfABorderIsItsFace) {
  Scene scene;
  scene.camera.position = {0, 5, 0};
  add_shape(scene, "sheet", quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}), diffuse(Rgb(0.5)));
  const PreparedScene prepared(scene, nullptr);
  const BoundaryEdges edges(prepared);
  for (int i = 0; i < 40; ++i) {
    const auto s = edges.sample_secondary((i + 0.5) / 40);
    const Vec3 to_middle = -s.edge->point(0.5), tilted = to_middle + Vec3{0, 3, 0};
    EXPECT_EQ(BoundaryEdges::occluder_side(*s.edge, to_middle), 1);
    EXPECT_EQ(BoundaryEdges::occluder_side(*s.edge, normalize(tilted)), 1);
    EXPECT_EQ(BoundaryEdges::occluder_side(*s.edge, -to_middle), -1);
    EXPECT_EQ(BoundaryEdges::occluder_side(*s.edge, {0, 1, 0}), 0) << "the plane holds the face";
  }
}

}  // namespace
}  // namespace isochron::testing
