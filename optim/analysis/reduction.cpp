#include "optim/analysis/reduction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace isochron {
namespace {

/// Norm of the mean of some vectors, and of its standard errors.
struct MeanNorm {
  double norm = 0, error = 0;
};

MeanNorm mean_norm(const std::vector<std::vector<double>>& vectors) {
  const auto count = static_cast<double>(vectors.size());
  MeanNorm result;
  for (std::size_t c = 0; c < vectors[0].size(); ++c) {
    double mean = 0, squares = 0;
    for (const auto& v : vectors) mean += v[c] / count;
    for (const auto& v : vectors) squares += (v[c] - mean) * (v[c] - mean);
    result.norm += mean * mean;
    result.error += squares / (count * (count - 1));
  }
  return {std::sqrt(result.norm), std::sqrt(result.error)};
}

enum class BiasVerdict { within, undecided, beyond };

BiasVerdict judge(std::span<const GradientReplicates> points, const Reduction& kept, double tolerance) {
  BiasVerdict worst = BiasVerdict::within;
  for (const GradientReplicates& point : points) {
    const RelativeBias bias = relative_bias(point, kept);
    worst = std::max(worst, bias.upper <= tolerance  ? BiasVerdict::within
                            : bias.lower > tolerance ? BiasVerdict::beyond
                                                     : BiasVerdict::undecided);
  }
  return worst;
}

/// The largest share of a term in the gradient, over the points.
double largest_share(std::span<const GradientReplicates> points, int max_bounces, int term) {
  double largest = 0;
  for (const GradientReplicates& point : points) {
    Reduction others{max_bounces, {true, true, true}};
    others.terms[term] = false;
    largest = std::max(largest, relative_bias(point, others).value);
  }
  return largest;
}

}  // namespace

std::vector<double> GradientReplicates::gradient(int replicate, const Reduction& kept) const {
  std::vector<double> sum(columns_, 0.0);
  for (int term = 0; term < 3; ++term)
    for (int c = 0; kept.terms[term] && c < columns_; ++c)
      sum[c] += replicates_[replicate][index(kept.max_bounces, term, c, columns_)];
  return sum;
}

RelativeBias relative_bias(const GradientReplicates& replicates, const Reduction& kept) {
  std::vector<std::vector<double>> gradients, differences;
  bool differs = false, any = false;
  for (int r = 0; r < replicates.size(); ++r) {
    gradients.push_back(replicates.gradient(r, replicates.full()));
    differences.push_back(replicates.gradient(r, kept));
    for (int c = 0; c < replicates.columns(); ++c) {
      differences[r][c] -= gradients[r][c];
      if (differences[r][c] != 0) differs = true;
      if (gradients[r][c] != 0) any = true;
    }
  }
  if (!any) return {.upper = std::numeric_limits<double>::infinity()};
  if (!differs) return {};
  const MeanNorm d = mean_norm(differences), g = mean_norm(gradients);
  RelativeBias bias;
  bias.value = d.norm / g.norm;
  bias.standard_error = d.error / g.norm;
  bias.lower = std::max(0.0, d.norm - 2 * d.error) / (g.norm + 2 * g.error);
  const double least = g.norm - 2 * g.error;
  bias.upper = least > 0 ? (d.norm + 2 * d.error) / least : std::numeric_limits<double>::infinity();
  return bias;
}

double expected_beyond(const GradientReplicates& replicates) {
  Reduction kept = replicates.full();
  if (kept.max_bounces < 2) return 0;
  --kept.max_bounces;
  const double last = relative_bias(replicates, kept).value;
  --kept.max_bounces;
  const double before = relative_bias(replicates, kept).value - last;
  if (!(last > 0)) return 0;
  return last < before ? last * last / (before - last) : std::numeric_limits<double>::infinity();
}

ReductionChoice choose_reduction(std::span<const GradientReplicates> points, double tolerance) {
  ReductionChoice choice;
  choice.kept = points[0].full();
  const auto accepts = [&](const Reduction& fewer, const std::string& what) {
    const BiasVerdict verdict = judge(points, fewer, tolerance);
    if (verdict == BiasVerdict::undecided) choice.undecided.push_back(what);
    if (verdict == BiasVerdict::within) choice.kept = fewer;
    return verdict == BiasVerdict::within;
  };
  while (choice.kept.max_bounces > 0) {
    Reduction fewer = choice.kept;
    --fewer.max_bounces;
    if (!accepts(fewer, fmt::format("whether {} bounces would do", fewer.max_bounces))) break;
  }
  std::array<int, 3> order{0, 1, 2};
  std::array<double, 3> share;
  for (int term : order) share[term] = largest_share(points, choice.kept.max_bounces, term);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return share[a] < share[b]; });
  for (int term : order) {
    Reduction fewer = choice.kept;
    fewer.terms[term] = false;
    if (std::none_of(fewer.terms.begin(), fewer.terms.end(), [](bool kept) { return kept; })) break;
    accepts(fewer, fmt::format("whether the {} term is needed", name(kTerms[term])));
  }
  for (const GradientReplicates& point : points) choice.bias.push_back(relative_bias(point, choice.kept));
  return choice;
}

}  // namespace isochron
