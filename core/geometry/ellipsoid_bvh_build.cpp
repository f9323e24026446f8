// Building the hierarchy: a binned surface-area heuristic, eight children to a node.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/geometry/ellipsoid_bvh_impl.h"

namespace isochron {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <class Item>
Bounds range_box(const std::pair<Item*, Item*>& range) {
  Bounds box;
  for (const Item* i = range.first; i != range.second; ++i) box.add(i->box);
  return box;
}

}  // namespace

/// Binned surface-area heuristic, counting whole blocks as the cost of a side: leaves come out full.
EllipsoidBvh::Impl::Item* EllipsoidBvh::Impl::split(const Range& range) {
  constexpr int kBins = 32;
  const auto blocks_of = [](int count) { return (count + kWidth - 1) / kWidth; };
  Bounds centers;
  for (const Item* i = range.first; i != range.second; ++i) centers.add(i->center);
  double best = kInfinity, best_scale = 0;
  int best_axis = -1, best_bin = 0;
  const auto bin_of = [&](const Item& item, int axis, double scale) {
    return std::min(kBins - 1, static_cast<int>((item.center[axis] - centers.low[axis]) * scale));
  };
  for (int axis = 0; axis < 3; ++axis) {
    const double scale = kBins / (centers.high[axis] - centers.low[axis]);
    if (!(scale < kInfinity)) continue;
    std::array<Bounds, kBins> boxes;
    std::array<int, kBins> counts{};
    for (const Item* i = range.first; i != range.second; ++i) {
      const auto bin = static_cast<std::size_t>(bin_of(*i, axis, scale));
      boxes[bin].add(i->box), ++counts[bin];
    }
    std::array<double, kBins> right_cost{};
    Bounds side;
    int count = 0;
    for (std::size_t bin = kBins - 1; bin > 0; --bin) {
      if (counts[bin]) side.add(boxes[bin]), count += counts[bin];
      right_cost[bin] = count ? side.half_area() * blocks_of(count) : kInfinity;
    }
    side = Bounds{}, count = 0;
    for (std::size_t bin = 1; bin < kBins; ++bin) {
      if (counts[bin - 1]) side.add(boxes[bin - 1]), count += counts[bin - 1];
      if (!count) continue;
      const double cost = side.half_area() * blocks_of(count) + right_cost[bin];
      if (cost < best) best = cost, best_axis = axis, best_bin = static_cast<int>(bin), best_scale = scale;
    }
  }
  if (best_axis < 0) return range.first + (range.second - range.first) / 2;  // all centres coincide
  return std::stable_partition(range.first, range.second,
                               [&](const Item& item) { return bin_of(item, best_axis, best_scale) < best_bin; });
}

int EllipsoidBvh::Impl::make_block(const std::vector<Input>& triangles, const Range& range) {
  Block block;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int lane = 0; lane < kWidth; ++lane) {
    const bool used = lane < range.second - range.first;
    const Input* input = used ? &triangles[static_cast<std::size_t>(range.first[lane].index)] : nullptr;
    for (std::size_t v = 0; v < 3; ++v) block.vertex[v].set(lane, used ? input->vertex[v] : Vec3{nan, nan, nan});
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
      const Bounds box = range_box(children[i]);
      center = box.center();
      half = box.high - center;
      // Round-off in the centre is covered by the query's slack; the box must only not shrink by itself.
      for (int k = 0; k < 3; ++k) half[k] = std::max(half[k], center[k] - box.low[k]);
      const bool leaf = children[i].second - children[i].first <= kWidth;
      node.child[lane] = leaf ? make_block(triangles, children[i]) : make_node(triangles, children[i], depth + 1);
    }
    node.center.set(lane, center);
    node.half.set(lane, half);
  }
  nodes[self] = node;
  return static_cast<int>(self);
}

EllipsoidBvh::EllipsoidBvh() = default;
EllipsoidBvh::EllipsoidBvh(EllipsoidBvh&&) noexcept = default;
EllipsoidBvh& EllipsoidBvh::operator=(EllipsoidBvh&&) noexcept = default;
EllipsoidBvh::~EllipsoidBvh() = default;

EllipsoidBvh::EllipsoidBvh(const std::vector<Input>& triangles) {
  const auto finite = [](const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); };
  std::vector<Impl::Item> items;
  items.reserve(triangles.size());
  Bounds bounds;
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
  if (items.size() > Impl::kFlat) {
    impl_->make_node(triangles, {items.data(), items.data() + items.size()}, 0);
    return;
  }
  for (std::size_t i = 0; i < items.size(); i += Impl::kWidth)
    impl_->make_block(triangles, Impl::Range{&items[i], items.data() + std::min(items.size(), i + Impl::kWidth)});
}

}  // namespace isochron
