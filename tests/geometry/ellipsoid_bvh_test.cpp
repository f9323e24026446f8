#include "core/geometry/ellipsoid_bvh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>

#include "core/base/constants.h"
#include "core/geometry/ellipsoid.h"

namespace isochron {
namespace {

using Triangles = std::vector<EllipsoidBvh::Input>;

class Generator {
 public:
  explicit Generator(std::uint64_t seed) : rng_(test_seed(seed)) {}
  double uniform(double lo = 0, double hi = 1) { return lo + (hi - lo) * uniform_(rng_); }
  Vec3 vec(double scale) { return {uniform(-scale, scale), uniform(-scale, scale), uniform(-scale, scale)}; }
  /// Triangles of sizes between 1 % of the scene and the whole of it.
  Triangles soup(int count, double scale, const Vec3& offset) {
    Triangles triangles;
    for (int i = 0; i < count; ++i) {
      const Vec3 c = vec(scale) + offset;
      const double size = scale * std::pow(10.0, uniform(-2, 0.3));
      triangles.push_back({{c + vec(size), c + vec(size), c + vec(size)}, 1000 + i});
    }
    return triangles;
  }

 private:
  std::mt19937_64 rng_;
  std::uniform_real_distribution<double> uniform_;
};

/// A sphere with ripples: 2 * rings * (2 * rings) triangles or so.
Triangles rippled_sphere(int rings, double radius) {
  const auto point = [&](int i, int j) {
    const double theta = kPi * i / rings, phi = kPi * j / rings;
    const double r = radius * (1 + 0.05 * std::sin(9 * theta) * std::cos(7 * phi));
    return Vec3{r * std::sin(theta) * std::cos(phi), r * std::sin(theta) * std::sin(phi), r * std::cos(theta)};
  };
  Triangles triangles;
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < 2 * rings; ++j) {
      const int id = static_cast<int>(triangles.size());
      if (i > 0) triangles.push_back({{point(i, j), point(i + 1, j), point(i, j + 1)}, id});
      if (i + 1 < rings) triangles.push_back({{point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)}, id + 1});
    }
  return triangles;
}

struct Tally {
  int crossing = 0, missed = 0, extra = 0, twice = 0;
  int between = 0, between_reported = 0;  ///< by `query_surfaces`, in meshes that are not small
};

/// Compares a query with a scan over all triangles. What must be found: triangles with arcs at either end of
/// the shell or in between, and those with a vertex in it. What may be found: those that reach out of the
/// inner ellipsoid (lengths are convex: at a vertex) and into the outer one (at a vertex, or in an arc). The query
/// for the two surfaces must find those with arcs at either end, nothing that the whole query does not, and it is
/// to leave out those that lie strictly between.
void compare(const Triangles& triangles, const EllipsoidBvh& bvh, const Vec3& a, const Vec3& b, double tau_low,
             double tau_high, Tally& tally) {
  std::vector<int> ids;
  bvh.query(a, b, tau_low, tau_high, ids);
  const std::set<int> found(ids.begin(), ids.end());
  tally.twice += ids.size() != found.size();
  std::vector<int> surface_ids;
  bvh.query_surfaces(a, b, tau_low, tau_high, surface_ids);
  const std::set<int> on_surfaces(surface_ids.begin(), surface_ids.end());
  tally.twice += surface_ids.size() != on_surfaces.size();
  tally.extra += !std::includes(found.begin(), found.end(), on_surfaces.begin(), on_surfaces.end());
  const auto arcs_at = [&](const EllipsoidBvh::Input& t, double tau) {
    EllipseArcs arcs;
    return clip_ellipse(Ellipsoid(a, b, tau), t.vertex[0], t.vertex[1], t.vertex[2], arcs);
  };
  for (const EllipsoidBvh::Input& t : triangles) {
    double s[3];
    for (std::size_t i = 0; i < 3; ++i) s[i] = length(t.vertex[i] - a) + length(t.vertex[i] - b);
    const double longest = std::max({s[0], s[1], s[2]}), shortest = std::min({s[0], s[1], s[2]});
    const bool reaches_in = shortest <= tau_high || arcs_at(t, tau_high);
    const bool may = longest >= tau_low && reaches_in;
    bool must = arcs_at(t, tau_low) || arcs_at(t, tau_high) || arcs_at(t, (tau_low + tau_high) / 2);
    for (const double x : s) must = must || (x >= tau_low && x <= tau_high);
    const bool reported = found.contains(t.id), surface = arcs_at(t, tau_low) || arcs_at(t, tau_high);
    tally.missed += surface && !on_surfaces.contains(t.id);
    if (triangles.size() > 100 && !surface && shortest > tau_low && longest < tau_high) {
      ++tally.between;
      tally.between_reported += on_surfaces.contains(t.id);
    }
    tally.crossing += must, tally.missed += must && !reported, tally.extra += reported && !may;
  }
}

