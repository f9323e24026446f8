// Surfaces that a fit begins with, from depths that are given.
#include "optim/reconstruct/start_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <utility>

namespace isochron {
namespace {

constexpr int kSide = 30;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Voxels of side 1; `depth` of the line (across, up), each from 0 to kSide.
struct Lines {
  BackProjection volume;
  FirstSurface first;
  explicit Lines(const std::function<double(int, int)>& depth) {
    volume.frame = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int i = 0; i <= kSide; ++i) {
      volume.across.push_back(i);
      volume.up.push_back(i);
      volume.depth.push_back(i + 0.5);
    }
    volume.albedo.assign(volume.across.size() * volume.up.size() * volume.depth.size(), 0);
    volume.significance = volume.albedo;
    volume.lateral_resolution = 2;
    for (int u = 0; u <= kSide; ++u)
      for (int a = 0; a <= kSide; ++a) first.depth.push_back(depth(a, u));
  }
  Mesh start() const { return start_surface(volume, first); }
};

double from_middle(int a, int u) {
  return std::hypot(a - kSide / 2, u - kSide / 2);
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& f : mesh.faces)
    sum -= 0.5 * cross(mesh.positions[f[1]] - mesh.positions[f[0]], mesh.positions[f[2]] - mesh.positions[f[0]]).z;
  return sum;
}

/// Closed lines of a clean mesh's border: faces look at the wall, each side is one's only, no vertex has two borders.
int borders(const Mesh& mesh) {
  std::set<std::pair<int, int>> sides;
  for (const auto& f : mesh.faces) {
    EXPECT_LT(cross(mesh.positions[f[1]] - mesh.positions[f[0]], mesh.positions[f[2]] - mesh.positions[f[0]]).z, 0);
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(sides.emplace(f[k], f[(k + 1) % 3]).second);
  }
  std::map<int, int> next;
  for (const auto& [from, to] : sides) {
    if (sides.contains({to, from})) continue;
    EXPECT_TRUE(next.emplace(from, to).second) << "a pinch";
  }
  int loops = 0;
  for (; !next.empty(); ++loops)
    for (auto side = next.begin(); side != next.end();) {
      const int to = side->second;
      next.erase(side);
      side = next.find(to);
    }
  return loops;
}

TEST(StartSurface, OfADiscIsADiscWithAMargin) {
  const Mesh mesh = Lines([](int a, int u) { return from_middle(a, u) <= 7 ? 5.25 : kNone; }).start();
  EXPECT_EQ(borders(mesh), 1);
  // A margin of two, of which cells of the grid and rounding take a part.
  EXPECT_GT(area(mesh), 3.14159 * 7.5 * 7.5);
  EXPECT_LT(area(mesh), 3.14159 * 9.5 * 9.5);
  for (const Vec3& p : mesh.positions) EXPECT_NEAR(p.z, 5.25, 1e-12);
}

TEST(StartSurface, SmallHolesAreClosedAndLargeOnesAreNot) {
  const auto ring = [](double hole) {
    return Lines([=](int a, int u) { return from_middle(a, u) <= 11 && from_middle(a, u) >= hole ? 5.0 : kNone; })
        .start();
  };
  EXPECT_EQ(borders(ring(2.5)), 1);
  EXPECT_EQ(borders(ring(6)), 2);
}

TEST(StartSurface, APieceAtAnotherDepthIsAPartOfItsOwn) {
  const auto plates = [](double gap, double step) {
    return Lines([=](int a, int u) {
             return std::abs(u - 15) > 6 || std::abs(a - 15) > 12 || std::abs(a - 15) < gap ? kNone
                    : a < 15                                                                ? 5
                                                                                            : 5 + step;
           })
        .start();
  };
  EXPECT_EQ(borders(plates(1.5, 0)), 1) << "margins that meet";
  EXPECT_EQ(borders(plates(4, 0)), 2);
  const Mesh apart = plates(1.5, 15);
  EXPECT_EQ(borders(apart), 2);
  for (const auto& f : apart.faces)
    EXPECT_NEAR(apart.positions[f[0]].z, apart.positions[f[1]].z, 1e-12) << "a face across the jump";
}

