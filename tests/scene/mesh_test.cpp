#include "core/scene/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "tests/scene/cube_mesh.h"
#include "tests/scene/temporary_folder.h"
#include "tests/seed.h"

namespace isochron {
namespace {

TEST(CleanMesh, WeldsSeams) {
  // Every face of the cube with corners of its own, as exporters write where texture coordinates or normals
  // jump. Zero is written with either sign.
  Mesh mesh;
  for (int q = 0; q < 6; ++q) {
    const int first = static_cast<int>(mesh.positions.size());
    for (const int v : kCube[q]) {
      Vec3 p = cube_corner(v);
      for (int axis = 0; axis < 3; ++axis) {
        if (p[axis] == 0 && q % 2 == 0) p[axis] = -0.0;
      }
      mesh.positions.push_back(p);
    }
    mesh.faces.push_back({first, first + 1, first + 2});
    mesh.faces.push_back({first, first + 2, first + 3});
  }
  ASSERT_EQ(mesh.positions.size(), 24u);
  expect_cube(mesh);
  const Mesh clean = clean_mesh(mesh);
  for (const Vec3& p : clean.positions) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_FALSE(std::signbit(p[axis]));
  }
  // In the order of first appearance: the first face's corners, then those of the second.
  const int order[] = {0, 2, 3, 1, 4, 5, 7, 6};
  for (int i = 0; i < 8; ++i) EXPECT_EQ(clean.positions[i], cube_corner(order[i])) << i;
}

TEST(CleanMesh, WeldsEqualPositionsOnly) {
  const double near = 1 + 1e-12;
  const Mesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {near, 0, 0}, {0, 0, 1}}, {{0, 1, 2}, {0, 4, 3}}};
  EXPECT_EQ(clean_mesh(mesh).positions.size(), 5u);
  EXPECT_EQ(build_edges(clean_mesh(mesh)).size(), 6u);
}

TEST(CleanMesh, DropsWhatHasNoArea) {
  const Mesh mesh{{{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {1, 0, 0}},
                  {{1, 2, 2}, {1, 2, 5}, {1, 2, 4}, {1, 2, 3}, {2, 3, 1}, {3, 1, 5}}};
  const Mesh clean = clean_mesh(mesh);
  EXPECT_EQ(clean.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(clean.faces, (std::vector<Face>{{0, 1, 2}}));

  const Mesh flat{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}};
  EXPECT_EQ(error_of([&] { clean_mesh(flat); }), "has no face with an area");
}

TEST(CleanMesh, KeepsThinFaces) {
  const Mesh thin{{{0, 0, 0}, {1, 0, 0}, {0.5, 1e-30, 0}}, {{0, 1, 2}}};
  EXPECT_EQ(clean_mesh(thin).faces.size(), 1u);
}

TEST(CleanMesh, KeepsAFrontAndABack) {
  const Mesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {1, 0, 2}, {2, 0, 1}, {2, 1, 0}}};
  EXPECT_EQ(clean_mesh(mesh).faces, (std::vector<Face>{{0, 1, 2}, {1, 0, 2}})) << "each once";
}

/// k faces about an edge at the given angles, turned either way.
Mesh fan(const std::vector<double>& angles, const std::vector<bool>& turned) {
  Mesh mesh{{{0, 0, -1}, {0, 0, 1}}, {}};
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const int v = static_cast<int>(mesh.positions.size());
    mesh.positions.push_back({2 * std::cos(angles[i]), 2 * std::sin(angles[i]), 0.3 * std::sin(5.0 * v)});
    if (turned[i])
      mesh.faces.push_back({1, 0, v});
    else
      mesh.faces.push_back({v, 0, 1});
  }
  return mesh;
}

/// From every face to the next one counter-clockwise, against a sort of the angles that the faces were made with.
TEST(Edges, SectorsBetweenNeighbours) {
  std::mt19937 random(test_seed(12));
  for (int repeat = 0; repeat < 200; ++repeat) {
    const int k = 3 + repeat % 5;
    std::vector<double> angles(k);
    std::vector<bool> turned(k);
    for (double& angle : angles) angle = std::uniform_real_distribution(-M_PI, M_PI)(random);
    for (int i = 0; i < k; ++i) turned[i] = random() % 2 != 0;
    std::vector<int> order(k);
    for (int i = 0; i < k; ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](int a, int b) { return angles[a] < angles[b]; });
    std::vector<int> next(k);
    for (int i = 0; i < k; ++i) next[order[i]] = order[(i + 1) % k];
    int sectors = 0;
    for (const Edge& edge : build_edges(fan(angles, turned))) {
      EXPECT_EQ(edge.sector, edge.vertex == (std::array{0, 1}));
      if (!edge.sector) continue;
      EXPECT_EQ(edge.face[0], sectors++);
      EXPECT_EQ(edge.face[1], next[edge.face[0]]);
    }
    EXPECT_EQ(sectors, k);
  }
}

