#include "core/geometry/ellipsoid_bvh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/base/random.h"
#include "core/base/systematic_sampling.h"
#include "core/geometry/ellipsoid.h"
#include "core/geometry/ellipsoid_bvh_impl.h"

namespace isochron {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Nodes or blocks that a thinned query continues with: more of them cost time, fewer variance (halving them doubled the
/// variance on the glossy tree, doubling them gained nothing on 1700 and 70 000 triangles).
constexpr int kKept = 16;

// By value, unlike std::min and std::max, which keep loops from being vectorised.
inline double min(double a, double b) {
  return a < b ? a : b;
}
inline double max(double a, double b) {
  return a > b ? a : b;
}

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
  double operator()(double squared, double axial_squared) const { return squared * inverse_minor2 - axial_squared * k; }
};

}  // namespace

struct EllipsoidBvh::Shell {
  Foci foci;
  QuadraticForm high, low;
  double inside;   ///< Q_high of points that may be inside the outer ellipsoid is at most this
  double outside;  ///< Q_low of points that may be outside the inner ellipsoid is at least this
  /// Where Q_low exceeds the first and Q_high is below the second, points are strictly between the two ellipsoids.
  double between_low, between_high;
  double outer_tau;   ///< total length of the outer ellipsoid, grown by the round-off of positions
  bool exact = true;  ///< leave out triangles that come close to the outer ellipsoid, but do not reach into it
};

