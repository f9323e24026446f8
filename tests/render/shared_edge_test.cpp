// Edges that more than two faces share: boxes that touch along an edge, walls that meet in a T.
//
// Statistics: z-tests at 4.5 standard errors of the difference from finite differences with common random numbers (7e-6 each for
// normal errors, 4e-4 by Student's law of 16 replicates; 5 of them), whose errors must be a few per cent of the derivative.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "core/techniques/boundary_edges.h"
#include "tests/render/support.h"
#include "tests/seed.h"

namespace isochron::testing {
namespace {

/// Walls of one height that meet in a vertical edge at `at`, at these angles about it.
Mesh walls(const Vec3& at, const std::vector<double>& angles, const std::vector<bool>& turned, double size) {
  Mesh mesh{{at, at + Vec3{0, size, 0}}, {}};
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const Vec3 along{std::cos(angles[i]) * size, 0, -std::sin(angles[i]) * size};  // counter-clockwise seen from above
    const int a = static_cast<int>(mesh.positions.size()), b = a + 1;
    mesh.positions.push_back(at + along);
    mesh.positions.push_back(at + along + Vec3{0, size, 0});
    for (std::array<int, 3> face : {std::array{0, a, b}, std::array{0, b, 1}}) {
      if (turned[i]) std::swap(face[1], face[2]);
      mesh.faces.push_back(face);
    }
  }
  return mesh;
}

/// Half-lines from the origin of a plane at these angles, and lines past the origin.
struct HalfLines {
  std::vector<double> angles;
  /// Number of the first one that a line meets which comes from far along -direction and passes `offset` to the left of the
  /// origin; -1: none.
  int first_met(double direction, double offset) const {
    int first = -1;
    double nearest = INFINITY;
    for (std::size_t i = 0; i < angles.size(); ++i) {
      const double left = std::sin(angles[i] - direction), forward = std::cos(angles[i] - direction);
      if (!(left * offset > 0)) continue;
      const double distance = forward * offset / left;  // along the line, from where it passes the origin
      if (distance < nearest) nearest = distance, first = static_cast<int>(i);
    }
    return first;
  }
};

struct Fan {
  HalfLines lines;
  Scene scene;
};

Fan random_fan(std::mt19937& random, int k) {
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  Fan fan;
  std::vector<bool> turned(k);
  // Every other time all are on one side, so that lines graze the edge.
  const double share = random() % 2 ? 1.0 : 0.3, about = angle(random);
  for (int i = 0; i < k; ++i) {
    fan.lines.angles.push_back(about + share * angle(random));
    turned[i] = random() % 2 != 0;
  }
  const double from = angle(random);
  fan.scene.camera.position = {5 * std::cos(from), 0.5, -5 * std::sin(from)};
  fan.scene.camera.look_at = {0, 0.5, 0};
  add_shape(fan.scene, "walls", walls({0, 0, 0}, fan.lines.angles, turned, 1), diffuse(Rgb(0.5), true));
  return fan;
}

/// What a camera sees on either side of the edge, by lines past it: it looks for a jump there once, and takes the faces that the
/// lines meet first. Random views, but those of two walls that go on straight: between them an edge is picked as often as light
/// changes there, of up to 22 edges: at a bend of 0.05 by four of the 2000 numbers or so.
TEST(SharedEdge, CameraSeesFirstFacesOnEitherSide) {
  std::mt19937 random(test_seed(21));
  constexpr double kLeastWedge = 0.05;
  int within = 0, outlines = 0;
  for (int repeat = 0; repeat < 400; ++repeat) {
    const int k = 3 + repeat % 5;
    const Fan fan = random_fan(random, k);
    const Vec3& eye = fan.scene.camera.position;
    const double direction = std::atan2(eye.z, -eye.x);
    std::set<int> met;
    for (const double side : {-1.0, 1.0})
      if (const int wall = fan.lines.first_met(direction, side); wall >= 0) met.insert(wall);
    if (met.size() == 2) {
      const double between = fan.lines.angles[*met.begin()] - fan.lines.angles[*met.rbegin()];
      if (std::cos(between) < -std::cos(kLeastWedge)) continue;
    }
    const TangentBasis basis = make_basis(fan.scene, {translate(fan.scene, "walls", {0, 1, 0.3})});
    const PreparedScene prepared(fan.scene, &basis);
    const BoundaryEdges edges(prepared);
    std::set<const BoundaryEdge*> found;
    for (int i = 0; i < 2000; ++i) {
      const BoundaryEdge* edge = edges.sample_primary((i + 0.5) / 2000).edge;
      if (edge->vertex[0] == 0 && edge->vertex[1] == 1) found.insert(edge);
    }
    ASSERT_EQ(found.size(), 1u) << repeat;
    const BoundaryEdge& edge = **found.begin();
    const std::set<int> taken{edge.face[0] / 2, edge.face[1] / 2};
    for (const int wall : met) EXPECT_TRUE(taken.contains(wall)) << repeat;
    (met.size() == 2 ? within : outlines) += 1;
  }
  EXPECT_GT(within, 50);
  EXPECT_GT(outlines, 50);
}

/// A line past the edge is cut off on one side alone: then, and then only, one entry says so, and on which side.
TEST(SharedEdge, EveryJumpOfVisibilityCountsOnce) {
  std::mt19937 random(test_seed(22));
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  int jumps = 0, none = 0;
  for (int repeat = 0; repeat < 400; ++repeat) {
    const Fan fan = random_fan(random, 3 + repeat % 5);
    const PreparedScene prepared(fan.scene, nullptr);
    const BoundaryEdges edges(prepared);
    std::set<const BoundaryEdge*> of_the_edge;
    for (int i = 0; i < 2000; ++i) {
      const BoundaryEdge* edge = edges.sample_secondary((i + 0.5) / 2000).edge;
      if (edge->vertex[0] == 0 && edge->vertex[1] == 1) of_the_edge.insert(edge);
    }
    for (int line = 0; line < 20; ++line) {
      const double direction = angle(random);
      const bool left = fan.lines.first_met(direction, 1) >= 0, right = fan.lines.first_met(direction, -1) >= 0;
      const Vec3 to_the_left{-std::sin(direction), 0, -std::cos(direction)};
      std::vector<int> sides;
      for (const BoundaryEdge* edge : of_the_edge)
        if (const int side = BoundaryEdges::occluder_side(*edge, to_the_left); side != 0) sides.push_back(side);
      const std::vector<int> expected = left == right ? std::vector<int>() : std::vector{left ? 1 : -1};
      EXPECT_EQ(sides, expected) << repeat;
      (left == right ? none : jumps) += 1;
    }
  }
  EXPECT_GT(jumps, 1000);
  EXPECT_GT(none, 1000);
}

/// Faces of a shape that deforms may change places about their edge.
TEST(SharedEdge, NeighboursAreThoseOfNow) {
  Scene scene;
  scene.camera.position = {5, 0.5, 0};
  scene.camera.look_at = {0, 0.5, 0};
  add_shape(scene, "walls", walls({0, 0, 0}, {1.0, 2.0, 2.5}, {false, false, false}, 1), diffuse(Rgb(0.5), true));
  const TangentBasis basis = make_basis(scene, {translate(scene, "walls", {0, 1, 0})});
  PreparedScene prepared(scene, &basis);
  BoundaryEdges edges(prepared);
  const auto silhouette = [&] {
    for (int i = 0; i < 2000; ++i) {
      const BoundaryEdge* edge = edges.sample_secondary((i + 0.5) / 2000).edge;
      if (edge->vertex[0] == 0 && edge->vertex[1] == 1) return std::set{edge->face[0] / 2, edge->face[1] / 2};
    }
    return std::set<int>();
  };
  EXPECT_EQ(silhouette(), (std::set{0, 2}));
  // The wall in the middle swings past the first one.
  const Mesh swung = walls({0, 0, 0}, {1.0, 0.2, 2.5}, {false, false, false}, 1);
  scene.positions = swung.positions;
  prepared.update(scene, &basis, {});
  edges.update(prepared);
  EXPECT_EQ(silhouette(), (std::set{1, 2}));
}

/// A floor, a wall behind and a lamp to the left, before which something stands.
Scene stage() {
  Scene scene;
  scene.camera = {{0.5, 1.2, 4}, {0, 0.3, 0}, {0, 1, 0}, 34, 12, 12};
  add_shape(scene, "floor", quad({-2, -0.3, 2}, {2, -0.3, 2}, {2, -0.3, -1.2}, {-2, -0.3, -1.2}), diffuse(Rgb(0.7)));
  add_shape(scene, "back", quad({-2, -0.3, -1.2}, {2, -0.3, -1.2}, {2, 2, -1.2}, {-2, 2, -1.2}), diffuse(Rgb(0.6)));
  add_shape(scene, "lamp", quad({-1.6, 1.3, 0.9}, {-1.6, 1.3, 1.4}, {-1.3, 1.7, 1.4}, {-1.3, 1.7, 0.9}),
            diffuse(Rgb(0.0)), Rgb(25.0));
  std::swap(scene.triangles[4].vertex[1], scene.triangles[4].vertex[2]);  // so that it shines down
  std::swap(scene.triangles[5].vertex[1], scene.triangles[5].vertex[2]);
  return scene;
}

/// Two boxes, one behind and beside the other.
Mesh touching_boxes() {
  Mesh mesh = box({-0.7, 0, 0}, {0, 0.8, 0.6});
  const Mesh other = box({0, 0, -0.6}, {0.6, 0.8, 0});
  const int first = static_cast<int>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const auto& f : other.faces) mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  return clean_mesh(mesh);
}

