// Clipping of single triangles, and queries for all triangles that an ellipsoidal shell crosses.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/base/constants.h"
#include "core/geometry/ellipsoid.h"
#include "core/geometry/ellipsoid_bvh.h"

namespace isochron {
namespace {

using Triangles = std::vector<EllipsoidBvh::Input>;

struct Query {
  Vec3 a, b;
  double tau;
};

/// Foci around the scene, lengths that pass through its vertices.
std::vector<Query> random_queries(const Triangles& triangles, double extent) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> uniform(-extent, extent);
  const auto vec = [&] {
    const double x = uniform(rng), y = uniform(rng), z = uniform(rng);
    return Vec3{x, y, z};
  };
  std::vector<Query> queries(1024);
  for (Query& q : queries) {
    const Vec3& target = triangles[rng() % triangles.size()].vertex[0];
    q.a = vec(), q.b = vec();
    q.tau = length(target - q.a) + length(target - q.b);
  }
  return queries;
}

Triangles grid(int rows, int columns, Vec3 (*point)(double, double)) {
  Triangles triangles;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const auto at = [&](int di, int dj) {
        return point((i + di) / static_cast<double>(rows), (j + dj) / static_cast<double>(columns));
      };
      const int id = static_cast<int>(triangles.size());
      triangles.push_back({{at(0, 0), at(1, 0), at(0, 1)}, id});
      triangles.push_back({{at(1, 0), at(1, 1), at(0, 1)}, id + 1});
    }
  return triangles;
}

/// A rippled torus of 2 * rows * columns triangles, 70 000 by default.
Triangles mesh(int rows = 250, int columns = 140) {
  return grid(rows, columns, [](double u, double v) {
    const double p = kTwoPi * u, t = kTwoPi * v;
    const double r = 0.4 * (1 + 0.1 * std::sin(11 * p) * std::cos(5 * t));
    return Vec3{(1 + r * std::cos(t)) * std::cos(p), (1 + r * std::cos(t)) * std::sin(p), r * std::sin(t)};
  });
}

/// A room with two blocks: 36 triangles.
Triangles box() {
  Triangles triangles;
  const auto cuboid = [&](const Vec3& c, const Vec3& h) {
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        const auto corner = [&](int s, int t) {
          Vec3 p = c;
          p[axis] += side * h[axis];
          p[(axis + 1) % 3] += s * h[(axis + 1) % 3];
          p[(axis + 2) % 3] += t * h[(axis + 2) % 3];
          return p;
        };
        const int id = static_cast<int>(triangles.size());
        triangles.push_back({{corner(-1, -1), corner(1, -1), corner(1, 1)}, id});
        triangles.push_back({{corner(-1, -1), corner(1, 1), corner(-1, 1)}, id + 1});
      }
  };
  cuboid({0, 0, 0}, {1, 1, 1});
  cuboid({-0.4, -0.7, 0.3}, {0.25, 0.3, 0.25});
  cuboid({0.4, -0.4, -0.3}, {0.25, 0.6, 0.3});
  return triangles;
}

/// Argument 0: triangles that cross; 1: all triangles of the room.
void BM_ClipEllipse(benchmark::State& state) {
  const Triangles triangles = box();
  struct Case {
    Ellipsoid ellipsoid;
    const EllipsoidBvh::Input* triangle;
  };
  std::vector<Case> cases;
  EllipseArcs arcs;
  for (const Query& q : random_queries(triangles, 1))
    for (const EllipsoidBvh::Input& t : triangles) {
      const Ellipsoid e(q.a, q.b, q.tau);
      if (state.range(0) == 1 || clip_ellipse(e, t.vertex[0], t.vertex[1], t.vertex[2], arcs)) cases.push_back({e, &t});
    }
  std::shuffle(cases.begin(), cases.end(), std::mt19937_64(2));
  constexpr std::size_t kCases = 4096;  // stays in the cache
  std::size_t i = 0;
  for (auto _ : state) {
    const auto& v = cases[i].triangle->vertex;
    benchmark::DoNotOptimize(clip_ellipse(cases[i].ellipsoid, v[0], v[1], v[2], arcs));
    benchmark::DoNotOptimize(arcs);
    i = (i + 1) % kCases;
  }
}
BENCHMARK(BM_ClipEllipse)->ArgName("all")->Arg(0)->Arg(1);

void query_all(benchmark::State& state, const Triangles& triangles, double extent) {
  const EllipsoidBvh bvh(triangles);
  const std::vector<Query> queries = random_queries(triangles, extent);
  const double thickness = static_cast<double>(state.range(0)) * 1e-3;
  std::vector<int> ids;
  std::size_t i = 0, found = 0;
  for (auto _ : state) {
    const Query& q = queries[i];
    ids.clear();
    bvh.query(q.a, q.b, q.tau * (1 - thickness), q.tau, ids);
    found += ids.size();
    i = (i + 1) % queries.size();
  }
  state.counters["crossing"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}

void BM_QueryRoom(benchmark::State& state) {
  query_all(state, box(), 1);
}
BENCHMARK(BM_QueryRoom)->ArgName("permille")->Arg(0)->Arg(10);

void BM_QueryMesh(benchmark::State& state) {
  query_all(state, mesh(), 2);
}
BENCHMARK(BM_QueryMesh)->ArgName("permille")->Arg(0)->Arg(10);

/// Argument: number of triangles, about. One length, so that the counters tell what a query does.
void BM_QueryByTriangles(benchmark::State& state) {
  const int columns = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(state.range(0)) / 4)));
  const int rows = static_cast<int>(state.range(0)) / (2 * columns);
  const Triangles triangles = mesh(rows, columns);
  const EllipsoidBvh bvh(triangles);
  const std::vector<Query> queries = random_queries(triangles, 2);
  std::vector<int> ids;
  std::size_t i = 0, found = 0, visited = 0;
  for (auto _ : state) {
    const Query& q = queries[i];
    ids.clear();
    visited += static_cast<std::size_t>(bvh.query(q.a, q.b, q.tau, q.tau, ids));
    found += ids.size();
    i = (i + 1) % queries.size();
  }
  const auto iterations = static_cast<double>(state.iterations());
  state.counters["triangles"] = static_cast<double>(triangles.size());
  state.counters["crossing"] = static_cast<double>(found) / iterations;
  state.counters["visited"] = static_cast<double>(visited) / iterations;
}
BENCHMARK(BM_QueryByTriangles)->ArgName("triangles")->RangeMultiplier(10)->Range(10, 1000000);

void BM_BuildMesh(benchmark::State& state) {
  const Triangles triangles = mesh();
  for (auto _ : state) benchmark::DoNotOptimize(EllipsoidBvh(triangles));
}
BENCHMARK(BM_BuildMesh)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace isochron
