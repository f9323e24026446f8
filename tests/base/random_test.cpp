// Philox against the published known answers (Random123, kat_vectors), and the statistics of Rng.
#include "core/base/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/base/chi_square.h"
#include "tests/seed.h"

namespace isochron {
namespace {

using Block = std::array<std::uint32_t, 4>;

TEST(Philox, KnownAnswers) {
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (Block{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  const std::uint32_t f = 0xffffffff;
  EXPECT_EQ(philox({f, f, f, f}, {f, f}), (Block{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Block{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Rng, DependsOnItsArgumentsAlone) {
  const Stream stream{7, 3, 2};
  Rng a(stream, 12345, 6), b(stream, 12345, 6);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.uniform(), b.uniform());
}

TEST(Rng, UniformInOpenInterval) {
  constexpr int kBins = 1024, kSamples = 1 << 20;
  std::vector<int> counts(kBins);
  Rng rng({1, 0, 0}, 0, 0);
  for (int i = 0; i < kSamples; ++i) {
    const double u = rng.uniform();
    ASSERT_GT(u, 0);
    ASSERT_LT(u, 1);
    ++counts[static_cast<int>(u * kBins)];
  }
  EXPECT_LT(std::abs(chi_square_z(counts, double(kSamples) / kBins)), 5);
}

// The first numbers of neighbouring streams, taken in pairs, fill the square evenly whichever key component
// moves. Five tests at |z| < 5: false alarm 3e-6.
TEST(Rng, NeighbouringStreamsAreIndependent) {
  constexpr int kSide = 32, kPairs = 1 << 18;
  const auto first = [](int component, std::uint32_t k) {
    Stream stream{1, 0, 0};
    std::uint64_t index = 0;
    std::uint32_t sample = 0;
    if (component == 0) stream.seed = k;
    if (component == 1) stream.iteration = k;
    if (component == 2) stream.pass = k;
    if (component == 3) index = k;
    if (component == 4) sample = k;
    return Rng(stream, index, sample).uniform();
  };
  for (int component = 0; component < 5; ++component) {
    std::vector<int> counts(kSide * kSide);
    for (std::uint32_t k = 0; k < kPairs; ++k) {
      const int x = static_cast<int>(first(component, k) * kSide);
      const int y = static_cast<int>(first(component, k + 1) * kSide);
      ++counts[y * kSide + x];
    }
    EXPECT_LT(std::abs(chi_square_z(counts, double(kPairs) / counts.size())), 5) << "component " << component;
  }
}

// What a choice among 2^24 leaves of a number is uniform, too: with 32 bits it would have 256 values. |z| < 5: false alarm 1e-6.
TEST(Rng, FineNumbersHaveARestAfterAChoiceAmongMany) {
  constexpr int kBins = 1024, kSamples = 1 << 18;
  for (const bool points : {false, true}) {
    std::vector<int> counts(kBins);
    const Rng first({test_seed(1), 0, 0}, 0, 0);
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      Rng rng = points ? first.with_point(i, first.scramble_key(), i) : first.with_sample(i);
      Rng coarse = rng;
      const double u = rng.fine_uniform(), rest = u * 0x1p24 - std::floor(u * 0x1p24);
      ASSERT_NEAR(u, coarse.uniform(), 0x1p-33);
      ASSERT_EQ(rng.uniform(), coarse.uniform());
      ASSERT_GT(u, 0);
      ASSERT_LT(u, 1);
      ++counts[static_cast<int>(rest * kBins)];
    }
    EXPECT_LT(std::abs(chi_square_z(counts, double(kSamples) / kBins)), 5) << (points ? "points" : "random");
  }
}

TEST(Rng, HighBitsOfIndexAndSeedCount) {
  const double base = Rng({1, 0, 0}, 5, 0).uniform();
  EXPECT_NE(base, Rng({1, 0, 0}, 5 + (std::uint64_t{1} << 32), 0).uniform());
  EXPECT_NE(base, Rng({1 + (std::uint64_t{1} << 32), 0, 0}, 5, 0).uniform());
}

}  // namespace
}  // namespace isochron