TEST(EllipsoidBvh, FindsWhatAScanFinds) {
  Generator random(7);
  Tally tally;
  for (const int count : {1, 3, 8, 9, 16, 17, 60, 400})
    for (const double scale : {1e-3, 1.0, 1e3})
      for (const Vec3& offset : {Vec3{0, 0, 0}, Vec3{100 * scale, -1000 * scale, 3 * scale}}) {
        const Triangles triangles = random.soup(count, scale, offset);
        const EllipsoidBvh bvh(triangles);
        EXPECT_FALSE(bvh.empty());
        for (int k = 0; k < 200; ++k) {
          const Vec3 a = random.vec(1.5 * scale) + offset;
          const Vec3 b = k % 5 == 0 ? a : random.vec(1.5 * scale) + offset;
          const double distance = length(b - a);
          // From thin to fat, from a single length to a thick shell that may begin below the focal distance.
          const double high = distance * (1 + std::pow(10.0, random.uniform(-6, 0))) + (k % 5 ? 0 : scale);
          const double low = k % 3 == 0 ? high : high - scale * std::pow(10.0, random.uniform(-4, 1));
          compare(triangles, bvh, a, b, low, high, tally);
        }
      }
  EXPECT_EQ(tally.missed, 0);
  EXPECT_EQ(tally.twice, 0);
  EXPECT_GT(tally.crossing, 20000);
  EXPECT_GT(tally.between, 1000);
  EXPECT_LT(tally.between_reported, tally.between / 20);  // bounds of large triangles are not tight
  EXPECT_LT(tally.extra, tally.crossing / 1000);          // round-off: lengths that pass through a vertex
}

TEST(EllipsoidBvh, FindsWhatAScanFindsOnAMesh) {
  const Triangles triangles = rippled_sphere(40, 1);
  const EllipsoidBvh bvh(triangles);
  Generator random(8);
  Tally tally;
  for (int k = 0; k < 400; ++k) {
    const Vec3 a = random.vec(2), b = random.vec(2);
    const Vec3& target = triangles[static_cast<std::size_t>(random.uniform(0, 1) * 3000)].vertex[0];
    const double tau = length(target - a) + length(target - b);
    compare(triangles, bvh, a, b, tau * (k % 2 ? 1 : 0.98), tau, tally);
  }
  EXPECT_EQ(tally.missed, 0);
  EXPECT_GT(tally.crossing, 10000);
  EXPECT_LT(tally.extra, tally.crossing / 1000);  // round-off: lengths that pass through a vertex
}

TEST(EllipsoidBvh, VeryThinEllipsoidsAreNeverMissed) {
  // Relative excess down to 1e-13: round-off may add triangles here, never lose one.
  Generator random(9);
  const Triangles triangles = random.soup(300, 1, {5, 5, 5});
  const EllipsoidBvh bvh(triangles);
  Tally tally;
  for (int k = 0; k < 2000; ++k) {
    const Vec3 a = random.vec(1) + Vec3{5, 5, 5}, b = random.vec(1) + Vec3{5, 5, 5};
    const double tau = length(b - a) * (1 + std::pow(10.0, random.uniform(-13, -6)));
    compare(triangles, bvh, a, b, k % 2 ? tau : 0, tau, tally);
  }
  EXPECT_EQ(tally.missed, 0);
  EXPECT_GT(tally.crossing, 3000);
  EXPECT_LT(tally.extra, tally.crossing / 10);
}

