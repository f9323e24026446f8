#include "core/geometry/ellipsoid_bvh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/geometry/ellipsoid.h"

namespace isochron {
namespace {

constexpr int kWidth = 8;
constexpr int kFlat = 16;  ///< up to so many triangles a scan beats a hierarchy
constexpr int kHeuristicDepth = 24;  ///< below it ranges are halved, which bounds the depth for any input
constexpr int kStack = 7 * (kHeuristicDepth + 32) + 2 * kWidth;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// GCC's and clang's vector types: one instruction with AVX-512, two with AVX, four with SSE2.
using Wide = double __attribute__((vector_size(kWidth * sizeof(double))));

struct WideVec3 {
  Wide x, y, z;
};

inline void set_lane(WideVec3& v, int lane, const Vec3& p) { v.x[lane] = p.x, v.y[lane] = p.y, v.z[lane] = p.z; }

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

struct Box {
  Vec3 lower{kInfinity, kInfinity, kInfinity}, upper{-kInfinity, -kInfinity, -kInfinity};
  void add(const Vec3& p) {
    for (int k = 0; k < 3; ++k) lower[k] = std::min(lower[k], p[k]), upper[k] = std::max(upper[k], p[k]);
  }
  void add(const Box& b) { add(b.lower), add(b.upper); }
  Vec3 center() const { return lower * 0.5 + upper * 0.5; }
  double half_area() const {
    const Vec3 d = upper - lower;
    return d.x * d.y + d.y * d.z + d.z * d.x;
  }
};

/// Q(p) = |r|^2 / minor^2 - k (r.u)^2 with r = p - centre: Q <= 1 inside the ellipsoid. Both coefficients are
/// zero when the ellipsoid is not valid: without an inner one nothing is excluded, and an infinite outer one holds all.
struct QuadraticForm {
  double inverse_minor2 = 0, k = 0;
  explicit QuadraticForm(const Ellipsoid& e) {
    if (!e.valid()) return;
    inverse_minor2 = 1 / (e.minor * e.minor);
    k = inverse_minor2 - 1 / (e.major * e.major);
  }
};

struct Shell {
  Vec3 center, axis;
  QuadraticForm high, low;
  double inside;    ///< Q_high of points that may be inside the outer ellipsoid is at most this
  double outside;   ///< Q_low of points that may be outside the inner ellipsoid is at least this
  Ellipsoid outer;  ///< the outer ellipsoid, grown by the round-off of positions
};

}  // namespace

struct EllipsoidBvh::Impl {
  std::vector<Node> nodes;  ///< the root first; empty for a flat list of blocks
  std::vector<Block> blocks;
  Box bounds;

  struct Item {
    Box box;
    Vec3 center;
    int index;
  };
  using Range = std::pair<Item*, Item*>;

  static Box range_box(const Range& range) {
    Box box;
    for (const Item* i = range.first; i != range.second; ++i) box.add(i->box);
    return box;
  }
  static std::size_t blocks_of(std::ptrdiff_t count) { return static_cast<std::size_t>((count + 7) / kWidth); }

  static Item* split(const Range& range);
  int make_block(const std::vector<Input>& triangles, const Range& range);
  int make_node(const std::vector<Input>& triangles, const Range& range, int depth);

