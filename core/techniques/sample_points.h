// The samples of a pass and their random numbers. Each technique has points of its own, which cover evenly what it draws
// from: techniques that start in a pixel have a set of points per pixel, those that may land anywhere have one set for the
// whole image, which every pixel's samples are a part of.
#pragma once
#include <algorithm>
#include <cmath>

#include "core/base/progress.h"
#include "core/base/random.h"
#include "core/paths/options.h"
#include "core/paths/technique.h"

namespace isochron {

/// One of `count` parts of the samples of each pixel.
struct SamplePart {
  int index = 0, count = 1;
};

/// One set of points, to be visited in parts.
class PointSet {
 public:
  /// `place`: a pixel, or GatePick::kImage.
  PointSet(const Stream& stream, Technique technique, int place, SampleRange range, Numbers numbers)
      : stream_(stream),
        index_(static_cast<std::uint64_t>(technique) << 32 | static_cast<std::uint32_t>(place)),
        set_(static_cast<std::uint32_t>(range.begin)),
        together_(numbers == Numbers::low_discrepancy) {}

  /// sample(rng) for those of `part` of the `count_of_turn` points of a turn. Fractional bounds between turns are rounded by one random
  /// offset common to all calls, so that a turn has so many on average.
  template <class F>
  void visit(double count_of_turn, int turn, SamplePart part, F&& sample) const {
    const double from = count_of_turn * turn, to = count_of_turn * (turn + 1);
    const bool whole = from == std::floor(from) && to == std::floor(to);
    const double shift = whole ? 0 : of_run(0).shift();
    const auto begin = static_cast<std::int64_t>(from + shift), count = static_cast<std::int64_t>(to + shift) - begin;
    const std::int64_t end = begin + count * (part.index + 1) / part.count;
    for (std::int64_t i = begin + count * part.index / part.count; i < end;) {
      const std::int64_t run = i / kRun;
      const Rng rng_of_run = of_run(run);
      const std::uint64_t key = together_ ? rng_of_run.scramble_key() : 0;
      for (const std::int64_t run_end = std::min(end, (run + 1) * kRun); i < run_end; ++i) {
        throw_if_stopped();
        const auto number = static_cast<std::uint32_t>(i - run * kRun);
        Rng rng = together_ ? rng_of_run.with_point(number, key, number) : rng_of_run.with_sample(number);
        sample(rng);
      }
    }
  }

 private:
  /// Samples have numbers of 32 bits, the largest of which is none's (see Rng). So a set has other random numbers, and points
  /// with another scramble, after each run of so many.
  static constexpr std::int64_t kRun = std::int64_t{1} << 31;
  /// Bits of `index_`: those of the place, then of the technique, then of the run.
  static constexpr int kRunBits = 40;

  Rng of_run(std::int64_t run) const {
    return Rng(stream_, static_cast<std::uint64_t>(run) << kRunBits | index_, 0).in_set(set_);
  }

  Stream stream_;
  std::uint64_t index_;
  std::uint32_t set_;
  bool together_;
};

}  // namespace isochron
