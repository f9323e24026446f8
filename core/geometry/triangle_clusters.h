// A hierarchy of boxes over the triangles of each shape, which is made once and fitted again when vertices have moved.
#pragma once
#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "core/base/large_array.h"
#include "core/scene/scene.h"

namespace isochron {

/// In single precision; the fourth lanes are unused.
struct FloatBox {
  using Floats [[gnu::vector_size(16)]] = float;
  using Ints [[gnu::vector_size(16)]] = int;
  using Longs [[gnu::vector_size(16)]] = long long;
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Floats low = {kInfinity, kInfinity, kInfinity, 0}, high = {-kInfinity, -kInfinity, -kInfinity, 0};

  void add(const FloatBox& b) {
    low = low < b.low ? low : b.low;
    high = high > b.high ? high : b.high;
  }
  void add(const Vec3& p) {
    const Floats point = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 0};
    add(FloatBox{point, point});
  }
  FloatBox grown(float margin) const { return {low - margin, high + margin}; }
  bool overlaps(const FloatBox& b) const {
    const Ints lanes = (low <= b.high) & (b.low <= high);
    const auto pairs = reinterpret_cast<Longs>(lanes);
    return (pairs[0] & pairs[1]) == -1;
  }
  float size() const {
    const Floats d = high - low;
    return std::max({d[0], d[1], d[2]});
  }
};

/// Eight boxes side by side. The bits of results are theirs.
struct EightBoxes {
  static constexpr int kWidth = 8;
  using Floats [[gnu::vector_size(4 * kWidth)]] = float;
  using Ints [[gnu::vector_size(4 * kWidth)]] = int;
  using Longs [[gnu::vector_size(4 * kWidth)]] = long long;
  Floats low[3], high[3];

  void set(int lane, const FloatBox& box) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis][lane] = box.low[axis];
      high[axis][lane] = box.high[axis];
    }
  }
  /// Sets the lanes of boxes that overlap the given one to -1, others to 0. An out-parameter, as returning 32-byte vectors by
  /// value has no stable ABI without AVX.
  void find_overlapping(const FloatBox& box, Ints& lanes) const {
    lanes = (low[0] <= box.high[0]) & (high[0] >= box.low[0]);
    for (int axis = 1; axis < 3; ++axis) lanes &= (low[axis] <= box.high[axis]) & (high[axis] >= box.low[axis]);
  }
  /// A bit for each box that overlaps the given one.
  unsigned overlapping(const FloatBox& box) const {
    Ints lanes;
    find_overlapping(box, lanes);
    return bits(lanes);
  }
  static unsigned bits(const Ints& lanes) {
    const auto pairs = reinterpret_cast<Longs>(lanes & Ints{1, 2, 4, 8, 16, 32, 64, 128});
    const long long all = (pairs[0] | pairs[1]) | (pairs[2] | pairs[3]);
    return static_cast<unsigned>(all | all >> 32) & 0xffu;
  }
};

/// Triangles of one shape that lie close together in the initial scene, with their boxes; unused lanes have empty ones.
struct TriangleCluster : EightBoxes {
  Ints vertex[3];
  std::array<int, kWidth> triangle;
  int used = 0;

  bool may_meet(const FloatBox& box) const { return overlapping(box) != 0; }
  /// Those whose boxes overlap the given one and that share no vertex with the edge.
  unsigned may_cross(const FloatBox& box, const std::array<int, 2>& edge) const {
    Ints lanes;
    find_overlapping(box, lanes);
    for (const Ints& v : vertex) lanes &= (v != edge[0]) & (v != edge[1]);
    return bits(lanes);
  }
};

class TriangleClusters {
 public:
  /// Clusters are chosen by where triangles are in this scene; `fit` makes the boxes.
  explicit TriangleClusters(const Scene& at_first);
  /// Rebuilds a shape's boxes: those of its triangles, rounded to the nearest floats.
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