  void test_block(const Block& block, const Shell& shell, std::vector<int>& ids) const;
  int test_node(const Node& node, const Shell& shell, int* hits) const;
};

/// Binned surface-area heuristic, counting whole blocks as the cost of a side: leaves come out full.
EllipsoidBvh::Impl::Item* EllipsoidBvh::Impl::split(const Range& range) {
  constexpr int kBins = 32;
  Box centers;
  for (const Item* i = range.first; i != range.second; ++i) centers.add(i->center);
  double best = kInfinity, best_scale = 0;
  int best_axis = -1, best_bin = 0;
  const auto bin_of = [&](const Item& item, int axis, double scale) {
    return std::min(kBins - 1, static_cast<int>((item.center[axis] - centers.lower[axis]) * scale));
  };
  for (int axis = 0; axis < 3; ++axis) {
    const double scale = kBins / (centers.upper[axis] - centers.lower[axis]);
    if (!(scale < kInfinity)) continue;
    std::array<Box, kBins> boxes;
    std::array<int, kBins> counts{};
    for (const Item* i = range.first; i != range.second; ++i) {
      const auto bin = static_cast<std::size_t>(bin_of(*i, axis, scale));
      boxes[bin].add(i->box), ++counts[bin];
    }
    std::array<double, kBins> right_cost{};
    Box side;
    int count = 0;
    for (std::size_t bin = kBins - 1; bin > 0; --bin) {
      if (counts[bin]) side.add(boxes[bin]), count += counts[bin];
      right_cost[bin] = count ? side.half_area() * static_cast<double>(blocks_of(count)) : kInfinity;
    }
    side = Box{}, count = 0;
    for (std::size_t bin = 1; bin < kBins; ++bin) {
      if (counts[bin - 1]) side.add(boxes[bin - 1]), count += counts[bin - 1];
      if (!count) continue;
      const double cost = side.half_area() * static_cast<double>(blocks_of(count)) + right_cost[bin];
      if (cost < best) best = cost, best_axis = axis, best_bin = static_cast<int>(bin), best_scale = scale;
    }
  }
  if (best_axis < 0) return range.first + (range.second - range.first) / 2;  // all centres coincide
  return std::stable_partition(range.first, range.second, [&](const Item& item) {
    return bin_of(item, best_axis, best_scale) < best_bin;
  });
}

int EllipsoidBvh::Impl::make_block(const std::vector<Input>& triangles, const Range& range) {
  Block block;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int lane = 0; lane < kWidth; ++lane) {
    const bool used = lane < range.second - range.first;
    const Input* input = used ? &triangles[static_cast<std::size_t>(range.first[lane].index)] : nullptr;
    for (std::size_t v = 0; v < 3; ++v) set_lane(block.vertex[v], lane, used ? input->vertex[v] : Vec3{nan, nan, nan});
    block.id[lane] = used ? input->id : -1;
  }
  blocks.push_back(block);
  return ~static_cast<int>(blocks.size() - 1);
}

int EllipsoidBvh::Impl::make_node(const std::vector<Input>& triangles, const Range& range, int depth) {
  std::vector<Range> children{range};
  while (children.size() < kWidth) {
    // Open the child with the largest box that is more than one block.
    std::size_t widest = children.size();
    double area = -1;
    for (std::size_t i = 0; i < children.size(); ++i) {
      if (children[i].second - children[i].first <= kWidth) continue;
      if (const double a = range_box(children[i]).half_area(); a > area) area = a, widest = i;
    }
    if (widest == children.size()) break;
    const Range whole = children[widest];
    Item* middle = depth < kHeuristicDepth ? split(whole) : whole.first + (whole.second - whole.first) / 2;
    children[widest] = {whole.first, middle};
    children.insert(children.begin() + static_cast<std::ptrdiff_t>(widest) + 1, Range{middle, whole.second});
  }
  const std::size_t self = nodes.size();
  nodes.emplace_back();
  Node node;
  for (int lane = 0; lane < kWidth; ++lane) {
    const auto i = static_cast<std::size_t>(lane);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Vec3 center{nan, nan, nan}, half = center;
    node.child[lane] = 0;
    if (i < children.size()) {
      const Box box = range_box(children[i]);
      center = box.center();
      half = box.upper - center;
      // Round-off in the centre is covered by the query's slack; the box must only not shrink by itself.
      for (int k = 0; k < 3; ++k) half[k] = std::max(half[k], center[k] - box.lower[k]);
      const bool leaf = children[i].second - children[i].first <= kWidth;
      node.child[lane] =
          leaf ? make_block(triangles, children[i]) : make_node(triangles, children[i], depth + 1);
    }
    set_lane(node.center, lane, center);
    set_lane(node.half, lane, half);
  }
  nodes[self] = node;
  return static_cast<int>(self);
}

