// The thinned query: a random choice of the triangles that an ellipsoid crosses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/constants.h"
#include "core/base/random.h"
#include "core/geometry/ellipsoid.h"
#include "core/geometry/ellipsoid_bvh.h"

namespace isochron {
namespace {

/// A bumpy sphere of 2 * rows^2 triangles about.
std::vector<EllipsoidBvh::Input> bumpy_sphere(int rows) {
  const auto point = [&](int i, int j) {
    const double theta = kPi * i / rows, phi = kPi * j / rows;
    const double r = 1 + 0.05 * std::sin(9 * theta) * std::cos(7 * phi);
    return Vec3{r * std::sin(theta) * std::cos(phi), r * std::sin(theta) * std::sin(phi), r * std::cos(theta)};
  };
  std::vector<EllipsoidBvh::Input> triangles;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < 2 * rows; ++j)
      for (const auto& corners : {std::array{point(i, j), point(i + 1, j), point(i, j + 1)},
                                  std::array{point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)}})
        triangles.push_back({corners, static_cast<int>(triangles.size())});
  return triangles;
}

/// Length of the arc in the ellipse's angle, over the squared distances: like what connections carry.
double carried(const Ellipsoid& e, const EllipsoidBvh::Focus& a, const EllipsoidBvh::Focus& b,
               const EllipsoidBvh::Input& t) {
  EllipseArcs arcs;
  if (!clip_ellipse(e, t.vertex[0], t.vertex[1], t.vertex[2], arcs)) return 0;
  const Vec3 p = arcs.point_at(0.5), to_a = p - a.p, to_b = p - b.p;
  const double cos_a = dot(to_a, a.axis) / length(to_a), cos_b = dot(to_b, b.axis) / length(to_b);
  if (cos_a < a.cosine || cos_b < b.cosine) return 0;
  return arcs.total_span / (dot(to_a, to_a) * dot(to_b, to_b)) * (a.lambertian ? cos_a : 1) *
         (b.lambertian ? cos_b : 1);
}

struct Setting {
  EllipsoidBvh::Focus a, b;
  double tau_low, tau_high;
};
/// A camera that sees a part, a lamp at grazing incidence, both lengths of a pair.
const Setting kSettings[] = {
    {{{3, 0.5, 0.2}, {-1, 0, 0}, 0.97, std::sqrt(1 - 0.97 * 0.97), false},
     {{0, 3, 1}, {0, -1, 0}, 0, 1, true},
     5.1,
     5.1},
    {{{0, 1.2, 0}, {0, -0.6, 0.8}, 0, 1, true}, {{0.5, 1.6, 0}, {0, -1, 0}, 0, 1, true}, 1.30, 1.35},
    {{{1.5, 1.5, 0}, {0, 0, 0}, 0, 1, false}, {{1.5, 1.5, 0}, {-0.6, -0.8, 0}, 0, 1, true}, 3.0, 3.0},
};

// E[sum of carried / probability] is the sum over all triangles. Each sum is off by more than 4.5 of its standard errors
// with a probability of 7e-6; 3 settings x 2 meshes x 2 lengths. Weights that ignored a thinning are off by tens.
TEST(ThinnedQuery, CarriesOnAverageWhatAllTrianglesDo) {
  for (const int rows : {40, 200}) {
    const auto triangles = bumpy_sphere(rows);
    const EllipsoidBvh bvh(triangles);
    for (const Setting& s : kSettings)
      for (const double tau : {s.tau_low, s.tau_high}) {
        const Ellipsoid ellipsoid(s.a.p, s.b.p, tau);
        std::vector<double> contribution;
        double expected = 0;
        for (const auto& t : triangles) {
          contribution.push_back(carried(ellipsoid, s.a, s.b, t));
          expected += contribution.back();
        }
        ASSERT_GT(expected, 0);
        constexpr int kSamples = 4000;
        double sum = 0, squares = 0, found = 0;
        std::vector<int> ids;
        std::vector<double> inverse_probability;
        for (int i = 0; i < kSamples; ++i) {
          Rng rng({5, 0, 0}, static_cast<std::uint64_t>(rows), static_cast<std::uint32_t>(i));
          ids.clear();
          inverse_probability.clear();
          bvh.sample_surfaces(s.a, s.b, s.tau_low, s.tau_high, rng.uniform(), ids, inverse_probability);
          ASSERT_EQ(ids.size(), inverse_probability.size());
          double x = 0;
          for (std::size_t k = 0; k < ids.size(); ++k) {
            ASSERT_GE(inverse_probability[k], 1);
            x += contribution[static_cast<std::size_t>(ids[k])] * inverse_probability[k];
          }
          sum += x;
          squares += x * x;
          found += static_cast<double>(ids.size()) / kSamples;
        }
        const double mean = sum / kSamples;
        const double error = std::sqrt((squares / kSamples - mean * mean) / kSamples);
        std::printf("%6zu triangles: %8.1f found, mean / sum %.4f, deviation of one %.2f\n", triangles.size(), found,
                    mean / expected, error * std::sqrt(kSamples) / expected);
        EXPECT_NEAR(mean, expected, 4.5 * error) << triangles.size() << " triangles, length " << tau;
        EXPECT_LT(error, 0.02 * expected);
        EXPECT_LT(found, 150);  // leaves of eight triangles, some more than kept
      }
  }
}

// A small mesh is not thinned: all that the ellipsoids cross are found, and next to none that they do not.
TEST(ThinnedQuery, FindsAllOfASmallMesh) {
  const auto triangles = bumpy_sphere(5);
  const EllipsoidBvh bvh(triangles);
  for (const Setting& s : kSettings) {
    std::vector<int> all, ids;
    std::vector<double> inverse_probability;
    bvh.query_surfaces(s.a.p, s.b.p, s.tau_low, s.tau_high, all);
    bvh.sample_surfaces(s.a, s.b, s.tau_low, s.tau_high, 0.5, ids, inverse_probability);
    EXPECT_EQ(inverse_probability, std::vector<double>(ids.size(), 1.0));
    std::ranges::sort(all);
    std::ranges::sort(ids);
    EXPECT_TRUE(std::ranges::includes(ids, all));
    // Callers clip each: what only comes close to the ellipsoid is a few in a hundred here.
    EXPECT_LE(ids.size(), all.size() + 2) << "of " << triangles.size();
  }
}

// Scenes scaled by a power of two give the same choice.
TEST(ThinnedQuery, DoesNotDependOnTheUnitOfLength) {
  auto triangles = bumpy_sphere(60);
  const EllipsoidBvh bvh(triangles);
  for (const double scale : {std::exp2(-10), std::exp2(10)}) {
    auto scaled = triangles;
    for (auto& t : scaled)
      for (Vec3& v : t.vertex) v *= scale;
    const EllipsoidBvh scaled_bvh(scaled);
    for (Setting s : kSettings) {
      std::vector<int> ids, scaled_ids;
      std::vector<double> weights, scaled_weights;
      bvh.sample_surfaces(s.a, s.b, s.tau_low, s.tau_high, 0.3, ids, weights);
      s.a.p *= scale;
      s.b.p *= scale;
      scaled_bvh.sample_surfaces(s.a, s.b, s.tau_low * scale, s.tau_high * scale, 0.3, scaled_ids, scaled_weights);
      EXPECT_EQ(ids, scaled_ids);
      EXPECT_EQ(weights, scaled_weights);
    }
  }
}

}  // namespace
}  // namespace isochron
