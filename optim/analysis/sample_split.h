// How samples are best split between the image and the terms of the derivative: the variance of the loss
// gradient as a function of their numbers, and the numbers that reach a variance in the least time.
#pragma once
#include <array>
#include <vector>

namespace isochron {

/// Samples per pixel, or what goes with them: of the image, then of the terms in the order of kTerms.
inline constexpr int kPasses = 4;
using PerPass = std::array<double, kPasses>;

/// Variance of the loss gradient 2 (I - T) dI, summed over its components, with n[0] samples of the image I
/// and n[1 + t] of each term of dI, all independent:
///   image / n[0]  +  sum over terms of (term[t] + cross[t] / n[0]) / n[1 + t]
/// image: noise of I times mean dI; term: mean residual times noise of dI; cross: noise times noise.
struct GradientVariance {
  double image = 0;
  std::array<double, 3> term{}, cross{};
  /// A term with no samples is left out.
  double operator()(const PerPass& n) const;
  GradientVariance& add(const GradientVariance& other, double weight);
};

/// Of a table x[i][j] = mean + a_i + b_j + e_ij with independent random a, b and e: unbiased estimates of
/// their variances, from the mean squares of a two-way layout with one value per cell (Searle, Casella and
/// McCulloch 1992). `rows` and `columns` may come out negative. At least two rows and columns.
struct VarianceComponents {
  double rows = 0, columns = 0, cells = 0;
};
VarianceComponents variance_components(const std::vector<std::vector<double>>& table);

/// Numbers of samples, not rounded, of least variance with sum(cost * n) = time. Terms that are not `kept`
/// get none. For no cross terms, n_i is in proportion to sqrt(variance_i / cost_i).
PerPass best_split(const GradientVariance& variance, const PerPass& cost, const std::array<bool, 3>& kept, double time);

/// Whole numbers, at least two of the image and one of each kept term, whose variance is at most `wanted`, in the least time: the
/// best split for it, rounded, and improved by single samples.
std::array<int, kPasses> cheapest_split(const GradientVariance& variance, const PerPass& cost,
                                        const std::array<bool, 3>& kept, double wanted);

}  // namespace isochron
