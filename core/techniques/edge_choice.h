// How often each edge is picked.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/discrete_distribution.h"

namespace isochron {

/// A choice in proportion to weights; where there are both, moving and static edges get equal shares. Edges come in groups of
/// neighbours, so that unchanged groups are reused.
class EdgeChoice {
 public:
  void resize(std::size_t groups) { groups_.resize(groups); }
  /// Edges `first`, first + 1, ...: their weights, and which of them move. `finish` is to follow.
  void set_group(std::size_t group, int first, std::span<const double> weights, std::span<const std::uint8_t> moves) {
    Group& g = groups_[group];
    g.first = first;
    for (const int moving : {0, 1}) {
      const bool any = std::ranges::find(moves, moving) != moves.end();
      const auto weight_of = [&](std::size_t i) { return moves[i] == moving ? weights[i] : 0; };
      g.of[moving] = any ? DiscreteDistribution(weights.size(), weight_of) : DiscreteDistribution();
    }
  }
  void finish() {
    std::array<double, 2> sum{};
    for (const Group& group : groups_)
      for (const int moving : {0, 1}) sum[moving] += group.of[moving].total();
    const bool both = sum[0] > 0 && sum[1] > 0;
    group_ = DiscreteDistribution(
        2 * groups_.size(), [&](std::size_t i) { return part(static_cast<int>(i)).total() / (both ? sum[i % 2] : 1); });
  }

  bool empty() const { return group_.empty(); }
  struct Pick {
    int edge;
    double begin, share;  ///< u from `begin` to begin + share draw this edge
  };
  /// `u` in (0, 1) is replaced by a fresh uniform number.
  Pick pick(double& u) const {
    const int i = group_.sample(u), edge = part(i).sample(u);
    const double share = group_.probability(i);
    return {groups_[i / 2].first + edge, group_.below(i) + share * part(i).below(edge),
            share * part(i).probability(edge)};
  }

 private:
  struct Group {
    int first = 0;
    std::array<DiscreteDistribution, 2> of;  ///< static and moving edges
  };
  const DiscreteDistribution& part(int i) const { return groups_[i / 2].of[i % 2]; }

  std::vector<Group> groups_;
  DiscreteDistribution group_;  ///< over the groups' two parts
};

}  // namespace isochron
