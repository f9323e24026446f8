#include "core/scene/coincidence.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace isochron {

std::vector<Coincidence> find_coincidences(const Scene& scene) {
  struct Key {
    std::array<std::array<double, 3>, 3> corners;  // ascending
    int triangle;
  };
  std::vector<Key> keys(scene.triangles.size());
  for (std::size_t t = 0; t < keys.size(); ++t) {
    Key& key = keys[t];
    key.triangle = static_cast<int>(t);
    for (int i = 0; i < 3; ++i) {
      const Vec3& p = scene.positions[scene.triangles[t].vertex[i]];
      key.corners[i] = {p.x, p.y, p.z};
    }
    std::sort(key.corners.begin(), key.corners.end());
  }
  // Triangles of one place in their order in the scene, hence by shape.
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return a.corners < b.corners || (a.corners == b.corners && a.triangle < b.triangle);
  });
  std::map<std::array<int, 2>, int> counts;
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i].corners != keys[i - 1].corners) continue;
    ++counts[{scene.triangles[keys[i - 1].triangle].shape, scene.triangles[keys[i].triangle].shape}];
  }
  std::vector<Coincidence> all;
  for (const auto& [shape, triangles] : counts) all.push_back({shape, triangles});
  return all;
}

std::string coincidence_warning(const Scene& scene) {
  constexpr std::size_t kMostNamed = 4;
  const std::vector<Coincidence> all = find_coincidences(scene);
  if (all.empty()) return {};
  std::string names;
  for (std::size_t i = 0; i < std::min(all.size(), kMostNamed); ++i)
    names += fmt::format("{}'{}' and '{}' ({} triangle{})", i ? ", " : "", scene.shapes[all[i].shape[0]].name,
                         scene.shapes[all[i].shape[1]].name, all[i].triangles, all[i].triangles > 1 ? "s" : "");
  if (all.size() > kMostNamed) names += fmt::format(" and {} more pairs", all.size() - kMostNamed);
  return fmt::format(
      "shapes on the same surface: {}; light would be reflected by either or by both, so images are wrong "
      "there: leave one out, or move them apart",
      names);
}

}  // namespace isochron
