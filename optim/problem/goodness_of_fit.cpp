#include "optim/problem/goodness_of_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/parallel.h"
#include "optim/problem/count_deviance.h"
#include "optim/problem/likely_backgrounds.h"

namespace isochron {
namespace {

/// One reading under a model.
struct Reading {
  double count, mean, light;  ///< light: the mean less the background
  double first, second;       ///< the halves' means
  int background;             ///< index of the unknown, -1: none
};

/// That a thread takes at a time.
constexpr std::size_t kPixelsTogether = 16;

double largest_entry(const GatedImage& image) {
  return image.data.empty() ? 0 : *std::max_element(image.data.begin(), image.data.end());
}

class Judge {
 public:
  Judge(const CountModel& model, const GatedImage& counts, const ReadingLoss& loss)
      : model_(model),
        counts_(counts),
        readings_(loss.readings),
        law_(loss.scale, 2 * largest_entry(model.image->image)) {
    project();
  }

  DevianceTest result() const {
    DevianceTest test;
    const Totals all = sum_over_pixels();
    const double n = readings_.count(counts_);
    test.degrees_of_freedom = n - unknowns_;
    test.floor = all.floor - taken_;
    test.deviance = all.floor + all.excess;
    const double left = std::max(1.0, test.degrees_of_freedom) / n;
    const double counted = std::max(0.0, all.counted) * left;
    test.spread = std::sqrt(counted + all.variance);
    test.image_share = all.variance > 0 ? all.variance / (counted + all.variance) : 0;
    const double skewness = test.spread > 0 ? left * all.third / std::pow(test.spread, 3) : 0;
    test.p_value = gamma_tail(all.excess - all.projected + taken_, 0, test.spread, skewness);
    return test;
  }

 private:
  struct Totals {
    double excess = 0, projected = 0, floor = 0;
    double counted = 0, third = 0;  ///< moments by the counts
    double variance = 0;            ///< by the image's noise

    void operator+=(const Totals& other) {
      excess += other.excess;
      projected += other.projected;
      floor += other.floor;
      counted += other.counted;
      third += other.third;
      variance += other.variance;
    }
  };

  /// The same for any number of threads.
  Totals sum_over_pixels() const {
    std::vector<Totals> parts(counts_.pixels());
    parallel_ranges(parts.size(), kPixelsTogether, [&](std::size_t begin, std::size_t end) {
      for (std::size_t pixel = begin; pixel < end; ++pixel) add(static_cast<int>(pixel), parts[pixel]);
    });
    Totals all;
    for (const Totals& part : parts) all += part;
    return all;
  }

  void add(int pixel, Totals& all) const {
    const double f = model_.image->first;
    double slopes = 0;  // of T by the image, times the halves' difference: gates of a pixel share their paths
    for_each(pixel, [&](const Reading& r) { add(r, f, all, slopes); });
    all.variance += f * (1 - f) * slopes * slopes;
  }

  void add(const Reading& r, double f, Totals& all, double& slopes) const {
    const DevianceMoments at = law_.moments(r.mean);
    const double floor1 = law_.moments(r.first).mean, floor2 = law_.moments(r.second).mean;
    const double h1 = h(r.first, floor1), h2 = h(r.second, floor2);
    const double e = projected(r, r.mean), slope = r.mean > 0 ? at.covariance / r.mean : 0;
    // q(N) - h(m) - (N - m) L(m), twice.
    const double q = r.count * law_.logarithm(r.count) - law_.linear(r.count);
    const double linear =
        (r.count - r.first) * law_.logarithm(r.second) + (r.count - r.second) * law_.logarithm(r.first);
    all.excess += 2 * (q - (2 * h(r.mean, at.mean) - f * h1 - (1 - f) * h2)) - linear;
    all.projected += ((r.count - r.first) * projected(r, r.second) + (r.count - r.second) * projected(r, r.first)) / 2;
    all.floor += 2 * at.mean - f * floor1 - (1 - f) * floor2;
    all.counted += at.variance - 2 * e * at.covariance + e * e * r.mean;
    all.third += at.third[0] - 3 * e * at.third[1] + 3 * e * e * at.third[2] - e * e * e * r.mean;
    const double d = r.first - r.second;
    slopes += (slope - e) * d;
    all.variance += 4 * r.mean * f * (1 - f) * std::pow(law_.weight(r.mean) * d, 2);
  }

  template <class F>
  void for_each(int pixel, F&& f) const {
    const double background = model_.background[pixel], share = model_.image->first;
    const int unknown = model_.background_unknown.empty() ? -1 : model_.background_unknown[pixel];
    for_each_reading(counts_, readings_, pixel, [&](std::size_t i) {
      const double m = std::max(0.0, model_.image->image.data[i]);
      const double d = model_.image->halved() ? model_.image->difference.data[i] : 0;
      f(Reading{counts_.data[i], m, std::max(0.0, m - background), std::max(0.0, m + (1 - share) * d),
                std::max(0.0, m - share * d), unknown});
    });
  }

  /// Weighted sums of 1 (a background's change), light and F', for each unknown background.
  struct Sums {
    double ones = 0, one_light = 0, one_slope = 0, information = 0;

    void operator+=(const Sums& other) {
      ones += other.ones;
      one_light += other.one_light;
      one_slope += other.one_slope;
      information += other.information;
    }
  };
  /// Those of the light, and of the background of a pixel, -1: none.
  struct PixelSums {
    double lights = 0, slope = 0, information = 0;
    int background = -1;
    Sums own;
  };

