#include "core/techniques/boundary_guide.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "core/base/random.h"

namespace isochron {
namespace {

/// Share of every histogram that stays unguided: no density falls below this fraction of the unguided one.
constexpr double kDefensiveShare = 0.25;
constexpr int kMostBins = 512;
/// A histogram has a bin for as many records as this, and fewer than these teach a tile nothing of its own.
constexpr int kRecordsPerBin = 4, kFewRecords = 32;
/// Effective sample size, (sum of squares s)^2 / (sum of s^2), at which the logarithm of a learned rate is shrunk half-way to
/// uniform.
constexpr double kHalfTrustSampleSize = 8;
/// How many times as often as without guiding a technique may be used.
constexpr double kMostRate = 8;

/// The density that minimises the variance is, in each bin, the root of the mean square of the contributions: given
/// equally many unguided samples, of their sum.
std::vector<double> histogram(const std::vector<GuideRecord>& records, int bins) {
  std::vector<double> p(bins, 0.0);
  for (const GuideRecord& r : records) p[std::min(static_cast<int>(r.x * bins), bins - 1)] += r.square;
  for (double& x : p) x = std::sqrt(x);
  const double sum = std::accumulate(p.begin(), p.end(), 0.0);
  for (double& x : p) x = sum > 0 ? x / sum : 1.0 / bins;
  return p;
}

int bins_for(std::size_t records) {
  return static_cast<int>(std::bit_floor(std::clamp<std::size_t>(records / kRecordsPerBin, 1, kMostBins)));
}

/// Repeats each bin so that there are `bins`, a multiple.
std::vector<double> refined(const std::vector<double>& p, int bins) {
  const int factor = bins / static_cast<int>(p.size());
  std::vector<double> fine(bins);
  for (int i = 0; i < bins; ++i) fine[i] = p[i / factor] / factor;
  return fine;
}

/// (1 - share) p + share q
std::vector<double> mix(const std::vector<double>& p, const std::vector<double>& q, double share) {
  const int bins = static_cast<int>(std::max(p.size(), q.size()));
  std::vector<double> result = refined(p, bins);
  const std::vector<double> other = refined(q, bins);
  for (int i = 0; i < bins; ++i) result[i] += share * (other[i] - result[i]);
  return result;
}

constexpr int kFromEdge = BoundaryGuide::table(Technique::from_edge),
              kFromCamera = BoundaryGuide::table(Technique::from_camera);

/// Second moments of contributions, of which searches from edges and from the camera share some: a contribution v of weight p to
/// one of them is v / (n_edge (1 - p) + n_camera p) under other rates, whichever finds it.
class Moments {
 public:
  Moments(const BoundaryGuide::Each<bool>& possible, const BoundaryGuide::Each<double>& cost)
      : possible_(possible), cost_(cost) {}

  void add(int technique, double square, double camera_part) {
    const int group = group_of(technique);
    const int bin =
        group == kFromCamera ? std::min(static_cast<int>(camera_part * kParts), kParts - 1) : kParts + technique;
    squares_[bin] += square;
    camera_squares_[bin] += square * camera_part;
    sum_[group] += square;
    sum_of_squares_[group] += square * square;
  }

  /// The rates, over those of the records, that make variance x cost least, at the cost of these. Each step multiplies by the root of
  /// what is gained per cost, and so never raises the variance.
  BoundaryGuide::Each<double> best_rates() const {
    BoundaryGuide::Each<double> rate;
    rate.fill(1);
    double cost = 0;
    for (const double c : cost_) cost += c;
    for (int step = 0; step < kSteps; ++step) {
      BoundaryGuide::Each<double> gain{};
      for (int bin = 0; bin < kParts + BoundaryGuide::kSearches; ++bin) {
        if (!(squares_[bin] > 0)) continue;
        if (bin >= kParts) {
          const int t = bin - kParts;
          gain[t] = squares_[bin] / (rate[t] * rate[t]);
          continue;
        }
        const double p = camera_squares_[bin] / squares_[bin];
        const double sum = (1 - p) * rate[kFromEdge] + p * rate[kFromCamera];
        gain[kFromEdge] += squares_[bin] * (1 - p) / (sum * sum);
        gain[kFromCamera] += squares_[bin] * p / (sum * sum);
      }
      BoundaryGuide::Each<double> wanted{};
      double wanted_cost = 0;
      for (int t = 0; t < BoundaryGuide::kSearches; ++t) {
        if (possible_[t] && cost_[t] > 0) wanted[t] = rate[t] * std::sqrt(gain[t] / cost_[t]);
        wanted_cost += wanted[t] * cost_[t];
      }
      if (!(wanted_cost > 0)) break;
      for (int t = 0; t < BoundaryGuide::kSearches; ++t) rate[t] = wanted[t] * cost / wanted_cost;
    }
    return rate;
  }

  /// How far these are to be believed, 0 to 1.
  double trust(int technique) const {
    const int group = group_of(technique);
    const double square = sum_[group] * sum_[group];
    return square > 0 ? square / (square + kHalfTrustSampleSize * sum_of_squares_[group]) : 1;
  }

 private:
  static constexpr int kParts = 32, kSteps = 64;
  static int group_of(int technique) { return technique == kFromEdge ? kFromCamera : technique; }

