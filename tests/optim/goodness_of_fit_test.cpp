// Whether counts are explained: moments of the deviance, p-values of right, wrong and dark models.
#include "optim/problem/goodness_of_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/parallel.h"
#include "optim/problem/count_deviance.h"
#include "optim/problem/likely_backgrounds.h"
#include "optim/problem/photon_noise.h"
#include "tests/seed.h"

namespace isochron {
namespace {

constexpr int kFitPixels = 30, kGates = 40;

ReadingLoss loss_of_counts() {
  return {LossKind::poisson, 0.01};
}

/// Gain times a bump over the gates, plus a background: counts from 0.3 to a few. Halves of the image scatter by 2 %.
class Fit {
 public:
  double gain = 1.5, background = 0.3;
  double late = 0;   ///< of the bump, in gates
  double wrong = 0;  ///< what the truth has besides: a second bump of this height
  double scatter = 0.02;

  Fit() : counts_(kFitPixels, 1, kGates, 1) {}

  void draw(std::uint32_t number) {
    for (int p = 0; p < kFitPixels; ++p)
      for (int g = 0; g < kGates; ++g)
        counts_.at(p, g, 0) = background + gain * bump(p, g - late) + wrong * bump(p, g - 15);
    draw_counts(counts_, {test_seed(90), number, 0});
  }

  /// The means themselves, but for rounding.
  void round() {
    for (int p = 0; p < kFitPixels; ++p)
      for (int g = 0; g < kGates; ++g) counts_.at(p, g, 0) = std::round(background + gain * bump(p, g));
  }

  /// Finds gain and background by Newton's method: of the likelihood's maximum, whose Hessian is J' diag(N / m^2) J.
  void maximise() {
    late = 0;
    for (int i = 0; i < 30; ++i) {
      double slope[2] = {}, hessian[3] = {};
      for (int p = 0; p < kFitPixels; ++p)
        for (int g = 0; g < kGates; ++g) {
          const double b = bump(p, g), m = background + gain * b, n = counts_.at(p, g, 0);
          slope[0] += (1 - n / m) * b;
          slope[1] += 1 - n / m;
          hessian[0] += n * b * b / (m * m);
          hessian[1] += n * b / (m * m);
          hessian[2] += n / (m * m);
        }
      const double det = hessian[0] * hessian[2] - hessian[1] * hessian[1];
      gain = std::max(0.0, gain - (hessian[2] * slope[0] - hessian[1] * slope[1]) / det);
      background = std::max(1e-3, background - (hessian[0] * slope[1] - hessian[1] * slope[0]) / det);
    }
  }

  GoodnessOfFit judge(std::uint32_t number, const std::optional<DevianceTest>& dark = std::nullopt) const {
    GatedImage halves[] = {counts_, counts_};
    for (int h : {0, 1})
      for (int p = 0; p < kFitPixels; ++p)
        for (int g = 0; g < kGates; ++g) {
          Rng rng({test_seed(91), number, 0}, p * kGates + g, h);
          halves[h].at(p, g, 0) =
              background + gain * bump(p, g) * (1 + scatter * std::sqrt(24) * (rng.uniform() - 0.5));
        }
    const SplitImage image = join_halves(halves[0], 1, halves[1], 1);
    const CountModel model{
        &image, std::vector<double>(kFitPixels, background), std::vector<int>(kFitPixels, 0), {1}, 1};
    return judge_fit(model, counts_, loss_of_counts(), dark);
  }

  const GatedImage& counts() const { return counts_; }

