// The distance to the nearest of many boxes.
#pragma once
#include <algorithm>
#include <limits>
#include <vector>

#include "core/base/bounds.h"

namespace isochron {

class NearestBox {
 public:
  NearestBox() = default;
  explicit NearestBox(std::vector<Bounds> boxes) : boxes_(std::move(boxes)) {
    if (!boxes_.empty()) build(0, boxes_.size());
  }

  /// Infinite where there is none.
  double distance_squared(const Vec3& p) const {
    double nearest = std::numeric_limits<double>::infinity();
    if (!nodes_.empty()) visit(0, p, nearest);
    return nearest;
  }

 private:
  static constexpr std::size_t kLeaf = 4;

  struct Node {
    Bounds bounds;
    std::size_t begin, end;  ///< in boxes_
    std::size_t right = 0;   ///< the second child, the first being the next node; 0: a leaf
  };

  void build(std::size_t begin, std::size_t end) {
    const std::size_t index = nodes_.size();
    nodes_.push_back({{}, begin, end});
    for (std::size_t i = begin; i < end; ++i) nodes_[index].bounds.add(boxes_[i]);
    if (end - begin <= kLeaf) return;
    const Vec3 size = nodes_[index].bounds.high - nodes_[index].bounds.low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = (begin + end) / 2;
    const auto at = [&](std::size_t i) { return boxes_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end),
                     [axis](const Bounds& a, const Bounds& b) { return a.center()[axis] < b.center()[axis]; });
    build(begin, middle);
    nodes_[index].right = nodes_.size();
    build(middle, end);
  }

  void visit(std::size_t index, const Vec3& p, double& nearest) const {
    const Node& node = nodes_[index];
    if (node.right == 0) {
      for (std::size_t i = node.begin; i < node.end; ++i) nearest = std::min(nearest, boxes_[i].distance_squared(p));
      return;
    }
    const double left = nodes_[index + 1].bounds.distance_squared(p),
                 right = nodes_[node.right].bounds.distance_squared(p);
    const std::size_t first = left <= right ? index + 1 : node.right, second = left <= right ? node.right : index + 1;
    if (std::min(left, right) < nearest) visit(first, p, nearest);
    if (std::max(left, right) < nearest) visit(second, p, nearest);
  }

  std::vector<Bounds> boxes_;
  std::vector<Node> nodes_;
};

}  // namespace isochron