/// A cap whose steep sides are not significant: the margin lies where the data have them.
TEST(StartSurface, TheMarginFollowsTheData) {
  const auto cap = [](int a, int u) { return 8.5 + std::max(0.0, from_middle(a, u) - 6); };
  Lines lines([&](int a, int u) { return from_middle(a, u) <= 6 ? cap(a, u) : kNone; });
  for (int u = 0; u <= kSide; ++u)
    for (int a = 0; a <= kSide; ++a) {
      const auto d = static_cast<std::size_t>(std::min(29.0, std::floor(cap(a, u))));
      lines.volume.albedo[lines.volume.index(d, u, a)] = 1;
    }
  double deepest = 0;
  for (const Vec3& p : lines.start().positions) deepest = std::max(deepest, p.z);
  EXPECT_GT(deepest, 9.2);
}

/// Two squares whose margins meet at one line: borders() would see a vertex with two borders.
TEST(StartSurface, PiecesThatTouchAtACornerDoNotShareIt) {
  const auto within = [](int i, int first) { return i >= first && i <= first + 6; };
  const Mesh mesh = Lines([&](int a, int u) {
                      return (within(a, 4) && within(u, 4)) || (within(a, 14) && within(u, 14)) ? 5.0 : kNone;
                    }).start();
  EXPECT_EQ(borders(mesh), 2);
}

/// A sheet that is torn from one end on: its halves part by a line's length from row to row.
TEST(StartSurface, ATearEndsWhereTheJumpDoes) {
  const Mesh mesh = Lines([](int a, int u) { return a <= 15 ? 5.0 : 5.0 + u; }).start();
  EXPECT_EQ(borders(mesh), 1);
  for (const auto& f : mesh.faces) {
    const auto [low, high] = std::minmax({mesh.positions[f[0]].z, mesh.positions[f[1]].z, mesh.positions[f[2]].z});
    EXPECT_LT(high - low, 2 * std::sqrt(2) * 2 + 1e-9);
  }
}

/// A blurred outline: beyond it significant albedo is left, but little.
TEST(StartSurface, EndsWhereTheAlbedoIsFarBelowThatOfItsLight) {
  const auto radius = [](double beyond) {
    Lines lines([](int a, int u) { return from_middle(a, u) <= 11 ? 5.5 : kNone; });
    for (int u = 0; u <= kSide; ++u)
      for (int a = 0; a <= kSide; ++a)
        lines.volume.albedo[lines.volume.index(5, u, a)] = static_cast<float>(from_middle(a, u) <= 6 ? 1 : beyond);
    return std::sqrt(area(lines.start()) / 3.14159);
  };
  EXPECT_NEAR(radius(0.9), 12.5, 0.8);
  EXPECT_NEAR(radius(0.2), 7.5, 0.8);
}

/// Beside a disc a small one far away: 9 lines of 149, and (5.5^2 + 15^2 + 15^2)^2 / (25.5^2 + 25^2 + 25^2)^2 = 1 / 16 of the light of each.
TEST(StartSurface, PartsWithHardlyAnyLightAreLeftOut) {
  const auto deepest = [](float albedo) {
    const auto far = [](int a, int u) { return std::hypot(a - 25, u - 25) < 1.5; };
    Lines lines([&](int a, int u) { return far(a, u) ? 25.5 : from_middle(a, u) <= 7 ? 5.5 : kNone; });
    for (int u = 0; u <= kSide; ++u)
      for (int a = 0; a <= kSide; ++a)
        lines.volume.albedo[lines.volume.index(far(a, u) ? 25 : 5, u, a)] = far(a, u) ? albedo : 1;
    double z = 0;
    for (const Vec3& p : lines.start().positions) z = std::max(z, p.z);
    return z;
  };
  EXPECT_NEAR(deepest(4), 25.5, 0.5) << "15 parts in a thousand";
  EXPECT_NEAR(deepest(1), 5.5, 0.5) << "4 parts in a thousand";
}

TEST(StartSurface, IsEmptyWhereNothingIsSignificant) {
  EXPECT_TRUE(Lines([](int, int) { return kNone; }).start().faces.empty());
  EXPECT_TRUE(Lines([](int a, int u) { return a == 9 && u == 9 ? 5.0 : kNone; }).start().faces.empty()) << "a speck";
  EXPECT_TRUE(start_surface(BackProjection(), FirstSurface()).faces.empty());
}

}  // namespace
}  // namespace isochron
