#include "core/base/vec.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <random>

#include "tests/seed.h"

namespace isochron {
namespace {

TEST(Vec3, Algebra) {
  const Vec3 a{1, 2, 3}, b{-4, 5, 0.5};
  EXPECT_EQ(a + b, (Vec3{-3, 7, 3.5}));
  EXPECT_EQ(a - b, (Vec3{5, -3, 2.5}));
  EXPECT_EQ(-a, (Vec3{-1, -2, -3}));
  EXPECT_EQ(2.0 * a, (Vec3{2, 4, 6}));
  EXPECT_EQ(a / 2.0, (Vec3{0.5, 1, 1.5}));
  EXPECT_EQ(dot(a, b), 7.5);
  EXPECT_EQ(cross(a, b), (Vec3{-14, -12.5, 13}));
  EXPECT_EQ(length_squared(a), 14);
  EXPECT_DOUBLE_EQ(length(Vec3{2, 3, 6}), 7);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(a[i], i + 1);
}

TEST(Vec3, CrossIsRightHanded) {
  EXPECT_EQ(cross(Vec3{1, 0, 0}, Vec3{0, 1, 0}), (Vec3{0, 0, 1}));
  EXPECT_EQ(cross(Vec3{0, 1, 0}, Vec3{0, 0, 1}), (Vec3{1, 0, 0}));
}

// d|a|/da is the unit vector: the templates run on dual numbers.
TEST(Vec3, LengthOfDualNumbers) {
  using Jet = ceres::Jet<double, 3>;
  const Vec3T<Jet> a{Jet(2, 0), Jet(3, 1), Jet(6, 2)};
  const Jet l = length(a);
  EXPECT_DOUBLE_EQ(l.a, 7);
  for (int i = 0; i < 3; ++i) EXPECT_DOUBLE_EQ(l.v[i], a[i].a / 7);
}

void expect_frame(const Vec3& n) {
  Vec3 s, t;
  complete_frame(n, s, t);
  constexpr double kTolerance = 1e-15;  // nine roundings; how many there are depends on what the compiler fuses
  EXPECT_NEAR(length_squared(s), 1, 2 * kTolerance);
  EXPECT_NEAR(length_squared(t), 1, 2 * kTolerance);
  EXPECT_NEAR(dot(s, t), 0, kTolerance);
  EXPECT_NEAR(dot(s, n), 0, kTolerance);
  EXPECT_NEAR(dot(t, n), 0, kTolerance);
  EXPECT_NEAR(dot(cross(s, t), n), 1, 2 * kTolerance);
}

TEST(CompleteFrame, OrthonormalAndRightHanded) {
  std::mt19937 generator(test_seed(1));
  std::normal_distribution<double> normal;
  for (int i = 0; i < 10000; ++i)
    expect_frame(normalize(Vec3{normal(generator), normal(generator), normal(generator)}));
}

TEST(CompleteFrame, PolesAndEquator) {
  for (const double sign : {1.0, -1.0}) {
    expect_frame({0, 0, sign});
    expect_frame({sign, 0, 0.0});
    expect_frame({0, sign, -0.0});
    expect_frame(normalize(Vec3{1e-9, -1e-9, sign}));
    expect_frame(normalize(Vec3{1, -1, sign * 1e-300}));
  }
}

TEST(Rgb, Algebra) {
  const Rgb a(1, 2, 3), b(0.5);
  EXPECT_EQ(a + b, Rgb(1.5, 2.5, 3.5));
  EXPECT_EQ(a * b, Rgb(0.5, 1, 1.5));
  EXPECT_EQ(2.0 * a, Rgb(2, 4, 6));
  EXPECT_EQ(a.max(), 3);
  EXPECT_FALSE(a.is_black());
  EXPECT_TRUE(Rgb().is_black());
}

}  // namespace
}  // namespace isochron
