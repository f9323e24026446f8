// Camera paths by standard sampling, one after another or two at a time.
#pragma once
#include <array>
#include <optional>

#include "core/techniques/standard_walk.h"

namespace isochron {

/// In a scene too large for the caches two paths are under way at a time and take turns: while one's next triangle comes
/// from main memory, the other continues.
class StandardPaths {
 public:
  explicit StandardPaths(Worker& worker);

  /// Starts a path through `pixel`; contributions are scaled by `scale`. It ends during later calls, of finish() at the
  /// latest.
  void start(int pixel, double scale, Rng& rng);
  void finish();

 private:
  /// Holds the path under way, if any.
  class Slot {
   public:
    explicit Slot(Worker& worker) : worker_(worker), path_(worker.options.max_bounces) {}
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;

    /// A path from its start to its end.
    void run(int pixel, double scale, Rng& rng);
    /// The same from a sensor point of a capture.
    void run_at_wall(int pixel, double scale, Rng& rng);
    bool active() const { return walk_.has_value(); }
    void start(int pixel, double scale, const Rng& rng);
    void advance();

   private:
    struct Visitor {
      Slot& slot;
      bool wants() const { return slot.worker_.contributes(slot.path_); }
      void take(const Rgb& value) const { slot.emit(value); }
    };
    using Walk = StandardWalk<Visitor>;

    Walk begin(int pixel, double scale, Rng& rng);
    void emit(const Rgb& value);

    Worker& worker_;
    Path path_;
    int pixel_ = -1;
    double scale_ = 0;
    Rng rng_{Stream{}, 0, 0};
    std::optional<Walk> walk_;
  };

  Worker& worker_;
  const bool large_;
  std::array<Slot, 2> slots_;
  int next_slot_ = 0;
};

}  // namespace isochron