TEST(Edges, CoincidentFacesAreNextToEachOther) {
  // Two pairs of faces of one angle each: all four sectors, two of which are empty.
  std::set<std::pair<int, int>> sectors;
  for (const Edge& edge : build_edges(fan({0.3, 2, 0.3, 2}, {false, false, true, true})))
    if (edge.sector) sectors.insert({edge.face[0], edge.face[1]});
  EXPECT_EQ(sectors, (std::set<std::pair<int, int>>{{0, 2}, {2, 1}, {1, 3}, {3, 0}}));
}

TEST(Edges, AcceptsInconsistentOrientation) {
  const Mesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {1, 2, 3}}};
  EXPECT_EQ(build_edges(mesh).size(), 5u);
}

TEST(Edges, MatchBruteForce) {
  // Random parts of a grid with a shuffled order of vertices, so that there are borders of every shape.
  std::mt19937 random(test_seed(11));
  for (int repeat = 0; repeat < 20; ++repeat) {
    constexpr int kSide = 7;
    std::vector<int> name(kSide * kSide);
    for (int i = 0; i < kSide * kSide; ++i) name[i] = i;
    std::shuffle(name.begin(), name.end(), random);
    Mesh mesh;
    mesh.positions.resize(name.size());
    for (int i = 0; i < kSide * kSide; ++i) mesh.positions[name[i]] = {double(i % kSide), double(i / kSide), 0};
    for (int i = 0; i < kSide * kSide; ++i) {
      if (i % kSide == kSide - 1 || i / kSide == kSide - 1) continue;
      if (random() % 4 != 0) mesh.faces.push_back({name[i], name[i + 1], name[i + kSide]});
      if (random() % 4 != 0) mesh.faces.push_back({name[i + kSide + 1], name[i + kSide], name[i + 1]});
    }
    std::map<std::set<int>, std::vector<int>> expected;
    for (int f = 0; f < static_cast<int>(mesh.faces.size()); ++f) {
      for (int k = 0; k < 3; ++k) expected[{mesh.faces[f][k], mesh.faces[f][(k + 1) % 3]}].push_back(f);
    }
    const std::vector<Edge> edges = build_edges(mesh);
    ASSERT_EQ(edges.size(), expected.size());
    auto e = expected.begin();  // a map of sets is sorted by ascending vertices, too
    for (const Edge& edge : edges) {
      EXPECT_EQ((std::set<int>{edge.vertex[0], edge.vertex[1]}), e->first);
      EXPECT_LT(edge.vertex[0], edge.vertex[1]);
      EXPECT_EQ(edge.face[0], e->second[0]);
      EXPECT_EQ(edge.face[1], e->second.size() == 2 ? e->second[1] : -1);
      ++e;
    }
  }
}

TEST(Edges, TorusOfOneMillionFaces) {
  // Written with all corners separate, as STL does; a closed surface of genus one has V - E + F = 0.
  constexpr int kSide = 708;
  Mesh mesh;
  const auto corner = [&](int i, int j) {
    const double u = 2 * M_PI * (i % kSide) / kSide, v = 2 * M_PI * (j % kSide) / kSide;
    mesh.positions.push_back({(3 + std::cos(v)) * std::cos(u), (3 + std::cos(v)) * std::sin(u), std::sin(v)});
    return static_cast<int>(mesh.positions.size()) - 1;
  };
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      mesh.faces.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
      mesh.faces.push_back({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
    }
  }
  const Mesh clean = clean_mesh(mesh);
  const std::vector<Edge> edges = build_edges(clean);
  EXPECT_EQ(clean.positions.size(), static_cast<std::size_t>(kSide) * kSide);
  EXPECT_EQ(clean.faces.size(), 2 * clean.positions.size());
  EXPECT_EQ(edges.size(), 3 * clean.positions.size());
  for (const Edge& edge : edges) ASSERT_GE(edge.face[1], 0);
}

}  // namespace
}  // namespace isochron
