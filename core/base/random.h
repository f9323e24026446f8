// Counter-based random numbers (Philox 4x32-10, Salmon et al. 2011): a number depends only on its key and counter,
// so results do not depend on the order of execution, on threads or on a resume.
#pragma once
#include <array>
#include <cstdint>
#include <cstdlib>

#include "core/base/sobol.h"

namespace isochron {

/// What separates independent streams: (seed, iteration, pass). `pass` tells primal, target and derivative terms apart.
struct Stream {
  std::uint64_t seed = 1;
  std::uint32_t iteration = 0;
  std::uint32_t pass = 0;
};

/// Tells apart the numbers of test runs, which have to hold with any: ISOCHRON_TEST_SEED in the environment (tests/README.md).
/// 0 where it is not set.
inline const std::uint32_t kTestSeed = [] {
  const char* text = std::getenv("ISOCHRON_TEST_SEED");
  return text ? static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10)) : 0u;
}();

inline std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p0 = std::uint64_t{0xD2511F53u} * counter[0];
    const std::uint64_t p1 = std::uint64_t{0xCD9E8D57u} * counter[2];
    counter = {static_cast<std::uint32_t>(p1 >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(p1),
               static_cast<std::uint32_t>(p0 >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(p0)};
    key[0] += 0x9E3779B9u;
    key[1] += 0xBB67AE85u;
  }
  return counter;
}

/// The numbers of one sample: keyed by stream, `index` (pixel or block) and `sample`.
class Rng {
 public:
  Rng(const Stream& stream, std::uint64_t index, std::uint32_t sample) {
    // One extra Philox call folds (seed, iteration, pass) into the 64-bit key of the sample's numbers.
    const auto mixed =
        philox({stream.iteration, stream.pass, static_cast<std::uint32_t>(index >> 32), 0x6973u + kTestSeed},
               {static_cast<std::uint32_t>(stream.seed), static_cast<std::uint32_t>(stream.seed >> 32)});
    key_ = {mixed[0], mixed[1]};
    counter_ = {0, static_cast<std::uint32_t>(index), sample, mixed[2]};
  }
  /// The numbers of another sample of the same stream and index, without folding the key again.
  Rng with_sample(std::uint32_t sample) const { return Rng(key_, {0, counter_[1], sample, counter_[3]}); }

  /// The same stream and index with other numbers; `set` tells sets of samples apart.
  Rng in_set(std::uint32_t set) const { return Rng({key_[0] + set, key_[1]}, counter_); }

  /// What scrambles the points of this stream, index and set.
  std::uint64_t scramble_key() const {
    const auto bits = of_no_sample();
    return std::uint64_t{bits[0]} << 32 | bits[1];
  }
  /// Uniform in (0, 1), one for all samples of this stream, index and set.
  double shift() const { return (of_no_sample()[2] + 0.5) * 0x1p-32; }
  /// The numbers of another sample as above, the first of them, as many as a point has, from point `point` of the
  /// scrambled Sobol sequence of the key. Each sample by itself is as random as before; points 0, 1, ... n - 1 together
  /// cover their cube evenly, best where n is a power of two.
  Rng with_point(std::uint32_t sample, std::uint64_t scramble_key, std::uint32_t point) const {
    Rng rng = with_sample(sample);
    rng.scramble_key_ = scramble_key;
    rng.point_ = point;
    rng.point_blocks_ = kSobolBlocks;
    return rng;
  }

  /// Uniform in the open interval (0, 1), with 32 random bits.
  double uniform() {
    if (used_ == 4) {
      block_ =
          counter_[0] < point_blocks_ ? scrambled_sobol(scramble_key_, point_, counter_[0]) : philox(counter_, key_);
      ++counter_[0];
      used_ = 0;
    }
    return (block_[used_++] + 0.5) * 0x1p-32;
  }

  /// The same number with 20 more random bits behind it: for a choice among many, the rest of which is used again. The next
  /// number is that which follows uniform().
  double fine_uniform() {
    uniform();
    // What follows the leading bits need only be well mixed and another for each number.
    const auto mixed = [](std::uint64_t x) {
      x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
      x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
      return x ^ (x >> 31);
    };
    const auto pair = [](std::uint32_t high, std::uint32_t low) { return std::uint64_t{high} << 32 | low; };
    const std::uint32_t place = 4 * counter_[0] + static_cast<std::uint32_t>(used_);
    const std::uint64_t bits =
        mixed(mixed(mixed(pair(key_[0], key_[1])) + pair(counter_[1], counter_[2])) + pair(counter_[3], place));
    return (static_cast<double>(std::uint64_t{block_[used_ - 1]} << 20 | bits >> 44) + 0.5) * 0x1p-52;
  }

 private:
  Rng(const std::array<std::uint32_t, 2>& key, const std::array<std::uint32_t, 4>& counter)
      : key_(key), counter_(counter) {}
  /// No sample has the largest number: no other use of these counters.
  std::array<std::uint32_t, 4> of_no_sample() const {
    return philox({0, counter_[1], ~std::uint32_t{0}, counter_[3]}, key_);
  }

  std::array<std::uint32_t, 2> key_;
  std::array<std::uint32_t, 4> counter_;
  std::array<std::uint32_t, 4> block_{};
  int used_ = 4;
  std::uint64_t scramble_key_ = 0;
  std::uint32_t point_ = 0, point_blocks_ = 0;
};

}  // namespace isochron