void EllipsoidBvh::Impl::test_block(const Block& block, const Shell& shell, std::vector<int>& ids) const {
  WideVec3 r[3];
  Wide axial[3], squared[3], q[3];
  Wide highest_low, lowest_high;
  for (int v = 0; v < 3; ++v) {
    r[v] = {block.vertex[v].x - shell.center.x, block.vertex[v].y - shell.center.y,
            block.vertex[v].z - shell.center.z};
    axial[v] = r[v].x * shell.axis.x + r[v].y * shell.axis.y + r[v].z * shell.axis.z;
    squared[v] = r[v].x * r[v].x + r[v].y * r[v].y + r[v].z * r[v].z;
    q[v] = squared[v] * shell.high.inverse_minor2 - axial[v] * axial[v] * shell.high.k;
    const Wide low = squared[v] * shell.low.inverse_minor2 - axial[v] * axial[v] * shell.low.k;
    highest_low = v == 0 ? low : (low > highest_low ? low : highest_low);
    lowest_high = v == 0 ? q[v] : (q[v] < lowest_high ? q[v] : lowest_high);
  }
  // Q lies above its tangent plane at each vertex, 2 B(v, p) - Q(v) with B the bilinear form of Q, and a plane over a
  // triangle is lowest at a vertex: a lower bound over the triangle that is exact to second order in its size.
  const auto bilinear = [&](int i, int j) {
    const Wide product = r[i].x * r[j].x + r[i].y * r[j].y + r[i].z * r[j].z;
    return 2 * (product * shell.high.inverse_minor2 - axial[i] * axial[j] * shell.high.k);
  };
  const Wide b01 = bilinear(0, 1), b12 = bilinear(1, 2), b20 = bilinear(2, 0);
  const Wide t0 = (b01 < b20 ? b01 : b20) - q[0];
  const Wide t1 = (b01 < b12 ? b01 : b12) - q[1];
  const Wide t2 = (b12 < b20 ? b12 : b20) - q[2];
  Wide bound = t0 > t1 ? t0 : t1;
  bound = bound > t2 ? bound : t2;
  bound = bound < lowest_high ? bound : lowest_high;
  const auto touches = (bound <= shell.inside) & (highest_low >= shell.outside);
  for (int lane = 0; lane < kWidth; ++lane) {
    if (!touches[lane]) continue;
    if (lowest_high[lane] > shell.inside) {
      // No vertex inside the outer ellipsoid: they cross only if the triangle's plane or edges reach into it.
      const auto vertex = [&](int v) {
        return Vec3{block.vertex[v].x[lane], block.vertex[v].y[lane], block.vertex[v].z[lane]};
      };
      EllipseArcs arcs;
      if (!clip_ellipse(shell.outer, vertex(0), vertex(1), vertex(2), arcs)) continue;
    }
    ids.push_back(block.id[lane]);
  }
}

int EllipsoidBvh::Impl::test_node(const Node& node, const Shell& shell, int* hits) const {
  const WideVec3 r{node.center.x - shell.center.x, node.center.y - shell.center.y,
                   node.center.z - shell.center.z};
  const Wide axial = r.x * shell.axis.x + r.y * shell.axis.y + r.z * shell.axis.z;
  const Wide squared = r.x * r.x + r.y * r.y + r.z * r.z;
  const Wide half_squared = node.half.x * node.half.x + node.half.y * node.half.y + node.half.z * node.half.z;
  // Q over the box differs from Q at its centre by at most sum |dQ_i| h_i, and on the upper side also |h|^2 / minor^2.
  const auto slope = [&](const QuadraticForm& form) {
    const Wide along = axial * form.k;
    const Wide x = r.x * form.inverse_minor2 - along * shell.axis.x;
    const Wide y = r.y * form.inverse_minor2 - along * shell.axis.y;
    const Wide z = r.z * form.inverse_minor2 - along * shell.axis.z;
    return 2 * ((x < 0 ? -x : x) * node.half.x + (y < 0 ? -y : y) * node.half.y + (z < 0 ? -z : z) * node.half.z);
  };
  const Wide lowest = squared * shell.high.inverse_minor2 - axial * axial * shell.high.k - slope(shell.high);
  const Wide highest = (squared + half_squared) * shell.low.inverse_minor2 - axial * axial * shell.low.k +
                       slope(shell.low);
  const auto touches = (lowest <= shell.inside) & (highest >= shell.outside);
  int count = 0;
  for (int lane = 0; lane < kWidth; ++lane) {
    hits[count] = node.child[lane];
    count += static_cast<int>(touches[lane] & 1);
  }
  return count;
}

