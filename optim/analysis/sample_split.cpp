#include "optim/analysis/sample_split.h"

#include <algorithm>
#include <cmath>

namespace isochron {
namespace {

double total_cost(const PerPass& cost, const PerPass& n) {
  double sum = 0;
  for (int i = 0; i < kPasses; ++i) sum += cost[i] * n[i];
  return sum;
}

/// Given the image's samples, the others follow in closed form from the time that is left.
PerPass split_the_rest(const GradientVariance& v, const PerPass& cost, const std::array<bool, 3>& kept, double image,
                       double left) {
  PerPass n{image, 0, 0, 0};
  PerPass root{};
  double sum = 0;
  for (int t = 0; t < 3; ++t) {
    if (!kept[t]) continue;
    root[1 + t] = std::sqrt((v.term[t] + v.cross[t] / image) / cost[1 + t]);
    sum += root[1 + t] * cost[1 + t];
  }
  for (int i = 1; i < kPasses; ++i) n[i] = sum > 0 ? left * root[i] / sum : 0;
  return n;
}

}  // namespace

double GradientVariance::operator()(const PerPass& n) const {
  double sum = image / n[0];
  for (int t = 0; t < 3; ++t)
    if (n[1 + t] > 0) sum += (term[t] + cross[t] / n[0]) / n[1 + t];
  return sum;
}

GradientVariance& GradientVariance::add(const GradientVariance& other, double weight) {
  image += weight * other.image;
  for (int t = 0; t < 3; ++t) {
    term[t] += weight * other.term[t];
    cross[t] += weight * other.cross[t];
  }
  return *this;
}

VarianceComponents variance_components(const std::vector<std::vector<double>>& table) {
  const std::size_t rows = table.size(), columns = table[0].size();
  const auto m = static_cast<double>(rows), n = static_cast<double>(columns);
  std::vector<double> row(rows, 0.0), column(columns, 0.0);
  double mean = 0;
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < columns; ++j) {
      row[i] += table[i][j] / n;
      column[j] += table[i][j] / m;
      mean += table[i][j] / (m * n);
    }
  double of_rows = 0, of_columns = 0, of_cells = 0;
  for (std::size_t i = 0; i < rows; ++i) of_rows += (row[i] - mean) * (row[i] - mean);
  for (std::size_t j = 0; j < columns; ++j) of_columns += (column[j] - mean) * (column[j] - mean);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < columns; ++j) {
      const double e = table[i][j] - row[i] - column[j] + mean;
      of_cells += e * e;
    }
  VarianceComponents result;
  result.cells = of_cells / ((m - 1) * (n - 1));
  result.rows = of_rows / (m - 1) - result.cells / n;
  result.columns = of_columns / (n - 1) - result.cells / m;
  return result;
}

PerPass best_split(const GradientVariance& variance, const PerPass& cost, const std::array<bool, 3>& kept,
                   double time) {
  // In the logarithms of the numbers the variance is convex and so is the time: one minimum, also over the
  // image's samples alone once the others are the best for them. Golden section.
  const auto with_image = [&](double log_share) {
    const double share = std::exp(log_share);
    return split_the_rest(variance, cost, kept, share * time / cost[0], (1 - share) * time);
  };
  const auto value = [&](double log_share) { return variance(with_image(log_share)); };
  constexpr double kGolden = 0.6180339887498949;
  double low = std::log(1e-9), high = std::log(1 - 1e-9);
  for (int i = 0; i < 100; ++i) {
    const double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    (value(a) < value(b) ? high : low) = value(a) < value(b) ? b : a;
  }
  return with_image(0.5 * (low + high));
}

std::array<int, kPasses> cheapest_split(const GradientVariance& variance, const PerPass& cost,
                                        const std::array<bool, 3>& kept, double wanted) {
  // More time, less variance: bisection in the logarithm.
  double low = 1e-12, high = 1;
  const double unit = total_cost(cost, {1, 1, 1, 1});
  while (variance(best_split(variance, cost, kept, high * unit)) > wanted) high *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = std::sqrt(low * high);
    (variance(best_split(variance, cost, kept, middle * unit)) > wanted ? low : high) = middle;
  }
  const PerPass best = best_split(variance, cost, kept, high * unit);

  // Rounded up it is good enough; then one sample less here, or here for one more there, as long as that
  // saves time.
  const auto least = [](int i) { return i == 0 ? 2.0 : 1.0; };  // images come in two halves
  PerPass chosen{};
  for (int i = 0; i < kPasses; ++i)
    if (i == 0 || kept[i - 1]) chosen[i] = std::max(least(i), std::ceil(best[i]));
  for (bool improved = true; improved;) {
    improved = false;
    const PerPass from = chosen;
    for (int less = 0; less < kPasses; ++less)
      for (int more = 0; more < kPasses; ++more) {
        PerPass n = from;
        if (!(n[less] > least(less)) || !(n[more] > 0)) continue;
        --n[less];
        if (more != less) ++n[more];
        if (variance(n) > wanted || !(total_cost(cost, n) < total_cost(cost, chosen))) continue;
        chosen = n;
        improved = true;
      }
  }
  std::array<int, kPasses> counts;
  for (int pass = 0; pass < kPasses; ++pass) counts[pass] = static_cast<int>(std::min(chosen[pass], 1e9));
  return counts;
}

}  // namespace isochron
