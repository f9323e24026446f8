// Surfaces that pass through each other: the lines along which they do, and derivatives of what is seen there.
#include "core/geometry/mesh_intersections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "core/base/random.h"
#include "core/geometry/ray_caster.h"
#include "scene_building.h"
#include "support.h"

namespace isochron::testing {
namespace {

MeshIntersections all_of(const Scene& scene) {
  return MeshIntersections(scene, ray_offset(scene));
}

double total_length(const Scene& scene) {
  const MeshIntersections all = all_of(scene);
  double sum = 0;
  for (const MeshIntersection& p : all.segments()) sum += length(p.end[1] - p.end[0]);
  return sum;
}

TEST(MeshIntersections, ABeamThroughACube) {
  Scene scene;
  add_shape(scene, "cube", box({-1, -1, -1}, {1, 1, 1}), diffuse(Rgb(0.5)));
  EXPECT_EQ(total_length(scene), 0);  // neighbours in a mesh do not pierce
  add_shape(scene, "beam", box({-0.3, -0.2, -3}, {0.4, 0.3, 3}), diffuse(Rgb(0.5)));
  EXPECT_NEAR(total_length(scene), 2 * 2 * (0.7 + 0.5), 1e-9);  // two rectangles
}

TEST(MeshIntersections, FollowTheSceneScale) {
  for (const double scale : {1e-3, 1.0, 1e3}) {
    Scene scene;
    add_shape(scene, "a", box(Vec3(-1, -1, -1) * scale, Vec3(1, 1, 1) * scale), diffuse(Rgb(0.5)));
    add_shape(scene, "b", box(Vec3(0.1, 0.2, 0.3) * scale, Vec3(2, 3, 4) * scale), diffuse(Rgb(0.5)));
    // On three faces of either cube, an L with arms to the first cube's edges.
    EXPECT_NEAR(total_length(scene) / scale, 2 * (0.9 + 0.8 + 0.7), 1e-9);
  }
}

TEST(MeshIntersections, AFoldedMeshPiercesItself) {
  // Two triangles with one vertex in common, the second of which goes through the first from there on.
  Scene scene;
  const Mesh mesh{{{0, 0, 0}, {2, -1, 0}, {2, 1, 0}, {1, 0, 1}, {1, 0, -1}}, {{0, 1, 2}, {0, 3, 4}}};
  add_shape(scene, "fold", mesh, diffuse(Rgb(0.5)));
  EXPECT_NEAR(total_length(scene), 1, 1e-9);
}

TEST(MeshIntersections, WhatTouchesDoesNotPierce) {
  Scene scene;
  add_shape(scene, "floor", quad({-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}), diffuse(Rgb(0.5)));
  add_shape(scene, "block", box({-0.5, 0, -0.5}, {0.5, 1, 0.5}), diffuse(Rgb(0.5)));
  EXPECT_EQ(total_length(scene), 0);
}

void expect_same_bits(const MeshIntersections& a, const MeshIntersections& b) {
  ASSERT_EQ(a.segments().size(), b.segments().size());
  for (std::size_t i = 0; i < a.segments().size(); ++i) {
    EXPECT_EQ(a.segments()[i].triangle, b.segments()[i].triangle);
    EXPECT_EQ(a.segments()[i].end, b.segments()[i].end);
  }
}

/// Every edge against every triangle, by Cramer's rule. What is within the ray offset of an edge's end, or no longer than it, touches.
std::vector<MeshIntersection> by_brute_force(const Scene& scene) {
  const double touching = ray_offset(scene);
  std::map<std::array<int, 2>, std::vector<Vec3>> points;
  for (const Edge& edge : scene.edges) {
    const Vec3 from = scene.positions[edge.vertex[0]], d = scene.positions[edge.vertex[1]] - from;
    const double margin = touching / length(d);
    for (int t = 0; t < static_cast<int>(scene.triangles.size()); ++t) {
      const auto& v = scene.triangles[t].vertex;
      if (std::find_first_of(v.begin(), v.end(), edge.vertex.begin(), edge.vertex.end()) != v.end()) continue;
      const Vec3 p = scene.positions[v[1]] - scene.positions[v[0]], q = scene.positions[v[2]] - scene.positions[v[0]],
                 r = from - scene.positions[v[0]], n = cross(d, q), m = cross(r, p);
      const double determinant = dot(p, n);
      if (determinant == 0) continue;
      const double a = dot(r, n) / determinant, b = dot(d, m) / determinant, along = dot(q, m) / determinant;
      if (!(a >= 0 && b >= 0 && a + b <= 1 && along > margin && along < 1 - margin)) continue;
      for (const int face : edge.face)
        if (face >= 0) points[{std::min(face, t), std::max(face, t)}].push_back(from + d * along);
    }
  }
  std::vector<MeshIntersection> result;
  for (auto& [pair, of_pair] : points) {
    for (const int v : scene.triangles[pair[0]].vertex)
      for (const int w : scene.triangles[pair[1]].vertex)
        if (v == w) of_pair.push_back(scene.positions[v]);
    if (of_pair.size() > 1 && length(of_pair.back() - of_pair.front()) > touching)
      result.push_back({pair, {of_pair.front(), of_pair.back()}});
  }
  return result;
}

/// A ball above a floor, and a rod across the room that is no part of them.
Scene ball_and_rod() {
  Scene scene;
  scene.camera = {{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 40, 8, 8};
  add_shape(scene, "floor", quad({-2, -1.2, 2}, {2, -1.2, 2}, {2, -1.2, -2}, {-2, -1.2, -2}), diffuse(Rgb(0.5)));
  Mesh ball;
  constexpr int kRings = 18, kColumns = 30;
  for (int ring = 0; ring < kRings; ++ring)
    for (int column = 0; column < kColumns; ++column) {
      const double theta = kPi * (ring + 0.5) / kRings, phi = kTwoPi * column / kColumns;
      ball.positions.push_back({std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)});
    }
  for (int ring = 0; ring + 1 < kRings; ++ring)
    for (int column = 0; column < kColumns; ++column) {
      const int a = ring * kColumns + column, b = ring * kColumns + (column + 1) % kColumns;
      ball.faces.push_back({a, b, a + kColumns});
      ball.faces.push_back({b, b + kColumns, a + kColumns});
    }
  add_shape(scene, "ball", ball, diffuse(Rgb(0.5)));
  scene.shapes.back().deforms = true;
  add_shape(scene, "rod", box({-1.9, 1.3, -0.1}, {1.9, 1.4, 0.1}), diffuse(Rgb(0.5)));
  return scene;
}

/// What an optimiser may do to the ball, step by step: little shifts, a finger that is poked from below through the top, a
/// fold, a shock, and back; the rod comes down through it meanwhile.
std::vector<Scene> deformations() {
  const Scene scene = ball_and_rod();
  const Shape &ball = scene.shapes[1], &rod = scene.shapes[2];
  std::vector<Scene> steps;
  for (int k = 0; k < 14; ++k) {
    Scene& moved = steps.emplace_back(scene);
    const double noise = k == 9 ? 0.2 : k < 2 ? 0 : k < 4 ? 1e-4 : k == 12 ? 0 : 0.01;
    for (int i = 0; i < ball.vertex_count; ++i) {
      Vec3& p = moved.positions[ball.first_vertex + i];
      Rng rng({7, 0, 0}, static_cast<std::uint64_t>(i), static_cast<std::uint32_t>(k));
      const double from_axis = std::hypot(p.x, p.z);
      if (k >= 4 && k < 8 && p.y < 0) p.y += 0.7 * (k - 3) * std::exp(-30 * from_axis * from_axis);
      if (k == 8) p.x = std::abs(p.x + 0.1) - 0.1;
      for (int axis = 0; axis < 3; ++axis) p[axis] += noise * (rng.uniform() - 0.5);
    }
    for (int i = 0; i < rod.vertex_count && k > 5; ++i) moved.positions[rod.first_vertex + i].y -= 0.2 * (k - 5);
  }
  return steps;
}

TEST(MeshIntersections, OfADeformingMeshAreThoseOfEveryEdgeAndTriangle) {
  std::size_t through_itself = 0, through_other = 0;
  for (const Scene& scene : deformations()) {
    const auto expected = by_brute_force(scene);
    const auto found = all_of(scene);
    ASSERT_EQ(found.segments().size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const auto &a = expected[i], &b = found.segments()[i];
      EXPECT_EQ(a.triangle, b.triangle);
      const bool same = length(a.end[0] - b.end[0]) < length(a.end[0] - b.end[1]);
      for (int k = 0; k < 2; ++k) EXPECT_LT(length(a.end[k] - b.end[same ? k : 1 - k]), 1e-9);
      const int other = scene.triangles[a.triangle[1]].shape;
      ++(scene.triangles[a.triangle[0]].shape == other ? through_itself : through_other);
    }
  }
  EXPECT_GT(through_itself, 300u);
  EXPECT_GT(through_other, 100u);
}

// Kept from step to step, forwards, then backwards.
TEST(MeshIntersections, DoNotDependOnWhatCameBefore) {
  std::vector<Scene> steps = deformations();
  const Scene first = steps.front();
  MeshIntersections kept = all_of(first);
  for (std::size_t k = 0; k < 2 * steps.size(); ++k) {
    const Scene& scene = steps[k < steps.size() ? k : 2 * steps.size() - 1 - k];
    kept.update(scene, ray_offset(scene));
    MeshIntersections fresh = all_of(first);
    fresh.update(scene, ray_offset(scene));
    expect_same_bits(kept, fresh);
    expect_same_bits(kept, all_of(scene));
  }
}

// Boxes that turn and go through each other, one of them through itself as well: as all edges find.
TEST(MeshIntersections, OfRigidShapesThatMove) {
  Scene scene;
  scene.camera = {{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 40, 8, 8};
  add_shape(scene, "still", box({-1, -1, -1}, {1, 0, 1}), diffuse(Rgb(0.5)));
  add_shape(scene, "turns", box({-0.4, -0.3, -0.3}, {0.4, 0.5, 0.3}), diffuse(Rgb(0.5)));
  Mesh crossed = box({-0.2, 1, -0.2}, {0.2, 1.4, 0.2});
  const Mesh other = box({-0.1, 1.1, -0.4}, {0.1, 1.2, 0.4});
  const int first = static_cast<int>(crossed.positions.size());
  crossed.positions.insert(crossed.positions.end(), other.positions.begin(), other.positions.end());
  for (const auto& f : other.faces) crossed.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  add_shape(scene, "crossed", crossed, diffuse(Rgb(0.5)));
  MeshIntersections kept = all_of(scene);
  std::size_t found = 0;
  for (int k = 0; k < 24; ++k) {
    Scene moved = scene;
    rotate_y(scene, "turns", {0.2, 0, 0}).apply(moved, 0.3 * (k / 2));
    translate(scene, "crossed", {0.02, -0.11, 0.01}).apply(moved, (k + 1) / 2);
    kept.update(moved, ray_offset(moved));
    expect_same_bits(kept, all_of(moved));
    found += kept.segments().size();
  }
  EXPECT_GT(found, 500u);
}

/// Two blocks through each other on a floor, all lit and seen from above.
Scene crossing_blocks() {
  Scene scene;
  scene.camera = {{0.7, 2.2, 2.6}, {0, 0.3, 0}, {0, 1, 0}, 40, 8, 8};
  add_shape(scene, "floor", quad({-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}), diffuse(Rgb(0.5)));
  add_shape(scene, "a", box({-0.8, 0.05, -0.25}, {0.5, 0.4, 0.3}), diffuse(Rgb(0.9)));
  add_shape(scene, "b", box({-0.2, 0.1, -0.6}, {0.25, 0.7, 0.7}), diffuse(Rgb(0.2)));
  add_shape(scene, "lamp", quad({0.6, 2.5, 0.6}, {1.4, 2.5, 0.6}, {1.4, 2.5, 1.4}, {0.6, 2.5, 1.4}), diffuse(Rgb(0.0)),
            Rgb(20.0));
  return scene;
}

// The image's mean against finite differences with common random numbers: z-tests at 4 standard errors (false alarm 6e-5
// each, 8 of them). Without the intersections the clearest of each pair fails by 10 to 60.
TEST(MeshIntersections, DerivativesAgreeWithFiniteDifferences) {
  const Scene scene = crossing_blocks();
  const GateSet gates(GateShape::gaussian(0.4), {5.0, 5.6});
  const Motion a = translate(scene, "a", {1, 0.2, 0.3}), b = translate(scene, "b", {1, 0.2, 0.3});
  const Motion together{[=](Scene& target, double t) { a.apply(target, t), b.apply(target, t); },
                        [=](const Scene& source, std::vector<std::pair<int, double>>& out) {
                          a.velocity(source, out);
                          b.velocity(source, out);
                        }};
  struct Case {
    const char* name;
    Motion motion;
    int max_bounces;
  };
  // Where the two move apart, light that is reflected twice also needs what one of them covers of the other: not modelled.
  for (const Case& c :
       {Case{"together", together, 3}, Case{"sideways", translate(scene, "b", {1, 0, 0}), 1},
        Case{"up", translate(scene, "a", {0, 1, 0}), 1}, Case{"turn", rotate_y(scene, "b", {0, 0, 0}), 1}}) {
    const TangentBasis basis = make_basis(scene, {c.motion});
    const EstimatorOptions options{.max_bounces = c.max_bounces, .sampling = Sampling::standard, .guiding_samples = 32};
    const Renderer renderer(scene, gates, options, &basis);
    constexpr int kBatches = 32;
    const auto interior = term_means(renderer, Term::interior, 1, 2, 128, kBatches, {1, 0, 0});
    const auto visibility =
        term_means(renderer, Term::visibility, 1, 2, samples_of(Term::visibility, 128), kBatches, {2, 0, 0});
    const auto difference = finite_difference(scene, c.motion, 0.01, gates, options, 512, kBatches, {3, 0, 0});
    for (int g = 0; g < 2; ++g) {
      const Estimate total{interior[0][g].mean + visibility[0][g].mean,
                           std::hypot(interior[0][g].standard_error, visibility[0][g].standard_error)};
      EXPECT_LT(std::abs(z_score(total, difference[g])), 4)
          << c.name << ", gate " << g << ": " << total.mean << " +- " << total.standard_error << ", finite difference "
          << difference[g].mean << " +- " << difference[g].standard_error;
    }
  }
}

}  // namespace
}  // namespace isochron::testing