template <bool kSurfaces>
void EllipsoidBvh::Impl::test_block(const Block& block, const Shell& shell, std::vector<int>& ids) const {
  const Vec3 c = shell.foci.center, u = shell.foci.axis;
  const QuadraticForm high = shell.high, low = shell.low;
  Wide lowest_bound, lowest_vertex, highest_vertex, lowest_of_low, highest_of_high;
  for (int i = 0; i < kWidth; ++i) {
    const Vec3 r0 = block.vertex[0].get(i) - c, r1 = block.vertex[1].get(i) - c, r2 = block.vertex[2].get(i) - c;
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
      reported[i] &= !((lowest_of_low.lane[i] > shell.between_low) & (highest_of_high.lane[i] < shell.between_high));
    uncertain += reported[i] & shell.exact & (lowest_vertex.lane[i] > shell.inside);
  }
  std::optional<Ellipsoid> outer;
  for (int i = 0; uncertain > 0; ++i) {
    if (!reported[i] || !(lowest_vertex.lane[i] > shell.inside)) continue;
    // No vertex inside the outer ellipsoid: they cross only if the triangle's plane or edges reach into it.
    if (!outer) outer.emplace(shell.foci, shell.outer_tau);
    EllipseArcs arcs;
    reported[i] = clip_ellipse(*outer, block.vertex[0].get(i), block.vertex[1].get(i), block.vertex[2].get(i), arcs);
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
int EllipsoidBvh::Impl::test_node(const Node& node, const Shell& shell, int* lanes) const {
  const Vec3 c = shell.foci.center, u = shell.foci.axis;
  const QuadraticForm high = shell.high, low = shell.low;
  Wide lowest, highest, lowest_of_low, highest_of_high;
  for (int i = 0; i < kWidth; ++i) {
    const Vec3 r = node.center.get(i) - c, h = node.half.get(i);
    const double x = dot(r, u), squared = dot(r, r);
    // Q over the box differs from Q at its centre by at most sum |dQ_k| h_k, and on the upper side also by
    // |h|^2 / minor^2.
    const auto slope = [&](const QuadraticForm& form) {
      const Vec3 half_gradient = r * form.inverse_minor2 - u * (x * form.k);
      return 2 * (std::abs(half_gradient.x) * h.x + std::abs(half_gradient.y) * h.y + std::abs(half_gradient.z) * h.z);
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
    lanes[count] = i;
    bool meets = (lowest.lane[i] <= shell.inside) & (highest.lane[i] >= shell.outside);
    if constexpr (kSurfaces)
      meets &= !((lowest_of_low.lane[i] > shell.between_low) & (highest_of_high.lane[i] < shell.between_high));
    count += meets;
  }
  for (int i = 0; i < count; ++i) prefetch(node.child[lanes[i]]);
  return count;
}

/// Queries jump about in memory: asking early for all that will be visited saves a fifth of the time on large
/// meshes.
void EllipsoidBvh::Impl::prefetch(int entry) const {
  const char* address = entry < 0 ? reinterpret_cast<const char*>(&blocks[static_cast<std::size_t>(~entry)])
                                  : reinterpret_cast<const char*>(&nodes[static_cast<std::size_t>(entry)]);
  for (std::size_t offset = 0; offset < sizeof(Node); offset += 64) __builtin_prefetch(address + offset);
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
  int stack[kStack];
  int size = 0;
  stack[size++] = 0;
  int visited = 0;
  for (; size > 0; ++visited) {
    const int entry = stack[--size];
    if (entry < 0) {
      test_block<kSurfaces>(blocks[static_cast<std::size_t>(~entry)], shell, ids);
      continue;
    }
    const Node& node = nodes[static_cast<std::size_t>(entry)];
    int lanes[kWidth];
    const int hits = test_node<kSurfaces>(node, shell, lanes);
    for (int i = 0; i < hits; ++i) stack[size++] = node.child[lanes[i]];
  }
  return visited;
}

namespace {

/// What a surface of the given extent at `center` may exchange with the focus, up to a factor.
double exchange(const EllipsoidBvh::Focus& focus, const Vec3& center, double radius) {
  const Vec3 d = center - focus.p;
  const double squared = dot(d, d), along = dot(d, focus.axis);
  const double across = std::sqrt(max(squared - along * along, 0));
  // Distance of the centre from the cone, of which a negative one is inside.
  const bool nearest_is_apex = along * focus.cosine + across * focus.sine < 0;
  const double distance = nearest_is_apex ? std::sqrt(squared) : across * focus.cosine - along * focus.sine;
  if (distance > radius) return 0;
  const double cosine = focus.lambertian ? (max(along, 0) + radius) / (std::sqrt(squared) + radius) : 1;
  return cosine / max(squared, radius * radius);
}

}  // namespace

template <bool kSurfaces>
void EllipsoidBvh::Impl::visit_some(const Shell& shell, const Focus& a, const Focus& b, double u, std::vector<int>& ids,
                                    std::vector<double>& inverse_probability) const {
  Entry entries[kWidth * (kKept + 1)], next[kWidth * (kKept + 1)];
  int size = 1;
  entries[0] = {0, 1, 1};
  Rng rng(Stream{std::bit_cast<std::uint64_t>(u), 0, 0}, 0, 0);
  for (bool nodes_left = true; nodes_left;) {
    nodes_left = false;
    int count = 0;
    for (int e = 0; e < size; ++e) {
      const Entry& entry = entries[e];
      if (entry.child < 0) {
        next[count++] = entry;
        continue;
      }
      const Node& node = nodes[static_cast<std::size_t>(entry.child)];
      int lanes[kWidth];
      const int hits = test_node<kSurfaces>(node, shell, lanes);
      for (int i = 0; i < hits; ++i) {
        const Vec3 center = node.center.get(lanes[i]);
        const double radius = length(node.half.get(lanes[i]));
        const double weight = radius * exchange(a, center, radius) * exchange(b, center, radius);
        if (!(weight > 0)) continue;
        const int child = node.child[lanes[i]];
        nodes_left |= child >= 0;
        next[count++] = {child, weight * entry.inverse_probability, entry.inverse_probability};
      }
    }
    size = count > kKept ? sample_systematically(next, count, kKept, rng.uniform()) : count;
    std::copy(next, next + size, entries);
  }
  for (int e = 0; e < size; ++e) {
    test_block<kSurfaces>(blocks[static_cast<std::size_t>(~entries[e].child)], shell, ids);
    inverse_probability.resize(ids.size(), entries[e].inverse_probability);
  }
}

int EllipsoidBvh::query(const Vec3& a, const Vec3& b, double tau_low, double tau_high, std::vector<int>& ids) const {
  const auto shell = make_shell(a, b, tau_low, tau_high);
  return shell ? impl_->visit<false>(*shell, ids) : 0;
}

int EllipsoidBvh::query_surfaces(const Vec3& a, const Vec3& b, double tau_low, double tau_high,
                                 std::vector<int>& ids) const {
  const auto shell = make_shell(a, b, tau_low, tau_high);
  if (!shell) return 0;
  return impl_->has_between(tau_low, tau_high) ? impl_->visit<true>(*shell, ids) : impl_->visit<false>(*shell, ids);
}

void EllipsoidBvh::sample_surfaces(const Focus& a, const Focus& b, double tau_low, double tau_high, double u,
                                   std::vector<int>& ids, std::vector<double>& inverse_probability) const {
  auto shell = make_shell(a.p, b.p, tau_low, tau_high);
  if (!shell) return;
  shell->exact = false;
  const bool surfaces = impl_->has_between(tau_low, tau_high);
  if (impl_->blocks.size() <= kKept) {
    surfaces ? impl_->visit<true>(*shell, ids) : impl_->visit<false>(*shell, ids);
    inverse_probability.resize(ids.size(), 1.0);
  } else if (surfaces) {
    impl_->visit_some<true>(*shell, a, b, u, ids, inverse_probability);
  } else {
    impl_->visit_some<false>(*shell, a, b, u, ids, inverse_probability);
  }
}

std::optional<EllipsoidBvh::Shell> EllipsoidBvh::make_shell(const Vec3& a, const Vec3& b, double tau_low,
                                                            double tau_high) const {
  if (!impl_) return std::nullopt;
  const Foci foci(a, b);
  const Ellipsoid outer(foci, tau_high), inner(foci, tau_low);
  if (!(outer.valid() || tau_high == kInfinity)) return std::nullopt;
  const QuadraticForm high(outer);
  Shell shell{foci, high, tau_low == tau_high ? high : QuadraticForm(inner), 0, 0, 0, 0, 0};

  // Positions relative to the centre carry the round-off of all coordinates involved, here counted generously
  // as a change of tau; |dQ/dtau| <= major / minor^2 on the surface turns it into a change of Q, and the
  // evaluation of Q cancels terms of size reach^2 / minor^2.
  const Vec3 middle = impl_->bounds.center();
  const double radius = length(impl_->bounds.high - middle);
  const double reach = length(middle - foci.center) + radius + outer.major;
  const double magnitude = reach + length(middle) + radius + length(a) + length(b);
  const double round_off = 64 * std::numeric_limits<double>::epsilon();
  const auto slack = [&](const QuadraticForm& form) { return 4 * round_off * reach * magnitude * form.inverse_minor2; };
  shell.inside = 1 + slack(shell.high);
  shell.outside = inner.valid() ? 1 - slack(shell.low) : -kInfinity;
  shell.between_low = inner.valid() ? 1 + slack(shell.low) : -kInfinity;
  shell.between_high = 1 - slack(shell.high);
  shell.outer_tau = tau_high + round_off * magnitude;
  return shell;
}

}  // namespace isochron
