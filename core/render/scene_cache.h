// Prepared scenes, kept from one evaluation to the next, so that each pays only for what has changed.
#pragma once
#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/partition_sum.h"
#include "core/paths/prepared_scene.h"
#include "core/render/pass_times.h"
#include "core/techniques/boundary_edges.h"

namespace isochron {

/// A scene, and the edges of its visibility term where these were asked for.
struct ReadyScene {
  PreparedScene scene;
  std::optional<BoundaryEdges> edges;
};

/// Safe to share between threads.
class SceneCache {
 public:
  /// Of scenes that have the topology of `at_first`, which must outlive this. `update`: of the rays' hierarchy.
  SceneCache(const Scene& at_first, CasterUpdate update) : at_first_(at_first), update_(update) {}

  /// The prepared scene, exclusively for the caller as long as the pointer lives. The bits do not depend on earlier calls.
  std::shared_ptr<ReadyScene> take(const Scene& scene, const TangentBasis* basis, const FollowOptions& follow);
  const Scene& at_first() const { return at_first_; }

  /// Rays traced in its scenes so far.
  void count_rays(long long rays) { rays_ += rays; }
  long long rays() const { return rays_; }
  /// What passes over its scenes took so far.
  PassTimes& times() { return times_; }
  /// What the partitions of a pass took when it was last run with so many. For ranks, whose passes come one by one.
  PartitionCosts& partition_costs(PassKind kind, int partitions) { return partition_costs_[{kind, partitions}]; }

 private:
  const Scene& at_first_;
  const CasterUpdate update_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<ReadyScene>> idle_;
  std::atomic<long long> rays_{0};
  PassTimes times_;
  std::map<std::pair<PassKind, int>, PartitionCosts> partition_costs_;
};

}  // namespace isochron
