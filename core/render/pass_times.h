// What the passes of renderers take.
#pragma once
#include <array>
#include <atomic>
#include <chrono>

#include "core/paths/options.h"

namespace isochron {

/// What renderers do, in this order: preparing the scene, images, and the terms of the derivative, of
/// which the visibility term needs the edges to be found and learned about.
enum class PassKind { scene, primal, interior, edges, visibility, path_length };
inline constexpr std::array kPassKinds = {PassKind::scene, PassKind::primal,     PassKind::interior,
                                          PassKind::edges, PassKind::visibility, PassKind::path_length};

inline const char* name(PassKind kind) {
  constexpr std::array kNames = {"scene", "primal", "interior", "edges", "visibility", "path_length"};
  return kNames[static_cast<std::size_t>(kind)];
}

inline PassKind pass_kind(Term term) {
  return term == Term::interior     ? PassKind::interior
         : term == Term::visibility ? PassKind::visibility
                                    : PassKind::path_length;
}

/// Wall time by kind of pass. Safe to share between threads.
class PassTimes {
 public:
  double seconds(PassKind kind) const { return 1e-9 * static_cast<double>(of(kind).load()); }

  /// Adds the time from its construction to its destruction to a kind; without `times` to nothing.
  class Timed {
   public:
    Timed(PassTimes* times, PassKind kind) : times_(times), kind_(kind) {}
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;
    ~Timed() {
      using std::chrono::nanoseconds;
      if (times_) times_->of(kind_) += std::chrono::duration_cast<nanoseconds>(Clock::now() - start_).count();
    }

   private:
    using Clock = std::chrono::steady_clock;
    PassTimes* const times_;
    const PassKind kind_;
    const Clock::time_point start_ = Clock::now();
  };

 private:
  using Count = std::atomic<long long>;
  const Count& of(PassKind kind) const { return nanoseconds_[static_cast<std::size_t>(kind)]; }
  Count& of(PassKind kind) { return nanoseconds_[static_cast<std::size_t>(kind)]; }

  std::array<Count, kPassKinds.size()> nanoseconds_{};
};

}  // namespace isochron
