#include "core/geometry/ellipsoid_bvh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/geometry/ellipsoid.h"

namespace isochron {
namespace {

constexpr int kWidth = 8;
constexpr int kFlat = 16;            ///< up to so many triangles a scan beats a hierarchy
constexpr int kHeuristicDepth = 24;  ///< below it ranges are halved, which bounds the depth for any input
constexpr int kStack = 7 * (kHeuristicDepth + 32) + 2 * kWidth;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// By value, unlike std::min and std::max, which keep loops from being vectorised.
inline double min(double a, double b) {
  return a < b ? a : b;
}
inline double max(double a, double b) {
  return a > b ? a : b;
}

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
/// zero when the ellipsoid is not valid: without an inner one nothing is excluded, and an infinite outer one
/// holds all.
struct QuadraticForm {
  double inverse_minor2 = 0, k = 0;
  explicit QuadraticForm(const Ellipsoid& e) {
    if (!e.valid()) return;
    inverse_minor2 = 1 / (e.minor * e.minor);
    k = inverse_minor2 - 1 / (e.major * e.major);
  }
  /// From |r|^2 and (r.u)^2, or with products of two points the bilinear form.
  double operator()(double squared, double axial_squared) const {
    return squared * inverse_minor2 - axial_squared * k;
  }
};

}  // namespace

struct EllipsoidBvh::Shell {
  Vec3 center, axis;
  QuadraticForm high, low;
  double inside;    ///< Q_high of points that may be inside the outer ellipsoid is at most this
  double outside;   ///< Q_low of points that may be outside the inner ellipsoid is at least this
  /// Where Q_low exceeds the first and Q_high is below the second, points are strictly between the two ellipsoids.
  double between_low, between_high;
  Ellipsoid outer;  ///< the outer ellipsoid, grown by the round-off of positions
};

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
  static std::size_t blocks_of(std::ptrdiff_t count) {
    return static_cast<std::size_t>((count + 7) / kWidth);
  }

  static Item* split(const Range& range);
  int make_block(const std::vector<Input>& triangles, const Range& range);
  int make_node(const std::vector<Input>& triangles, const Range& range, int depth);

  // With `kSurfaces` what lies strictly between the two ellipsoids is left out.
  template <bool kSurfaces>
  int visit(const Shell& shell, std::vector<int>& ids) const;
  template <bool kSurfaces>
  void test_block(const Block& block, const Shell& shell, std::vector<int>& ids) const;
  template <bool kSurfaces>
  int test_node(const Node& node, const Shell& shell, int* hits) const;
  void prefetch(int entry) const;
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
    for (std::size_t v = 0; v < 3; ++v)
      block.vertex[v].set(lane, used ? input->vertex[v] : Vec3{nan, nan, nan});
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
    node.center.set(lane, center);
    node.half.set(lane, half);
  }
  nodes[self] = node;
  return static_cast<int>(self);
}