struct SharedEdgeCase {
  const char* name;
  Mesh (*mesh)();
  Motion (*motion)(const Scene&);
  int bounces;
};
void PrintTo(const SharedEdgeCase& c, std::ostream* out) {
  *out << c.name;
}

Mesh tee() {
  return walls({0, 0, 0}, {0.2, kPi + 0.2, 1.4}, {false, true, false}, 0.7);
}
/// Of which lines graze the common edge.
Mesh vanes() {
  return walls({-0.2, 0, 0.4}, {-0.9, 0.1, 0.9}, {false, true, false}, 0.7);
}
Motion shift(const Scene& scene) {
  return translate(scene, "thing", {0.5, 0.1, 0.3});
}
/// One of three walls alone.
Motion swing(const Scene& scene) {
  return translate(scene, "thing", {0, 0, 1}, [](const Vec3& p) { return p.x > 0.3; });
}

class SharedEdges : public ::testing::TestWithParam<SharedEdgeCase> {};

TEST_P(SharedEdges, DerivativeIsThatOfFiniteDifferences) {
  const SharedEdgeCase& c = GetParam();
  Scene scene = stage();
  add_shape(scene, "thing", c.mesh(), diffuse(Rgb(0.5), true));
  ASSERT_TRUE(std::ranges::count(scene.edges, true, &Edge::sector) > 0);
  const Motion motion = c.motion(scene);
  const TangentBasis basis = make_basis(scene, {motion});
  const GateSet gates(GateShape::steady(), {0});
  const EstimatorOptions options{.max_bounces = c.bounces, .sampling = Sampling::standard, .guiding_samples = 16},
      plain{.max_bounces = c.bounces, .sampling = Sampling::standard};
  const Renderer renderer(scene, gates, options, &basis);
  constexpr int kReplicates = 16, kSamples = 256;
  const Estimate total = replicated(kReplicates, test_seed(23),
                                    [&](const Stream& stream) { return total_derivative(renderer, kSamples, stream); });
  const auto reference = [&](const Stream& stream) {
    return finite_difference(scene, motion, 0.005, gates, plain, 1024, 2, stream)[0].mean;
  };
  const Estimate difference = replicated(kReplicates, test_seed(24), reference);
  EXPECT_LT(std::abs(z_score(total, difference)), 4.5)
      << total.mean << " +- " << total.standard_error << ", finite difference " << difference.mean << " +- "
      << difference.standard_error;
  EXPECT_LT(std::hypot(total.standard_error, difference.standard_error), 0.06 * std::abs(difference.mean));
}

INSTANTIATE_TEST_SUITE_P(Scenes, SharedEdges,
                         ::testing::Values(SharedEdgeCase{"boxes", touching_boxes, shift, 1},
                                           SharedEdgeCase{"boxes_two_bounces", touching_boxes, shift, 2},
                                           SharedEdgeCase{"tee", tee, shift, 1},
                                           SharedEdgeCase{"tee_swings", tee, swing, 1},
                                           SharedEdgeCase{"vanes", vanes, shift, 1}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace isochron::testing
