// Sobol points and their scramble, by the properties that define them.
#include "core/base/sobol.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/random.h"
#include "tests/base/chi_square.h"

namespace isochron {
namespace {

using Point = std::array<std::uint32_t, kSobolDimensions>;

template <class F>
Point assemble(F&& block) {
  Point point{};
  for (std::uint32_t b = 0; b < kSobolBlocks; ++b) {
    const SobolBlock four = block(b);
    std::copy(four.begin(), four.end(), point.begin() + 4 * b);
  }
  return point;
}

Point plain(std::uint32_t index) {
  Point point = assemble([=](std::uint32_t b) { return reversed_sobol(index, b); });
  for (auto& x : point) x = reverse_bits(x);
  return point;
}

Point scrambled(std::uint64_t key, std::uint32_t index) {
  return assemble([=](std::uint32_t b) { return scrambled_sobol(key, index, b); });
}

std::uint64_t random_key(std::uint32_t k) {
  return Rng({11, 0, 0}, k, 0).scramble_key();
}

/// Whether the points hold one in each of the boxes that bits_x halvings of one axis and bits_y of the other make.
bool one_in_each(const std::vector<Point>& points, int x, int bits_x, int y, int bits_y) {
  const auto first = [](std::uint32_t value, int bits) { return bits == 0 ? 0 : value >> (32 - bits); };
  std::vector<char> met(points.size());
  for (const Point& p : points) {
    char& box = met[first(p[x], bits_x) << bits_y | first(p[y], bits_y)];
    if (box) return false;
    box = true;
  }
  return true;
}

/// Points [0, 2^k), then the next 2^k and so on: one in each interval of width 2^-k in every dimension, and in each box
/// of area 2^-k in the first two.
template <class F>
void expect_even(F&& point) {
  for (int k = 0; k <= 10; ++k)
    for (std::uint32_t set : {0u, 1u, 2u, 5u}) {
      std::vector<Point> points;
      for (std::uint32_t i = 0; i < 1u << k; ++i) points.push_back(point((set << k) + i));
      for (int d = 0; d < kSobolDimensions; ++d) ASSERT_TRUE(one_in_each(points, d, k, d, 0)) << d << " of " << k;
      for (int a = 0; a <= k; ++a) ASSERT_TRUE(one_in_each(points, 0, a, 1, k - a)) << a << " of " << k;
    }
}

TEST(Sobol, OneInEachElementaryInterval) {
  expect_even(plain);
}

TEST(Sobol, StillSoAfterScrambling) {
  for (std::uint32_t k = 0; k < 4; ++k)
    expect_even([key = random_key(k)](std::uint32_t i) { return scrambled(key, i); });
}

// Irreducible polynomials of degrees e and f, coprime, make a (t, 2)-sequence with t = e - 1 + f - 1: of 2^k points, each
// box of area 2^(t - k) holds 2^t. (The first dimension counts as of degree 1.) A polynomial with factors fails.
TEST(Sobol, PairsOfDimensionsFillBoxes) {
  constexpr int kDegrees[kSobolDimensions] = {1, 1, 2, 3, 3, 4, 4, 5, 5, 5, 5, 5, 5, 6, 6, 6};
  constexpr int kMostBits = 5;
  std::vector<Point> points;
  for (std::uint32_t i = 0; i < 1u << (10 + kMostBits); ++i) points.push_back(plain(i));
  for (int x = 0; x < kSobolDimensions; ++x)
    for (int y = 0; y < x; ++y)
      for (int bits = 1; bits <= kMostBits; ++bits)
        for (int a = 1; a < bits; ++a) {
          const int t = kDegrees[x] + kDegrees[y] - 2, b = bits - a;
          std::vector<int> counts(std::size_t{1} << bits);
          for (std::size_t i = 0; i < std::size_t{1} << (t + bits); ++i)
            ++counts[points[i][x] >> (32 - a) << b | points[i][y] >> (32 - b)];
          for (int count : counts) ASSERT_EQ(count, 1 << t) << x << ' ' << y << ": " << a << ' ' << b;
        }
}

// The lowest bits, too, are a permutation: all 32 directions of a dimension are independent over GF(2).
TEST(Sobol, DirectionsAreIndependent) {
  for (std::uint32_t d = 0; d < kSobolDimensions; ++d)
    for (int bit = 0; bit < 32; ++bit) {
      const std::uint32_t v = kSobolDirections[d / 4][bit][d % 4];
      EXPECT_EQ(v >> bit, 1u);  // bit `bit` and lower ones only: triangular
    }
}

TEST(Sobol, ScrambleIsNested) {
  // Fractions that share their first bits still do, and those that differ next still do.
  Rng rng({12, 0, 0}, 0, 0);
  const auto word = [&] { return static_cast<std::uint32_t>(rng.uniform() * 0x1p32); };
  for (int i = 0; i < 100000; ++i) {
    const std::uint64_t key = random_key(static_cast<std::uint32_t>(i));
    const int common = i % 32;
    const std::uint32_t next = std::uint32_t{1} << common, shared = next - 1;
    const std::uint32_t a = word(), b = (a & shared) | (~a & next) | (word() & ~shared & ~next);
    const std::uint32_t difference = nested_permutation(a, key) ^ nested_permutation(b, key);
    ASSERT_EQ(std::countr_zero(difference), common);
  }
}

// Over scrambles every coordinate of every point is uniform, and so is each pair of dimensions. 4 points with 16 + 120
// tests at |z| < 6.5 of a chi-square with 255 degrees of freedom, whose upper tail is heavier than the normal one
// (2e-9 at 6.5 by Wilson and Hilferty): false alarm 1e-6.
TEST(Sobol, UniformOverScrambles) {
  constexpr int kKeys = 1 << 15, kSide = 16;
  for (const std::uint32_t index : {0u, 1u, 6u, 1000u}) {
    std::vector<std::vector<int>> single(kSobolDimensions, std::vector<int>(256)), pairs(120, std::vector<int>(256));
    for (std::uint32_t k = 0; k < kKeys; ++k) {
      const Point p = scrambled(random_key(k), index);
      for (int a = 0, pair = 0; a < kSobolDimensions; ++a) {
        ++single[a][p[a] >> 24];
        for (int b = 0; b < a; ++b, ++pair) ++pairs[pair][(p[a] >> 28) * kSide + (p[b] >> 28)];
      }
    }
    for (const auto& counts : single) EXPECT_LT(std::abs(chi_square_z(counts, kKeys / 256.0)), 6.5) << index;
    for (const auto& counts : pairs) EXPECT_LT(std::abs(chi_square_z(counts, kKeys / 256.0)), 6.5) << index;
  }
}

// As Owen's scramble: the flips of a bit are independent for different bits above it. The first three bits of the 8
// eighths have 1 + 2 + 4 = 7 flips, so 128 equally likely outcomes in each dimension. 16 tests with 127 degrees of
// freedom at |z| < 6.5: false alarm below 1e-6.
TEST(Sobol, FlipsOfTheEighthsAreIndependent) {
  constexpr int kKeys = 1 << 15;
  std::vector<std::vector<int>> counts(kSobolDimensions, std::vector<int>(128));
  for (std::uint32_t k = 0; k < kKeys; ++k) {
    std::array<Point, 8> points;
    for (std::uint32_t i = 0; i < 8; ++i) points[i] = scrambled(random_key(k), i);
    for (int d = 0; d < kSobolDimensions; ++d) {
      std::array<std::uint32_t, 8> to{};  // eighth -> eighth
      for (std::uint32_t i = 0; i < 8; ++i) to[plain(i)[d] >> 29] = points[i][d] >> 29;
      const std::uint32_t flips = to[0] >> 2 | (to[0] >> 1 & 1) << 1 | (to[4] >> 1 & 1) << 2 | (to[0] & 1) << 3 |
                                  (to[2] & 1) << 4 | (to[4] & 1) << 5 | (to[6] & 1) << 6;
      ++counts[d][flips];
    }
  }
  for (int d = 0; d < kSobolDimensions; ++d)
    EXPECT_LT(std::abs(chi_square_z(counts[d], kKeys / 128.0)), 6.5) << "dimension " << d;
}

TEST(Sobol, RngTakesPointsFirstAndIndependentNumbersAfter) {
  const Rng base = Rng({7, 3, 2}, 123, 0).in_set(4);
  const std::uint64_t key = base.scramble_key();
  EXPECT_NE(key, Rng({7, 3, 2}, 123, 0).in_set(5).scramble_key());
  Rng with = base.with_point(9, key, 5), without = base.with_sample(9);
  const Point point = scrambled(key, 5);
  for (int i = 0; i < 40; ++i) {
    const double u = with.uniform(), philox = without.uniform();
    EXPECT_EQ(u, i < kSobolDimensions ? (point[i] + 0.5) * 0x1p-32 : philox);
  }
}

}  // namespace
}  // namespace isochron
