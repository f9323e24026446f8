// What building and querying an EllipsoidBvh share.
#pragma once
#include "core/base/bounds.h"
#include "core/base/large_array.h"
#include "core/geometry/ellipsoid_bvh.h"

namespace isochron {

struct EllipsoidBvh::Impl {
  static constexpr int kWidth = 8;
  static constexpr int kFlat = 16;            ///< up to so many triangles a scan beats a hierarchy
  static constexpr int kHeuristicDepth = 24;  ///< below it ranges are halved, which bounds the depth for any input
  static constexpr int kStack = 7 * (kHeuristicDepth + 32) + 2 * kWidth;  ///< a visit replaces one entry by up to eight

  /// Eight values side by side. Loops over the lanes have straight-line bodies that compilers vectorise.
  struct alignas(64) Wide {
    double lane[kWidth];
  };
  struct WideVec3 {
    Wide x, y, z;
    Vec3 get(int i) const { return {x.lane[i], y.lane[i], z.lane[i]}; }
    void set(int i, const Vec3& p) { x.lane[i] = p.x, y.lane[i] = p.y, z.lane[i] = p.z; }
  };
  /// Up to eight triangles; unused lanes hold NaN, which fails every comparison.
  struct Block {
    WideVec3 vertex[3];
    int id[kWidth];
  };
  /// Up to eight boxes; unused lanes hold NaN. A child is a node (>= 0) or a block (~index).
  struct Node {
    WideVec3 center, half;
    int child[kWidth];
  };

  LargeArray<Node> nodes;  ///< the root first; empty for a flat list of blocks
  LargeArray<Block> blocks;
  Bounds bounds;

  struct Item {
    Bounds box;
    Vec3 center;
    int index;
  };
  using Range = std::pair<Item*, Item*>;
  static Item* split(const Range& range);
  int make_block(const std::vector<Input>& triangles, const Range& range);
  int make_node(const std::vector<Input>& triangles, const Range& range, int depth);

  /// A node or block that an ellipsoid may meet, in a thinned query.
  struct Entry {
    int child;
    double weight;               ///< what the paths through it may carry, over the probability
    double inverse_probability;  ///< of having been kept so far
  };
  /// Whether it pays to look for triangles strictly between the two ellipsoids: nothing is between equal lengths, and of a
  /// coarse mesh's triangles few are.
  bool has_between(double tau_low, double tau_high) const { return tau_low < tau_high && blocks.size() > kWidth; }
  // With `kSurfaces` what lies strictly between the two ellipsoids is left out.
  template <bool kSurfaces>
  int visit(const Shell& shell, std::vector<int>& ids) const;
  template <bool kSurfaces>
  void visit_some(const Shell& shell, const Focus& a, const Focus& b, double u, std::vector<int>& ids,
                  std::vector<double>& inverse_probability) const;
  template <bool kSurfaces>
  void test_block(const Block& block, const Shell& shell, std::vector<int>& ids) const;
  template <bool kSurfaces>
  int test_node(const Node& node, const Shell& shell, int* lanes) const;
  void prefetch(int entry) const;
};

}  // namespace isochron
