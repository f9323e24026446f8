// Surfaces that a fit begins with, from depths that are given.
#include "optim/reconstruct/start_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>

namespace isochron {
namespace {

constexpr int kSide = 48;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Voxels of side 1; `depth` of the line (across, up), each from 0 to kSide. All of its albedo is there.
struct HiddenLines {
  LikelyAlbedos volume;
  explicit HiddenLines(
      const std::function<double(int, int)>& depth,
      const std::function<double(int, int)>& albedo = [](int, int) { return 1.0; }) {
    volume.frame = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int i = 0; i <= kSide; ++i) {
      volume.across.push_back(i);
      volume.up.push_back(i);
      volume.depth.push_back(i + 0.5);
    }
    volume.albedo.assign(volume.across.size() * volume.up.size() * volume.depth.size(), 0);
    volume.resolution = 4;
    for (int u = 0; u <= kSide; ++u)
      for (int a = 0; a <= kSide; ++a)
        if (const double d = depth(a, u) - 0.5; std::isfinite(d)) {
          const auto before = static_cast<std::size_t>(d);
          const double behind = d - static_cast<double>(before);
          volume.albedo[volume.index(before, u, a)] = static_cast<float>((1 - behind) * albedo(a, u));
          volume.albedo[volume.index(before + 1, u, a)] = static_cast<float>(behind * albedo(a, u));
        }
  }
  Mesh start() const { return start_surface(volume); }
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

/// Blurred by four rounds of weights 1, 2, 1 a straight edge falls to 0.15 of the sheet's albedo 1.5 lines outside, to that of the margin two
/// lines outside. Cells of the grid and rounding take a part of that.
TEST(StartSurface, OfADiscIsADisc) {
  const Mesh mesh = HiddenLines([](int a, int u) { return from_middle(a, u) <= 12 ? 8.25 : kNone; }).start();
  EXPECT_EQ(borders(mesh), 1);
  const double radius = std::sqrt(area(mesh) / std::numbers::pi);
  EXPECT_GT(radius, 11.5);
  EXPECT_LT(radius, 14);
  for (const Vec3& p : mesh.positions) EXPECT_NEAR(p.z, 8.25, 0.01);
}

TEST(StartSurface, SmallHolesAreClosedAndLargeOnesAreNot) {
  const auto ring = [](double hole) {
    return HiddenLines([=](int a, int u) { return from_middle(a, u) <= 19 && from_middle(a, u) >= hole ? 8.0 : kNone; })
        .start();
  };
  EXPECT_EQ(borders(ring(2.5)), 1);
  EXPECT_EQ(borders(ring(9)), 2);
}

TEST(StartSurface, APieceAtAnotherDepthIsAPartOfItsOwn) {
  const auto plates = [](double gap, double step) {
    return HiddenLines([=](int a, int u) {
             return std::abs(u - 24) > 10 || std::abs(a - 24) > 19 || std::abs(a - 24) < gap ? kNone
                    : a < 24                                                                 ? 8
                                                                                             : 8 + step;
           })
        .start();
  };
  EXPECT_EQ(borders(plates(2.5, 0)), 1) << "margins that meet";
  EXPECT_EQ(borders(plates(7, 0)), 2);
  const Mesh apart = plates(2.5, 15);
  EXPECT_EQ(borders(apart), 2);
  for (const auto& f : apart.faces)
    EXPECT_NEAR(apart.positions[f[0]].z, apart.positions[f[1]].z, 1e-3) << "a face across the jump";
}

/// A cap whose steep sides send too little light for the outline but enough for the margin: that lies where the data have them, deeper than
/// one that goes on as flat as the cap's edge is.
TEST(StartSurface, TheMarginFollowsTheData) {
  const Mesh mesh = HiddenLines(
                        [](int a, int u) {
                          const double r = from_middle(a, u);
                          return r <= 18 ? 12.5 + 1.9 * std::max(0.0, r - 13) : kNone;
                        },
                        [](int a, int u) { return from_middle(a, u) <= 12 ? 1 : 0.1; })
                        .start();
  double deepest = 0;
  for (const Vec3& p : mesh.positions) deepest = std::max(deepest, p.z);
  EXPECT_GT(deepest, 13.2);
  EXPECT_LT(std::sqrt(area(mesh) / std::numbers::pi), 17);
}

/// Two squares whose margins meet at one line: borders() would see a vertex with two borders.
TEST(StartSurface, PiecesThatTouchAtACornerDoNotShareIt) {
  for (const int apart : {3, 4, 5, 6, 7, 8}) {
    const auto within = [](int i, int first) { return i >= first && i <= first + 10; };
    const Mesh mesh = HiddenLines([&](int a, int u) {
                        const int second = 7 + 10 + apart;
                        return (within(a, 7) && within(u, 7)) || (within(a, second) && within(u, second)) ? 8.0 : kNone;
                      }).start();
    EXPECT_EQ(borders(mesh), 2) << apart;
  }
}

/// A sheet that is torn from one end on: its halves part by a line's length from row to row.
TEST(StartSurface, ATearEndsWhereTheJumpDoes) {
  const Mesh mesh = HiddenLines([](int a, int u) { return u > 42 ? kNone : a <= 24 ? 5.0 : 5.0 + u; }).start();
  EXPECT_EQ(borders(mesh), 1);
  for (const auto& f : mesh.faces) {
    const auto [low, high] = std::minmax({mesh.positions[f[0]].z, mesh.positions[f[1]].z, mesh.positions[f[2]].z});
    EXPECT_LT(high - low, 4 * std::sqrt(2) * 2 + 1e-9);
  }
}

/// Beyond the outline some albedo is left, but little.
TEST(StartSurface, EndsWhereTheAlbedoIsFarBelowThatOfItsLight) {
  const auto radius = [](double beyond) {
    const Mesh mesh = HiddenLines([](int a, int u) { return from_middle(a, u) <= 18 ? 8.5 : kNone; },
                                  [=](int a, int u) { return from_middle(a, u) <= 10 ? 1 : beyond; })
                          .start();
    return std::sqrt(area(mesh) / std::numbers::pi);
  };
  EXPECT_NEAR(radius(0.5), 18, 1);
  EXPECT_NEAR(radius(0.1), 10 + 4, 1) << "0.1 and 0.9 of the blurred edge are 0.15 two lines outside";
}

/// Beside a disc a small one far away, with a hundredth of its light and a third of that.
TEST(StartSurface, PartsWithHardlyAnyLightAreLeftOut) {
  const auto deepest = [](double albedo) {
    const auto far = [](int a, int u) { return std::hypot(a - 40, u - 40) < 3.5; };
    const Mesh mesh =
        HiddenLines([&](int a, int u) { return far(a, u)                 ? 40.5
                                               : from_middle(a, u) <= 10 ? 20.5
                                                                         : kNone; },
                    [&](int a, int u) { return far(a, u) ? albedo : 1; })
            .start();
    double z = 0;
    for (const Vec3& p : mesh.positions) z = std::max(z, p.z);
    return z;
  };
  EXPECT_NEAR(deepest(4), 40.5, 0.5);
  EXPECT_NEAR(deepest(0.4), 20.5, 0.5);
}

/// Each rounding would halve it. It is there wherever it lies in the grid of cells.
TEST(StartSurface, APartOfOneCellKeepsAQuarterOfItsArea) {
  for (const auto& [across, up] : {std::pair{23, 23}, {23, 24}, {24, 23}, {24, 24}}) {
    HiddenLines lines([=](int a, int u) { return a == across && u == up ? 10.5 : kNone; });
    lines.volume.resolution = 1;
    const Mesh mesh = lines.start();
    ASSERT_EQ(mesh.faces.size(), 2u) << across << " " << up;
    EXPECT_NEAR(area(mesh), 1, 1e-6);
  }
}

/// A line whose blurred albedo reaches a twentieth of the disc's in its middle alone. So near the wall it has more light than the disc.
TEST(StartSurface, SpecksAreLeftOut) {
  const auto nearest = [](double albedo) {
    const Mesh mesh = HiddenLines(
                          [](int a, int u) {
                            if (a == 4 && u == 4) return 4.5;
                            return from_middle(a, u) <= 10 ? 40.5 : kNone;
                          },
                          [=](int a, int u) { return a == 4 && u == 4 ? albedo : 1; })
                          .start();
    double z = kSide;
    for (const Vec3& p : mesh.positions) z = std::min(z, p.z);
    return z;
  };
  EXPECT_NEAR(nearest(0.72), 40.5, 0.5);
  EXPECT_NEAR(nearest(20), 4.5, 0.5) << "no speck any more";
}

TEST(StartSurface, IsEmptyWhereNothingIsSignificant) {
  EXPECT_TRUE(HiddenLines([](int, int) { return kNone; }).start().faces.empty());
  EXPECT_TRUE(start_surface(LikelyAlbedos()).faces.empty());
}

}  // namespace
}  // namespace isochron