TEST(EllipsoidBvh, LargeTriangleAroundTheWholeEllipse) {
  // All vertices far outside, only the plane is cut. A second triangle is parallel, just out of reach.
  const double h = 1 + 1e-9;
  const Triangles triangles = {{{Vec3{-1e3, -1e3, 1}, {1e3, -1e3, 1}, {0, 1e3, 1}}, 4},
                               {{Vec3{-1e3, -1e3, -h}, {1e3, -1e3, -h}, {0, 1e3, -h}}, 5}};
  std::vector<int> ids;
  EllipsoidBvh(triangles).query({0, 0, 0}, {0, 0, 0}, 2 + 1e-9, 2 + 1e-9, ids);
  EXPECT_EQ(ids, std::vector<int>{4});
}

TEST(EllipsoidBvh, LimitsOfTheShell) {
  const Triangles triangles = rippled_sphere(12, 1);
  const EllipsoidBvh bvh(triangles);
  const Vec3 a{-0.2, 0, 0}, b{0.3, 0.1, 0};
  const double distance = length(b - a), inf = std::numeric_limits<double>::infinity();
  std::vector<int> ids{-7};
  bvh.query(a, b, 0, distance, ids);
  bvh.query(a, b, 0, std::nan(""), ids);
  bvh.query({inf, 0, 0}, b, 0, 9, ids);
  bvh.query({std::nan(""), 0, 0}, b, 0, inf, ids);
  EXPECT_EQ(ids, std::vector<int>{-7}) << "queries append, and these find nothing";
  ids.clear();
  bvh.query(a, b, 0, 100, ids);
  EXPECT_EQ(ids.size(), triangles.size());
  ids.clear();
  bvh.query(a, b, -inf, inf, ids);
  EXPECT_EQ(ids.size(), triangles.size());
  ids.clear();
  bvh.query(a, b, 4, inf, ids);
  EXPECT_TRUE(ids.empty());
  bvh.query(a, b, 1.9, 2.0, ids);
  std::vector<int> again;
  EllipsoidBvh(triangles).query(a, b, 1.9, 2.0, again);
  EXPECT_FALSE(ids.empty());
  EXPECT_EQ(ids, again) << "the order is the hierarchy's";
}

TEST(EllipsoidBvh, EmptyAndDegenerateInput) {
  std::vector<int> ids;
  EXPECT_TRUE(EllipsoidBvh().empty());
  EXPECT_TRUE(EllipsoidBvh(Triangles{}).empty());
  EllipsoidBvh().query({0, 0, 0}, {1, 0, 0}, 0, 9, ids);
  EllipsoidBvh(Triangles{}).query({0, 0, 0}, {1, 0, 0}, 0, 9, ids);
  EXPECT_TRUE(ids.empty());
  // One that is not finite among equal ones: splitting by position is impossible.
  Triangles triangles(100, {{Vec3{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, 1});
  triangles[50].vertex[1].y = std::nan("");
  triangles[51].vertex[2].x = std::numeric_limits<double>::infinity();
  EllipsoidBvh bvh(triangles);
  bvh.query({0, 0, 1}, {0, 0, 1}, 2.1, 2.2, ids);
  EXPECT_EQ(ids.size(), 98u);
  EXPECT_TRUE(EllipsoidBvh(Triangles(3, triangles[50])).empty());
  // Sizes and positions over many orders of magnitude: splits go wrong one by one, the depth stays bounded.
  triangles.clear();
  for (int i = 0; i < 2000; ++i) {
    const double s = std::exp2(-i * 0.2);
    triangles.push_back({{Vec3{s, 0, 0}, {2 * s, 0, 0}, {s, s, 0}}, i});
  }
  ids.clear();
  bvh = EllipsoidBvh(triangles);
  bvh.query({0, 0, 0}, {0, 0, 0}, 0, 10, ids);
  EXPECT_EQ(ids.size(), triangles.size());
}

}  // namespace
}  // namespace isochron
