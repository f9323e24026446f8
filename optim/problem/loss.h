// The loss of noisy images. The mean of (I - T)^2 contains the variance of I, which grows with whatever makes the
// image brighter: its minimum is too dark. So an image comes in two halves I1 and I2 of its samples, independent of
// each other, and the squared loss is the mean of (I1 - T)(I2 - T), whose expectation is that of noiseless images. It
// can come out negative where noise is all that is left of the residual.
//
// With I the mean of both, D = I1 - I2 and v = D^2 / 4, an estimate of the variance of I, that product is
// (I - T)^2 - v. For a robust rho the same is done to first order in v: rho(I - T) - rho''(I - T) v / 2, and for the
// slope rho' - rho''' v / 2. Bias that is left, for normal noise of variance v:
//   squared  none;
//   cauchy   -rho'''' v^2 / 8, at most 1.5 v^2 / scale^2, where the plain mean of rho has up to v;
//   huber    at most 0.1 v, and that only where a residual lies within two standard deviations of the scale; inside
//            of it positive, outside negative, so that it cancels where residuals spread across.
// Weighting the product of the residuals, by rho(r1) / r1^2 say, would have a bias of first order: -2 v at huber's
// scale. For noise far above the scale no expansion holds and a bias towards dark is left.
//
// Counts N of mean mu: half the deviance, mu - N ln mu - (N - N ln N), 0 where mu = N, the negative logarithm of the
// likelihood but for a constant. About 1/2 per reading is left of a perfect model where counts are many, less below one.
// Its slope is (mu - N) / V(mu) with the variance V(mu) = mu. An image of a few samples can hold a zero where photons were
// counted, which no likelihood forgives: below a `scale` of 2 % of a typical pixel's mean count, V stays what it is there, and
// the loss is the integral of (m - N) / V(m) from N to mu, finite for any mu.
// The mean of (I - N) / V(I) is not 0 where that of I is N, as the same noise makes both; so the residual of one half is
// divided by the V of the other: (I1 - N) / V(I2) and (I2 - N) / V(I1), weighted by the halves' samples. Whatever V, the
// mean of that is 0 where the means are right: the stationary point has no bias, however noisy the image, and neither has
// it one from counts, which weigh nothing. Where both halves and the count are zero it is 0, not the slope 1 of a
// likelihood at its end: that would be a push towards dark wherever samples are few. The value is corrected to first order
// in v like that of a robust loss.
#pragma once
#include "core/image/image.h"
#include "optim/experiment/experiment.h"
#include "optim/problem/readings.h"

namespace isochron {

/// What one reading's loss is, a function of its mean in the image and of its value in the target; r = image - target.
///   squared: r^2;  huber: 2 scale |r| - scale^2 beyond |r| = scale;  cauchy: scale^2 ln(1 + (r / scale)^2);
///   poisson: half the deviance of a count, see above, with V(image) = max(image, scale).
struct ReadingLoss {
  LossKind kind = LossKind::squared;
  double scale = 0;  ///< in the image's unit, > 0 where kind is not squared
  Readings readings = {};

  double value(double image, double target = 0) const;
  /// Its slope over 2 r, > 0. For a robust loss, where it is at most 1: by how much less a residual pulls than a squared
  /// one. Twice that is the curvature that Gauss-Newton takes.
  double weight(double image, double target = 0) const;
  /// Second and third derivative; the jumps of the second at the scale count for nothing.
  double second(double image, double target = 0) const;
  double third(double image, double target = 0) const;
};

/// Gated images and what two independent halves of their samples disagree in.
struct SplitImage {
  GatedImage image;       ///< mean of all samples
  GatedImage difference;  ///< mean of the first half minus that of the second; empty where there is a single sample
  double first = 0.5;     ///< the first half's fraction of the samples; above 1/2 where their number is odd
  bool halved() const { return !difference.data.empty(); }
};

/// Images `first` and `second` of independent random numbers, with so many samples.
SplitImage join_halves(GatedImage first, int first_samples, GatedImage second, int second_samples);

/// Estimates of a loss from one image.
struct LossEstimate {
  double value = 0;               ///< mean over the readings that count
  double noise = 0;               ///< its standard error
  double mean_squared_error = 0;  ///< of the image, without bias; can be negative
  double mean_squared_error_noise = 0;
};

/// Of images of one shape. All NaN when a reading that counts is not finite, or where the image has a single sample and thus no
/// halves. Standard errors take the values of one pixel for correlated, as the gates of one path are, and pixels for
/// independent. The variance of the sum over a pixel is on average the square of its sum of e = rho'(I - T) D / 2, for
/// normal noise of any correlation; few bright samples make that too large. The scatter of the sums over pixels
/// bounds it, too, being too large by how much the residuals differ between pixels: the smaller of both is taken.
/// Stated over true: 0.71 to 1.13 at the start and the target of seven scenes, but 2.4 once, where the random numbers of an
/// image are spread over it, so that errors of pixels cancel, which this does not see.
LossEstimate estimate_loss(const SplitImage& image, const GatedImage& target, const ReadingLoss& rho = {});

/// d(loss)/d(image), an estimate without the bias of the residual's noise (as above). `image` must come from random
/// numbers independent of those that estimate the derivative it is multiplied with. Zero where a reading does not count.
GatedImage loss_adjoint(const SplitImage& image, const GatedImage& target, const ReadingLoss& rho = {});

/// The same from an image without halves: for the squared loss unbiased, too, for robust ones biased by rho''' v / 2. Not for
/// poisson.
GatedImage loss_adjoint(const GatedImage& image, const GatedImage& target, const ReadingLoss& rho = {});

/// What Gauss-Newton takes for the second derivative of the loss by each value of the image: that of a robust rho without
/// rho'', of a Poisson likelihood without what has zero mean. Zero where a reading does not count.
std::vector<double> curvature_weights(const GatedImage& image, const GatedImage& target, const ReadingLoss& rho);

/// Root of a mean squared error, 0 where its estimate is not above 0: the images agree within the noise.
double root_mean_square_error(double mean_squared_error);

/// Over the readings that count.
double mean_square(const GatedImage& image, const Readings& readings = {});
/// The median, over the pixels that hold anything, of a pixel's mean of |value|^power, power 1 or 2: what half of all pixels, however
/// hot, do not move. 0 of a black image.
double typical_power(const GatedImage& image, const Readings& readings, int power);

/// Sum over all entries of a * b.
double inner_product(const GatedImage& a, const GatedImage& b);

}  // namespace isochron
