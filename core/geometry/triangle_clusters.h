// A hierarchy of boxes over the triangles of each shape, which is made once and fitted again when vertices have moved.
#pragma once
#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "core/base/large_array.h"
#include "core/scene/scene.h"

namespace isochron {

/// In single precision, so that eight of them are tested at once.
struct FloatBox {
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  float low[3] = {kInfinity, kInfinity, kInfinity}, high[3] = {-kInfinity, -kInfinity, -kInfinity};

  void add(const FloatBox& b) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], b.low[axis]);
      high[axis] = std::max(high[axis], b.high[axis]);
    }
  }
  void add(const Vec3& p) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], static_cast<float>(p[axis]));
      high[axis] = std::max(high[axis], static_cast<float>(p[axis]));
    }
  }
  FloatBox grown(float margin) const {
    FloatBox b = *this;
    for (int axis = 0; axis < 3; ++axis) b.low[axis] -= margin, b.high[axis] += margin;
    return b;
  }
  bool overlaps(const FloatBox& b) const {
    bool all = true;
    for (int axis = 0; axis < 3; ++axis) all &= (low[axis] <= b.high[axis]) & (b.low[axis] <= high[axis]);
    return all;
  }
  float size() const { return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}); }
};

/// Triangles of one shape that lay close together at first, side by side, with their boxes; unused lanes have empty ones.
struct TriangleCluster {
  static constexpr int kWidth = 8;
  using Floats [[gnu::vector_size(4 * kWidth)]] = float;
  using Ints [[gnu::vector_size(4 * kWidth)]] = int;

  Floats low[3], high[3];
  Ints vertex[3];
  std::array<int, kWidth> triangle;
  int used = 0;

  /// Of each lane: -1 if the triangle's box overlaps the given one, else 0.
  Ints overlapping(const FloatBox& box) const {
    Ints lanes = (low[0] <= box.high[0]) & (high[0] >= box.low[0]);
    for (int axis = 1; axis < 3; ++axis) lanes &= (low[axis] <= box.high[axis]) & (high[axis] >= box.low[axis]);
    return lanes;
  }
  bool may_meet(const FloatBox& box) const {
    const Ints lanes = overlapping(box);
    int any = 0;
    for (int lane = 0; lane < kWidth; ++lane) any |= lanes[lane];
    return any != 0;
  }
  /// The same for triangles that share no vertex with the edge.
  Ints may_cross(const FloatBox& box, const std::array<int, 2>& edge) const {
    Ints lanes = overlapping(box);
    for (const Ints& v : vertex) lanes &= (v != edge[0]) & (v != edge[1]);
    return lanes;
  }
};

class TriangleClusters {
 public:
  /// Clusters are chosen by where triangles are in this scene; `fit` makes the boxes.
  explicit TriangleClusters(const Scene& at_first);
  /// Makes a shape's boxes anew: those of its triangles, rounded to the nearest floats.
  void fit(const Scene& scene, int shape);

  int count() const { return static_cast<int>(clusters_.size()); }
  const TriangleCluster& cluster(int i) const { return clusters_[i]; }
  /// The shape's clusters begin here; they end where those of the next shape begin.
  int first(int shape) const { return first_[shape]; }
  const FloatBox& box_of_cluster(int i) const { return boxes_[i]; }

  /// Part of a shape's hierarchy: so many clusters from `first` on.
  struct Node {
    int index;  ///< into nodes_, unless it is one cluster
    int first, clusters;
    bool is_cluster() const { return clusters == 1; }
  };
  /// Of a shape that has triangles.
  Node root(int shape) const { return {first_[shape], first_[shape], first_[shape + 1] - first_[shape]}; }
  static std::array<Node, 2> children(const Node& node) {
    const int left = (node.clusters + 1) / 2;
    return {{{node.index + 1, node.first, left}, {node.index + left, node.first + left, node.clusters - left}}};
  }
  const FloatBox& box(const Node& node) const { return node.is_cluster() ? boxes_[node.first] : nodes_[node.index]; }

 private:
  struct Item {
    Vec3 center;
    int triangle;
  };
  void divide(Item* begin, Item* end);
  void fit_cluster(const Scene& scene, int i);
  FloatBox fit_node(const Node& node);

  LargeArray<TriangleCluster> clusters_;
  std::vector<int> first_;       ///< cluster of each shape, and the end
  std::vector<FloatBox> boxes_;  ///< of each cluster
  std::vector<FloatBox>
      nodes_;  ///< of each shape in turn: the root, the nodes of its left part, those of its right part
};

}  // namespace isochron