template <bool kSurfaces>
void EllipsoidBvh::Impl::test_block(const Block& block, const Shell& shell, std::vector<int>& ids) const {
  const Vec3 c = shell.center, u = shell.axis;
  const QuadraticForm high = shell.high, low = shell.low;
  Wide lowest_bound, lowest_vertex, highest_vertex, lowest_of_low, highest_of_high;
  for (int i = 0; i < kWidth; ++i) {
    const Vec3 r0 = block.vertex[0].get(i) - c, r1 = block.vertex[1].get(i) - c,
               r2 = block.vertex[2].get(i) - c;
    const double x0 = dot(r0, u), x1 = dot(r1, u), x2 = dot(r2, u);
    const double s0 = dot(r0, r0), s1 = dot(r1, r1), s2 = dot(r2, r2);
    const double s01 = dot(r0, r1), s12 = dot(r1, r2), s20 = dot(r2, r0);
    // Q lies above its tangent plane at each vertex v, 2 B(v, p) - Q(v) with B the bilinear form of Q, and a
    // plane over a triangle is lowest at a vertex: a bound that is exact to second order in the triangle's
    // size.
    const auto tangent_bound = [&](const QuadraticForm& q, double q0, double q1, double q2) {
      const double b01 = 2 * q(s01, x0 * x1), b12 = 2 * q(s12, x1 * x2), b20 = 2 * q(s20, x2 * x0);
      return max(max(min(b01, b20) - q0, min(b01, b12) - q1), min(b12, b20) - q2);
    };
    const double h0 = high(s0, x0 * x0), h1 = high(s1, x1 * x1), h2 = high(s2, x2 * x2);
    const double l0 = low(s0, x0 * x0), l1 = low(s1, x1 * x1), l2 = low(s2, x2 * x2);
    const double nearest = min(min(h0, h1), h2);
    lowest_vertex.lane[i] = nearest;
    lowest_bound.lane[i] = min(tangent_bound(high, h0, h1, h2), nearest);
    highest_vertex.lane[i] = max(max(l0, l1), l2);
    if constexpr (kSurfaces) {
      lowest_of_low.lane[i] = min(tangent_bound(low, l0, l1, l2), min(min(l0, l1), l2));
      highest_of_high.lane[i] = max(max(h0, h1), h2);
    }
  }
  // Which lanes report is unpredictable, so no branches here but for the few uncertain ones.
  bool reported[kWidth];
  int uncertain = 0;
  for (int i = 0; i < kWidth; ++i) {
    reported[i] = (lowest_bound.lane[i] <= shell.inside) & (highest_vertex.lane[i] >= shell.outside);
    if constexpr (kSurfaces)
      reported[i] &=
          !((lowest_of_low.lane[i] > shell.between_low) & (highest_of_high.lane[i] < shell.between_high));
    uncertain += reported[i] & (lowest_vertex.lane[i] > shell.inside);
  }
  for (int i = 0; uncertain > 0; ++i) {
    if (!reported[i] || !(lowest_vertex.lane[i] > shell.inside)) continue;
    // No vertex inside the outer ellipsoid: they cross only if the triangle's plane or edges reach into it.
    EllipseArcs arcs;
    reported[i] = clip_ellipse(shell.outer, block.vertex[0].get(i), block.vertex[1].get(i),
                               block.vertex[2].get(i), arcs);
    --uncertain;
  }
  int found[kWidth], count = 0;
  for (int i = 0; i < kWidth; ++i) {
    found[count] = block.id[i];
    count += reported[i];
  }
  ids.insert(ids.end(), found, found + count);
}

template <bool kSurfaces>
int EllipsoidBvh::Impl::test_node(const Node& node, const Shell& shell, int* hits) const {
  const Vec3 c = shell.center, u = shell.axis;
  const QuadraticForm high = shell.high, low = shell.low;
  Wide lowest, highest, lowest_of_low, highest_of_high;
  for (int i = 0; i < kWidth; ++i) {
    const Vec3 r = node.center.get(i) - c, h = node.half.get(i);
    const double x = dot(r, u), squared = dot(r, r);
    // Q over the box differs from Q at its centre by at most sum |dQ_k| h_k, and on the upper side also by
    // |h|^2 / minor^2.
    const auto slope = [&](const QuadraticForm& form) {
      const Vec3 half_gradient = r * form.inverse_minor2 - u * (x * form.k);
      return 2 * (std::abs(half_gradient.x) * h.x + std::abs(half_gradient.y) * h.y +
                  std::abs(half_gradient.z) * h.z);
    };
    const double slope_high = slope(high), slope_low = slope(low), farthest = squared + dot(h, h);
    lowest.lane[i] = high(squared, x * x) - slope_high;
    highest.lane[i] = low(farthest, x * x) + slope_low;
    if constexpr (kSurfaces) {
      lowest_of_low.lane[i] = low(squared, x * x) - slope_low;
      highest_of_high.lane[i] = high(farthest, x * x) + slope_high;
    }
  }
  int count = 0;
  for (int i = 0; i < kWidth; ++i) {
    hits[count] = node.child[i];
    bool meets = (lowest.lane[i] <= shell.inside) & (highest.lane[i] >= shell.outside);
    if constexpr (kSurfaces)
      meets &= !((lowest_of_low.lane[i] > shell.between_low) & (highest_of_high.lane[i] < shell.between_high));
    count += meets;
  }
  for (int i = 0; i < count; ++i) prefetch(hits[i]);
  return count;
}

