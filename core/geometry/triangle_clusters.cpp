#include "core/geometry/triangle_clusters.h"

#include "core/base/bounds.h"
#include "core/base/parallel.h"

namespace isochron {

TriangleClusters::TriangleClusters(const Scene& at_first) {
  std::vector<Item> items;
  for (const Shape& shape : at_first.shapes) {
    first_.push_back(count());
    items.clear();
    for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
      Bounds box;
      for (const int v : at_first.triangles[t].vertex) box.add(at_first.positions[v]);
      items.push_back({box.center(), t});
    }
    if (!items.empty()) divide(items.data(), items.data() + items.size());
  }
  first_.push_back(count());
  boxes_.resize(clusters_.size());
  nodes_.resize(clusters_.size());
  for (TriangleCluster& cluster : clusters_)
    for (int lane = 0; lane < TriangleCluster::kWidth; ++lane)
      for (int k = 0; k < 3; ++k)
        cluster.vertex[k][lane] = lane < cluster.used ? at_first.triangles[cluster.triangle[lane]].vertex[k] : -1;
}

/// Halves the triangles along the axis that their centres are spread along the most, as `children` does.
void TriangleClusters::divide(Item* begin, Item* end) {
  const auto items = static_cast<int>(end - begin);
  if (items <= TriangleCluster::kWidth) {
    TriangleCluster& cluster = clusters_.emplace_back();
    for (const Item* i = begin; i != end; ++i) cluster.triangle[cluster.used++] = i->triangle;
    return;
  }
  Bounds centers;
  for (const Item* i = begin; i != end; ++i) centers.add(i->center);
  const Vec3 size = centers.high - centers.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const int clusters = (items + TriangleCluster::kWidth - 1) / TriangleCluster::kWidth;
  Item* middle = begin + static_cast<std::ptrdiff_t>(TriangleCluster::kWidth) * ((clusters + 1) / 2);
  std::nth_element(begin, middle, end,
                   [axis](const Item& a, const Item& b) { return a.center[axis] < b.center[axis]; });
  divide(begin, middle);
  divide(middle, end);
}

void TriangleClusters::fit(const Scene& scene, int shape) {
  const int first = first_[shape], count = first_[shape + 1] - first;
  parallel_ranges(count, 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) fit_cluster(scene, first + static_cast<int>(i));
  });
  if (count > 0) fit_node(root(shape));
}

void TriangleClusters::fit_cluster(const Scene& scene, int i) {
  TriangleCluster& cluster = clusters_[i];
  FloatBox& all = boxes_[i] = {};
  for (int lane = 0; lane < TriangleCluster::kWidth; ++lane) {
    FloatBox box;
    for (int k = 0; lane < cluster.used && k < 3; ++k) box.add(scene.positions[cluster.vertex[k][lane]]);
    cluster.set(lane, box);
    all.add(box);
  }
}

FloatBox TriangleClusters::fit_node(const Node& node) {
  if (node.is_cluster()) return boxes_[node.first];
  const auto parts = children(node);
  FloatBox box = fit_node(parts[0]);
  box.add(fit_node(parts[1]));
  return nodes_[node.index] = box;
}

}  // namespace isochron