EllipsoidBvh::EllipsoidBvh() = default;
EllipsoidBvh::EllipsoidBvh(EllipsoidBvh&&) noexcept = default;
EllipsoidBvh& EllipsoidBvh::operator=(EllipsoidBvh&&) noexcept = default;
EllipsoidBvh::~EllipsoidBvh() = default;

EllipsoidBvh::EllipsoidBvh(const std::vector<Input>& triangles) {
  const auto finite = [](const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); };
  std::vector<Impl::Item> items;
  items.reserve(triangles.size());
  Box bounds;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& vertex = triangles[i].vertex;
    if (!std::all_of(vertex.begin(), vertex.end(), finite)) continue;  // crosses nothing
    Impl::Item item{{}, {}, static_cast<int>(i)};
    for (const Vec3& v : vertex) item.box.add(v);
    item.center = item.box.center();
    bounds.add(item.box);
    items.push_back(item);
  }
  if (items.empty()) return;
  impl_ = std::make_unique<Impl>();
  impl_->bounds = bounds;
  if (items.size() > kFlat) {
    impl_->make_node(triangles, {items.data(), items.data() + items.size()}, 0);
    return;
  }
  for (std::size_t i = 0; i < items.size(); i += kWidth)
    impl_->make_block(triangles, {&items[i], items.data() + std::min(items.size(), i + kWidth)});
}

bool EllipsoidBvh::empty() const { return !impl_; }

void EllipsoidBvh::query(const Vec3& a, const Vec3& b, double tau_low, double tau_high,
                         std::vector<int>& ids) const {
  const Ellipsoid outer(a, b, tau_high);
  const Ellipsoid inner(a, b, tau_low);
  if (!impl_ || !(outer.valid() || tau_high == kInfinity)) return;
  const Vec3& axis = outer.valid() ? outer.axis : inner.axis;
  Shell shell{outer.center, axis, QuadraticForm(outer), QuadraticForm(inner), 0, 0, outer};

  // Positions relative to the centre carry the round-off of all coordinates involved, here counted generously as a
  // change of tau; |dQ/dtau| <= major / minor^2 on the surface turns it into a change of Q, and the evaluation of Q
  // cancels terms of size reach^2 / minor^2.
  const Vec3 middle = impl_->bounds.center();
  const double radius = length(impl_->bounds.upper - middle);
  const double reach = length(middle - outer.center) + radius + outer.major;
  const double magnitude = reach + length(middle) + radius + length(a) + length(b);
  const double round_off = 64 * std::numeric_limits<double>::epsilon();
  const auto slack = [&](const QuadraticForm& form) { return 4 * round_off * reach * magnitude * form.inverse_minor2; };
  shell.inside = 1 + slack(shell.high);
  shell.outside = inner.valid() ? 1 - slack(shell.low) : -kInfinity;
  shell.outer = Ellipsoid(a, b, tau_high + round_off * magnitude);

  if (impl_->nodes.empty()) {
    for (const Block& block : impl_->blocks) impl_->test_block(block, shell, ids);
    return;
  }
  int stack[kStack];  // a visit replaces one entry by up to eight
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const int entry = stack[--size];
    if (entry < 0)
      impl_->test_block(impl_->blocks[static_cast<std::size_t>(~entry)], shell, ids);
    else
      size += impl_->test_node(impl_->nodes[static_cast<std::size_t>(entry)], shell, stack + size);
  }
}

}  // namespace isochron
