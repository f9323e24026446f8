#include "core/render/scene_cache.h"

#include <algorithm>

namespace isochron {

std::shared_ptr<ReadyScene> SceneCache::take(const Scene& scene, const TangentBasis* basis,
                                             const FollowOptions& follow) {
  const PassTimes::Timed timed(&times_, PassKind::scene);
  std::unique_ptr<ReadyScene> ready;
  {
    const std::lock_guard lock(mutex_);
    // At most two prepared scenes: with and without derivatives.
    constexpr int kKinds = 2;
    auto found =
        std::find_if(idle_.begin(), idle_.end(), [&](const auto& each) { return each->scene.same_columns(basis); });
    if (found == idle_.end() && idle_.size() >= kKinds) found = idle_.begin();
    if (found != idle_.end()) {
      ready = std::move(*found);
      idle_.erase(found);
    }
  }
  // A hierarchy that is refitted depends on the scene that it was made for.
  if (!ready) ready.reset(new ReadyScene{PreparedScene(at_first_, basis, follow, update_), std::nullopt});
  ready->scene.update(scene, basis, follow);
  return {ready.release(), [this](ReadyScene* used) {
            const std::lock_guard lock(mutex_);
            idle_.emplace_back(used);
          }};
}

}  // namespace isochron