/// Queries jump about in memory: asking early for all that will be visited saves a fifth of the time on large
/// meshes.
void EllipsoidBvh::Impl::prefetch(int entry) const {
  const char* address = entry < 0 ? reinterpret_cast<const char*>(&blocks[static_cast<std::size_t>(~entry)])
                                  : reinterpret_cast<const char*>(&nodes[static_cast<std::size_t>(entry)]);
  for (std::size_t offset = 0; offset < sizeof(Node); offset += 64) __builtin_prefetch(address + offset);
}

EllipsoidBvh::EllipsoidBvh() = default;
EllipsoidBvh::EllipsoidBvh(EllipsoidBvh&&) noexcept = default;
EllipsoidBvh& EllipsoidBvh::operator=(EllipsoidBvh&&) noexcept = default;
EllipsoidBvh::~EllipsoidBvh() = default;

EllipsoidBvh::EllipsoidBvh(const std::vector<Input>& triangles) {
  const auto finite = [](const Vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
  };
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

bool EllipsoidBvh::empty() const {
  return !impl_;
}

template <bool kSurfaces>
int EllipsoidBvh::Impl::visit(const Shell& shell, std::vector<int>& ids) const {
  if (nodes.empty()) {
    for (const Block& block : blocks) test_block<kSurfaces>(block, shell, ids);
    return static_cast<int>(blocks.size());
  }
  int stack[kStack];  // a visit replaces one entry by up to eight
  int size = 0;
  stack[size++] = 0;
  int visited = 0;
  for (; size > 0; ++visited) {
    const int entry = stack[--size];
    if (entry < 0)
      test_block<kSurfaces>(blocks[static_cast<std::size_t>(~entry)], shell, ids);
    else
      size += test_node<kSurfaces>(nodes[static_cast<std::size_t>(entry)], shell, stack + size);
  }
  return visited;
}

int EllipsoidBvh::query(const Vec3& a, const Vec3& b, double tau_low, double tau_high,
                        std::vector<int>& ids) const {
  const auto shell = make_shell(a, b, tau_low, tau_high);
  return shell ? impl_->visit<false>(*shell, ids) : 0;
}

int EllipsoidBvh::query_surfaces(const Vec3& a, const Vec3& b, double tau_low, double tau_high,
                                  std::vector<int>& ids) const {
  const auto shell = make_shell(a, b, tau_low, tau_high);
  if (!shell) return 0;
  // Nothing is between equal lengths, and of a coarse mesh's triangles few are: the simpler tests do.
  const bool fine = impl_->blocks.size() > kWidth;
  return tau_low < tau_high && fine ? impl_->visit<true>(*shell, ids) : impl_->visit<false>(*shell, ids);
}

std::optional<EllipsoidBvh::Shell> EllipsoidBvh::make_shell(const Vec3& a, const Vec3& b, double tau_low,
                                                            double tau_high) const {
  const Ellipsoid outer(a, b, tau_high);
  const Ellipsoid inner(a, b, tau_low);
  if (!impl_ || !(outer.valid() || tau_high == kInfinity)) return std::nullopt;
  const Vec3& axis = outer.valid() ? outer.axis : inner.axis;
  Shell shell{outer.center, axis, QuadraticForm(outer), QuadraticForm(inner), 0, 0, 0, 0, outer};

  // Positions relative to the centre carry the round-off of all coordinates involved, here counted generously
  // as a change of tau; |dQ/dtau| <= major / minor^2 on the surface turns it into a change of Q, and the
  // evaluation of Q cancels terms of size reach^2 / minor^2.
  const Vec3 middle = impl_->bounds.center();
  const double radius = length(impl_->bounds.upper - middle);
  const double reach = length(middle - outer.center) + radius + outer.major;
  const double magnitude = reach + length(middle) + radius + length(a) + length(b);
  const double round_off = 64 * std::numeric_limits<double>::epsilon();
  const auto slack = [&](const QuadraticForm& form) {
    return 4 * round_off * reach * magnitude * form.inverse_minor2;
  };
  shell.inside = 1 + slack(shell.high);
  shell.outside = inner.valid() ? 1 - slack(shell.low) : -kInfinity;
  shell.between_low = inner.valid() ? 1 + slack(shell.low) : -kInfinity;
  shell.between_high = 1 - slack(shell.high);
  shell.outer = Ellipsoid(a, b, tau_high + round_off * magnitude);
  return shell;
}

}  // namespace isochron