 private:
  static double bump(int pixel, double gate) {
    const double x = (gate - 10 - 0.5 * pixel) / 3;
    return std::exp(-x * x / 2);
  }
  GatedImage counts_;
};

// Means, variances and covariances of 20 000 draws, each within 5 of its standard errors: falsely alarmed once in 100 000.
TEST(CountDeviance, MomentsAreThoseOfDraws) {
  const CountDeviance law(0.01, 100);
  for (double mean : {0.05, 0.4, 1.4, 6.0, 60.0}) {
    constexpr int kDraws = 20000;
    const DevianceMoments at = law.moments(mean);
    double sums[3] = {}, squares[3] = {};
    for (int i = 0; i < kDraws; ++i) {
      Rng rng({test_seed(92), 0, 0}, i, 0);
      const double n = poisson(mean, rng), d = 2 * loss_of_counts().value(mean, n);
      EXPECT_NEAR(law.deviance(mean, n), d, 1e-9 * (1 + d));
      const double e = d - at.mean, values[3] = {e, e * e - at.variance, e * (n - mean) - at.covariance};
      for (int k = 0; k < 3; ++k) {
        sums[k] += values[k];
        squares[k] += values[k] * values[k];
      }
    }
    for (int k = 0; k < 3; ++k) EXPECT_LT(std::abs(sums[k]), 5 * std::sqrt(squares[k])) << mean << " " << k;
    const double h = 1e-2 * mean;  // covariance = m F'
    EXPECT_NEAR(at.covariance, mean * (law.exact_moments(mean + h).mean - law.exact_moments(mean - h).mean) / (2 * h),
                2e-3 * (1 + std::abs(at.covariance)));
    EXPECT_NEAR(at.mean, law.exact_moments(mean).mean, 2e-5);
  }
  EXPECT_NEAR(law.exact_moments(1e4 * 0.99).mean, law.moments(1e4 * 1.01).mean, 1e-5);
}

TEST(GammaTail, IsThatOfChiSquared) {
  // Of 2 degrees of freedom exp(-x / 2); the normal law would say 4e-5 for the last. Wilson and Hilferty's root is good to some %.
  for (double x : {1.0, 3.0, 10.0}) EXPECT_NEAR(gamma_tail(x, 2, 2, 2), std::exp(-x / 2), 0.06 * std::exp(-x / 2)) << x;
  EXPECT_NEAR(gamma_tail(1.96, 0, 1, 0), 0.025, 1e-4);
}

// p-values of fitted models, the noise of images included, are uniform: the distance between their distribution and that by
// Kolmogorov and Smirnov exceeds 0.230 with 50 draws once in a hundred times, 0.275 once in 1000.
TEST(GoodnessOfFit, ProbabilitiesOfRightModelsAreUniform) {
  constexpr int kDraws = 50;
  // Of few counts the deviance says mostly what the fit has chosen itself: scale and background.
  for (const auto& [gain, background] : {std::pair{1.5, 0.3}, {0.3, 0.04}}) {
    std::vector<double> p;
    for (std::uint32_t i = 0; i < kDraws; ++i) {
      Fit fit;
      fit.gain = gain;
      fit.background = background;
      fit.draw(i);
      fit.maximise();
      fit.background *= i % 2 ? 1.3 : 0.8;  // those most likely count: it does not matter where a fit has left them
      const GoodnessOfFit found = fit.judge(i);
      p.push_back(found.fit.p_value);
      EXPECT_TRUE(found.has_light());
      EXPECT_EQ(found.fit.degrees_of_freedom, kFitPixels * kGates - 2);
    }
    std::sort(p.begin(), p.end());
    double distance = 0;
    for (int i = 0; i < kDraws; ++i)
      distance = std::max({distance, p[i] - double(i) / kDraws, double(i + 1) / kDraws - p[i]});
    EXPECT_LT(distance, 0.275) << gain;
  }
}

// Halves of the image scatter by a quarter of their light. What they find differs from what the light without noise finds by less than
// 4.5 standard errors of 20 draws of 28 pixels (false alarms: 7e-6), which are below 0.01: weights by a half's own mean are off by 0.07. A
// point without counts has no background, one that is masked keeps its own.
TEST(LikelyBackgrounds, NoiseOfImagesLeavesNoBias) {
  constexpr double kLight = 1.5, kBackground = 0.5;
  const ReadingLoss loss = [] {
    ReadingLoss all = loss_of_counts();
    all.readings.pixel.assign(kFitPixels, 1);
    all.readings.pixel[1] = 0;
    return all;
  }();
  CountModel start{nullptr, std::vector<double>(kFitPixels, 0.1), std::vector<int>(kFitPixels),
                   std::vector<char>(kFitPixels, 1), 1};
  for (int p = 0; p < kFitPixels; ++p) start.background_unknown[p] = p;
  double sum = 0, squares = 0;
  int count = 0;
  for (std::uint32_t draw = 0; draw < 20; ++draw) {
    GatedImage counts(kFitPixels, 1, kGates, 1), exact = counts, halves[] = {counts, counts};
    counts.data.assign(counts.data.size(), kLight + kBackground);
    draw_counts(counts, {test_seed(93), draw, 0});
    for (int g = 0; g < kGates; ++g) counts.at(0, g) = 0;
    for (std::size_t i = 0; i < counts.data.size(); ++i) {
      Rng rng({test_seed(94), draw, 0}, static_cast<int>(i), 0);
      for (GatedImage& half : halves)
        half.data[i] = 0.1 + kLight * (1 + 0.25 * std::sqrt(12.0) * (rng.uniform() - 0.5));
      exact.data[i] = 0.1 + kLight;
    }
    CountModel found = start, wanted = start;
    SplitImage image = join_halves(halves[0], 1, halves[1], 1), without{exact, {}, 0.5};
    take_likely_backgrounds(found, image, counts, loss);
    take_likely_backgrounds(wanted, without, counts, loss);
    EXPECT_EQ(found.background[0], 0);
    EXPECT_FALSE(found.background_free[0]);
    EXPECT_EQ(found.background[1], 0.1);
    EXPECT_NEAR(image.image.at(2, 0), (halves[0].at(2, 0) + halves[1].at(2, 0)) / 2 + found.background[2] - 0.1, 1e-12);
    for (int p = 2; p < kFitPixels; ++p, ++count) {
      const double off = found.background[p] - wanted.background[p];
      sum += off;
      squares += off * off;
    }
  }
  const double mean = sum / count, error = std::sqrt(squares / count - mean * mean) / std::sqrt(count);
  EXPECT_LT(std::abs(mean), 4.5 * error);
  EXPECT_LT(4.5 * error, 0.01);
}

// Readings of one mean m, whose deviance varies by 2 where counts are many. Halves that are d sqrt(m) apart put d (N - m) / sqrt(m)
// into each, which varies by d^2; what is linear in the image the background takes.
TEST(GoodnessOfFit, SaysHowMuchOfTheSpreadIsTheImages) {
  constexpr double kMean = 1e5;
  GatedImage counts(kFitPixels, 1, kGates, 1), halves[] = {counts, counts};
  counts.data.assign(counts.data.size(), kMean);
  const auto share = [&](double d) {
    for (std::size_t i = 0; i < counts.data.size(); ++i) {
      const double apart = (i % 2 ? d : -d) * std::sqrt(kMean);
      halves[0].data[i] = kMean + apart / 2;
      halves[1].data[i] = kMean - apart / 2;
    }
    const SplitImage image = join_halves(halves[0], 1, halves[1], 1);
    const CountModel model{&image, std::vector<double>(kFitPixels, kMean), std::vector<int>(kFitPixels, 0), {1}, 0};
    return test_deviance(model, counts, loss_of_counts()).image_share;
  };
  EXPECT_EQ(share(0), 0);
  for (const double d : {0.1, 1.0, 3.0}) EXPECT_NEAR(share(d), d * d / (2 + d * d), 1e-2 * share(d)) << d;
}

TEST(GoodnessOfFit, TellsWhatIsLeft) {
  Fit fit;
  fit.wrong = 3;
  fit.draw(1000);
  fit.maximise();
  GoodnessOfFit found = fit.judge(1000);
  EXPECT_EQ(found.verdict(), FitVerdict::unexplained);
  EXPECT_LT(found.fit.p_value, 1e-6);
  EXPECT_FALSE(found.lost());
}

// The same bits for any number of threads, and with the test of background from another image.
TEST(GoodnessOfFit, DependsOnNoThreads) {
  Fit fit;
  fit.draw(1003);
  fit.maximise();
  set_thread_count(1);
  const GoodnessOfFit alone = fit.judge(1003);
  set_thread_count(4);
  const GoodnessOfFit together = fit.judge(1003), later = fit.judge(1003, fit.judge(1004).background);
  set_thread_count(0);
  for (const GoodnessOfFit& other : {together, later}) {
    EXPECT_EQ(other.fit.deviance, alone.fit.deviance);
    EXPECT_EQ(other.fit.spread, alone.fit.spread);
    EXPECT_EQ(other.fit.p_value, alone.fit.p_value);
    EXPECT_NEAR(other.light_p_value, alone.light_p_value, 1e-9);
    EXPECT_EQ(other.verdict(), alone.verdict());
  }
}

// Rounded means in place of draws: their deviance is far below that of Poisson numbers.
TEST(GoodnessOfFit, CountsThatScatterTooLittleAreNotExplained) {
  Fit fit;
  fit.gain = 150;
  fit.background = 30;
  fit.draw(1002);
  fit.round();
  const GoodnessOfFit found = fit.judge(1002);
  EXPECT_GT(found.fit.p_value, kMostLikely);
  EXPECT_EQ(found.verdict(), FitVerdict::unexplained);
}

// Counts of light that comes 12 gates late, of which a fit has taken all for background.
TEST(GoodnessOfFit, KnowsAFitThatHasLostItsLight) {
  Fit fit;
  fit.late = 12;
  fit.draw(1001);
  fit.background = 0.3 + 1.5 * 3 * std::sqrt(2 * 3.14159) / kGates;
  fit.gain = 1e-6;
  const GoodnessOfFit found = fit.judge(1001);
  EXPECT_TRUE(found.lost());
  EXPECT_EQ(found.verdict(), FitVerdict::unexplained);
}

// 40 draws of nothing but background: none is lost, and no more than four have a signal or are rejected, of which one in a
// hundred does and has: five come once in 10 000 times.
TEST(GoodnessOfFit, NoSignalIsNoLight) {
  int others = 0;
  for (std::uint32_t i = 0; i < 40; ++i) {
    Fit fit;
    fit.gain = 0;
    fit.draw(2000 + i);
    fit.gain = 0.1;
    fit.maximise();
    others += fit.judge(i).verdict() != FitVerdict::no_signal;
  }
  EXPECT_LE(others, 4);
}

TEST(GoodnessOfFit, IsOfWholeNumbersAlone) {
  GatedImage image(2, 1, 1, 1);
  image.data = {3, 0.5};
  EXPECT_FALSE(are_whole_numbers(image, {}));
  EXPECT_TRUE(are_whole_numbers(image, {{1, 0}, {}}));
}

}  // namespace
}  // namespace isochron
