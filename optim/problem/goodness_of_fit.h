// Whether a model of the counts explains them: the deviance beside what Poisson numbers of the model's means would have.
//
// Statistic. Deviance less its expectation, T = sum of D(m, N) - F(m) over the readings (count_deviance.h). At few counts F follows
// the mean, and T would mostly tell whether the scale of the light and the background are right; that a fit has chosen these itself
// makes T scatter less than it would for known means. So its part that is linear in the counts, sum of (N - m) F'(m), is projected,
// with the counts' weights, on what multiples of the light and of each unknown background change: sum of (N - m) e. At the maximum
// of the likelihood that is 0 whatever e; it is taken off, so that T is insensitive to these, and of its variance.
// Backgrounds. Unknown ones count with the values that are most likely beside the model's light (likely_backgrounds.h). A fit's own
// scatter about these with the noise of its images. Each deviation is small, but there are thousands.
// Unknowns. Each takes its leverage times m h''(m) from the deviance, summed over the readings: 1 where counts are many, less
// where they are few. That of a background lies on the readings of its points, in proportion to 1 / m, that of all else is taken to lie where
// light is, in proportion to light^2 / m. Unknowns at a bound take nothing. Noise of the image. The mean is rendered, in two independent halves.
// Their difference removes the bias from T: the nonlinear part h(m) becomes 2 h(m) - f h(m1) - (1 - f) h(m2), f being the first half's share of
// the samples, without bias to second order, and N - m of one half is multiplied by L of the other. To the variance both T's slopes times the
// halves' difference add. Where rare samples make most of a reading, halves are far apart and second order is not enough: what noise adds is
// then too small. So p-values hold where the noise makes a small part of the spread (image_share); more samples are rendered until it does.
// Probability. T is taken for a gamma variable of its first three moments (Wilson and Hilferty's cube root), which chi^2 is.
#pragma once
#include <optional>
#include <vector>

#include "optim/problem/loss.h"

namespace isochron {

/// A model of the counts.
struct CountModel {
  const SplitImage* image = nullptr;  ///< expected counts, halved
  std::vector<double> background;     ///< part of the image, one for each pixel
  /// Of each pixel: the unknown background that it has, from 0 on; -1: none. Empty: no background is unknown.
  std::vector<int> background_unknown;
  std::vector<char> background_free;  ///< of each unknown background: whether it is off its bounds
  /// Free ones besides the backgrounds. Of those that smoothing holds only what the data determine counts (determined_unknowns).
  double other_unknowns = 0;
};

/// Probability below which a model is rejected: of right ones, one in so many.
inline constexpr double kRejection = 0.01;
/// Above, a fit is rejected, too: of right ones, one in a million.
inline constexpr double kMostLikely = 1 - 1e-6;

struct DevianceTest {
  double deviance = 0;
  double floor = 0;               ///< its expectation if the counts are Poisson numbers of the model's means
  double degrees_of_freedom = 0;  ///< readings less free unknowns
  double spread = 0;              ///< standard deviation of deviance - floor, both noises included
  double p_value = 1;             ///< of a deviance as large as this or larger
  double image_share = 0;         ///< fraction of spread^2 that the image's noise makes

  /// The counts are nearer to the model than Poisson numbers are: they are none, or gain and background have not come to rest, and the
  /// correction for them hides the deviance.
  bool is_too_near() const { return p_value > kMostLikely; }
  bool is_rejected() const { return !(p_value >= kRejection) || is_too_near(); }
};

/// Whether the readings that count are whole numbers, as Poisson numbers are: scaled or corrected ones are no counts.
bool are_whole_numbers(const GatedImage& counts, const Readings& readings);

/// `loss` as Problem::reading_loss of Poisson counts makes it.
DevianceTest test_deviance(const CountModel& model, const GatedImage& counts, const ReadingLoss& loss);

enum class FitVerdict { explained, unexplained, no_signal };
const char* name(FitVerdict verdict);

struct GoodnessOfFit {
  DevianceTest fit;         ///< of the model's light, with those backgrounds that it makes most likely
  DevianceTest background;  ///< the same without light
  /// Of light that brings the deviance down as much as the fit's where there is none: chi^2 with as many degrees of freedom as
  /// there are unknowns besides the backgrounds.
  double light_p_value = 1;

  bool has_light() const { return light_p_value < kRejection; }
  /// no_signal: the fit's light is not significant, and background alone is not rejected.
  FitVerdict verdict() const;
  /// The counts hold more than background, and none of it is in the fit.
  bool lost() const { return !has_light() && background.p_value < kRejection; }
};

/// `background`: result of an earlier call with the same counts and backgrounds; it does not depend on the light.
GoodnessOfFit judge_fit(const CountModel& model, const GatedImage& counts, const ReadingLoss& loss,
                        const std::optional<DevianceTest>& background = std::nullopt);

/// Probability that a gamma variable of this mean, standard deviation and skewness (>= 0) exceeds `value`.
double gamma_tail(double value, double mean, double deviation, double skewness);

}  // namespace isochron