  const BoundaryGuide::Each<bool>& possible_;
  const BoundaryGuide::Each<double>& cost_;
  /// By part of the camera where it may have some, else by technique.
  std::array<double, kParts + BoundaryGuide::kSearches> squares_{}, camera_squares_{};
  BoundaryGuide::Each<double> sum_{}, sum_of_squares_{};  ///< by group
};

}  // namespace

Warp::Warp(const std::vector<double>& probability) {
  double sum = 0;
  below_.push_back(0);
  for (const double p : probability) below_.push_back(sum += p);
  for (double& x : below_) x /= sum;
}

double Warp::sample(double u) const {
  const auto above = std::upper_bound(below_.begin() + 1, below_.end() - 1, u);
  const int i = static_cast<int>(above - below_.begin()) - 1;
  const double x = (i + (u - below_[i]) / (below_[i + 1] - below_[i])) / bins();
  return std::clamp(x, 0x1p-53, 1 - 0x1p-53);
}

BoundaryGuide::BoundaryGuide(const Each<bool>& possible) : warps_(kTables) {
  const auto count = std::count(possible.begin(), possible.end(), true);
  for (int t = 0; t < kSearches; ++t) rate_[t] = possible[t] ? 1.0 / static_cast<double>(count) : 0;
}

BoundaryGuide::BoundaryGuide(const Each<bool>& possible, const std::vector<GuideRecord>& records,
                             const Each<double>& cost)
    : BoundaryGuide(possible) {
  std::vector<std::vector<GuideRecord>> of_table(kTables), of_technique(kSearches);
  for (const GuideRecord& r : records) {
    of_table[r.table].push_back(r);
    of_technique[std::min(r.table, kSearches - 1)].push_back(r);
  }
  const std::vector<double> uniform(1, 1.0);
  for (int table = 0; table < kTables; ++table) {
    const auto& all = of_technique[std::min(table, kSearches - 1)];
    const auto& own = of_table[table];
    const double trust = own.size() / (own.size() + static_cast<double>(kFewRecords));
    const double trust_all = all.size() / (all.size() + static_cast<double>(kFewRecords));
    const std::vector<double> learned =
        mix(histogram(all, bins_for(all.size())), histogram(own, bins_for(own.size())), trust);
    warps_[table] = Warp(mix(uniform, learned, trust_all * (1 - kDefensiveShare)));
  }

  // For a given total cost the variance is least where, per cost, a little more of any technique lowers it alike.
  Moments moments(possible, cost);
  for (const GuideRecord& r : records) {
    const int technique = std::min(r.table, kSearches - 1);
    if (technique != kFromEdge && technique != kFromCamera) {
      moments.add(technique, r.square / warps_[r.table].density(r.x), 0);
      continue;
    }
    // Both draw x, from histograms of their own.
    const double edge = (1 - r.camera_part) * warps_[kFromEdge].density(r.x),
                 camera = r.camera_part * warps_[std::max(r.table, kFromCamera)].density(r.x);
    moments.add(technique, r.square / (edge + camera), camera / (edge + camera));
  }
  const Each<double> best = moments.best_rates();
  for (int t = 0; t < kSearches; ++t)
    rate_[t] *= std::pow(std::clamp(best[t], 1 / kMostRate, kMostRate), moments.trust(t));
}

void GuideSink::note_guide(int table, double x) {
  square_sums();
  if (square_ > 0) records.push_back({table, x, square_, std::clamp(part_of_square_ / square_, 0.0, 1.0)});
  square_ = part_of_square_ = camera_part_ = 0;
  ++sample_;
}

void GuideSink::bind(const LocalDifferential& differential) {
  rate_ = 0;
  differential.for_each(layout_, [&](int dof, int, double log_f, double) {
    for (int i = basis_.row_begin[dof]; i < basis_.row_begin[dof + 1]; ++i)
      rate_ += column_sign(basis_.entries[i].column) * log_f * basis_.entries[i].coefficient;
  });
}

void GuideSink::add(int pixel, const Rgb& value, double length, GateUse) {
  if (pixel != pixel_) square_sums();
  pixel_ = pixel;
  part_of_sums_ = std::isfinite(camera_part_) ? camera_part_ : 0;
  gates_.for_each_value(length, [&](int gate, double w) {
    sums_[gate] += value * (w * rate_);
    touched_.push_back(gate);
  });
}

/// The square of a sum of columns with random signs is, on average, the sum of their squares.
double GuideSink::column_sign(int column) const {
  if (basis_.columns == 1) return 1;
  const auto bits = philox({static_cast<std::uint32_t>(column) / 32, sample_, 0, 0}, {0x7369676eu, 0});
  return bits[0] >> (column % 32) & 1 ? 1 : -1;
}

void GuideSink::square_sums() {
  const double before = square_;
  for (const int gate : touched_) {
    const Rgb& sum = sums_[gate];
    square_ += sum.r * sum.r + sum.g * sum.g + sum.b * sum.b;
    sums_[gate] = Rgb();
  }
  part_of_square_ += part_of_sums_ * (square_ - before);
  touched_.clear();
}

}  // namespace isochron