  PixelSums sums_of(int pixel) const {
    PixelSums sums;
    for_each(pixel, [&](const Reading& r) {
      if (!(r.mean > 0)) return;
      const DevianceMoments at = law_.moments(r.mean);
      const double weight = law_.weight(r.mean) * law_.weight(r.mean) * r.mean;
      const double slope = at.covariance * law_.weight(r.mean);
      sums.lights += weight * r.light * r.light;
      sums.slope += slope * r.light;
      sums.information += weight * r.light * r.light * at.information;
      if (r.background < 0 || !model_.background_free[r.background]) return;
      sums.background = r.background;
      sums.own += {weight, weight * r.light, slope, weight * at.information};
    });
    return sums;
  }

  /// The same for any number of threads.
  void project() {
    std::vector<PixelSums> parts(counts_.pixels());
    parallel_ranges(parts.size(), kPixelsTogether, [&](std::size_t begin, std::size_t end) {
      for (std::size_t pixel = begin; pixel < end; ++pixel) parts[pixel] = sums_of(static_cast<int>(pixel));
    });
    std::vector<Sums> sums;
    double lights = 0, light_slope = 0, light_information = 0;
    for (const PixelSums& part : parts) {
      lights += part.lights;
      light_slope += part.slope;
      light_information += part.information;
      if (part.background < 0) continue;
      if (std::ssize(sums) <= part.background) sums.resize(part.background + 1);
      sums[part.background] += part.own;
    }
    const double all_lights = lights;
    for (const Sums& own : sums)
      if (own.ones > 0) {
        lights -= own.one_light * own.one_light / own.ones;
        light_slope -= own.one_light * own.one_slope / own.ones;
        taken_ += own.information / own.ones;
        ++unknowns_;
      }
    constexpr double kRounding = 1e-12;  // where light is like the background nothing is left of it
    light_factor_ = lights > kRounding * all_lights ? light_slope / lights : 0;
    for (const Sums& own : sums)
      background_factor_.push_back(own.ones > 0 ? (own.one_slope - light_factor_ * own.one_light) / own.ones : 0);
    if (all_lights > 0) taken_ += model_.other_unknowns * light_information / all_lights;
    unknowns_ += model_.other_unknowns;
  }

  /// e of a reading whose mean is `mean`.
  double projected(const Reading& r, double mean) const {
    const double one =
        r.background < 0 || r.background >= std::ssize(background_factor_) ? 0 : background_factor_[r.background];
    return (one + light_factor_ * r.light) * law_.weight(mean);
  }
  /// `expected`: the mean deviance at m.
  double h(double m, double expected) const { return expected / 2 - law_.linear(m) + m * law_.logarithm(m); }

  const CountModel& model_;
  const GatedImage& counts_;
  const Readings& readings_;
  CountDeviance law_;
  std::vector<double> background_factor_;
  double light_factor_ = 0, taken_ = 0;  ///< taken: from the deviance by what was fitted
  double unknowns_ = 0;
};

DevianceTest test_background(CountModel model, const GatedImage& counts, const ReadingLoss& loss) {
  SplitImage image = *model.image;
  model.other_unknowns = 0;
  model.background_free.assign(model.background_free.size(), 1);
  image.difference.data.clear();
  for (int pixel = 0; pixel < counts.pixels(); ++pixel)
    for_each_reading(counts, loss.readings, pixel,
                     [&](std::size_t i) { image.image.data[i] = model.background[pixel]; });
  model.image = &image;
  take_likely_backgrounds(model, image, counts, loss);
  return test_deviance(model, counts, loss);
}

}  // namespace

bool are_whole_numbers(const GatedImage& counts, const Readings& readings) {
  bool whole = true;
  for (int pixel = 0; pixel < counts.pixels(); ++pixel)
    for_each_reading(counts, readings, pixel,
                     [&](std::size_t i) { whole &= counts.data[i] == std::floor(counts.data[i]); });
  return whole;
}

double gamma_tail(double value, double mean, double deviation, double skewness) {
  if (!(deviation > 0)) return value > mean ? 0 : 1;
  constexpr double kNormal = 1e-6;  // below, the cube root loses digits and gains nothing
  double z = (value - mean) / deviation;
  if (skewness > kNormal) {
    const double shape = 4 / (skewness * skewness), ratio = 1 + z / std::sqrt(shape);
    z = 3 * std::sqrt(shape) * (std::cbrt(std::max(0.0, ratio)) - 1 + 1 / (9 * shape));
  }
  return std::erfc(z / std::numbers::sqrt2) / 2;
}

DevianceTest test_deviance(const CountModel& model, const GatedImage& counts, const ReadingLoss& loss) {
  return Judge(model, counts, loss).result();
}

const char* name(FitVerdict verdict) {
  constexpr const char* kNames[] = {"explained", "unexplained", "no_signal"};
  return kNames[static_cast<int>(verdict)];
}

FitVerdict GoodnessOfFit::verdict() const {
  if (!has_light() && background.p_value >= kRejection) return FitVerdict::no_signal;
  return lost() || fit.is_rejected() ? FitVerdict::unexplained : FitVerdict::explained;
}

GoodnessOfFit judge_fit(const CountModel& model, const GatedImage& counts, const ReadingLoss& loss,
                        const std::optional<DevianceTest>& background) {
  GoodnessOfFit result;
  SplitImage image = *model.image;
  CountModel lit = model;
  lit.image = &image;
  take_likely_backgrounds(lit, image, counts, loss);
  result.fit = test_deviance(lit, counts, loss);
  result.background = background ? *background : test_background(model, counts, loss);
  const double k = std::max(1.0, model.other_unknowns);
  result.light_p_value =
      gamma_tail(result.background.deviance - result.fit.deviance, k, std::sqrt(2 * k), std::sqrt(8 / k));
  return result;
}

}  // namespace isochron
