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
#pragma once
#include "core/image/image.h"
#include "optim/experiment/experiment.h"

namespace isochron {

/// rho(r) of one residual r = image - target: r^2 up to |r| = scale, beyond it growing more slowly.
///   huber: 2 scale |r| - scale^2 beyond;  cauchy: scale^2 ln(1 + (r / scale)^2) everywhere.
struct RobustLoss {
  LossKind kind = LossKind::squared;
  double scale = 0;  ///< in the image's unit, > 0 where kind is not squared

  double value(double residual) const;
  /// rho'(r) / (2 r), in (0, 1]: by how much less a residual pulls than a squared one.
  double weight(double residual) const;
  /// rho''(r) and rho'''(r); huber's jump of rho'' at the scale counts for nothing.
  double second(double residual) const;
  double third(double residual) const;
};

/// Gated images and what two independent halves of their samples disagree in.
struct SplitImage {
  GatedImage image;       ///< mean of all samples
  GatedImage difference;  ///< mean of the first half minus that of the second; empty where there is a single sample
  double first = 0.5;     ///< the first half's fraction of the samples; above 1/2 where their number is odd
  bool halved() const { return !difference.data.empty(); }
};

/// Images `first` and `second` of independent random numbers, with so many samples.
SplitImage join_halves(const GatedImage& first, int first_samples, const GatedImage& second, int second_samples);

/// Estimates of a loss from one image.
struct LossEstimate {
  double value = 0;               ///< mean over pixels, gates and channels
  double noise = 0;               ///< its standard error
  double mean_squared_error = 0;  ///< of the image, without bias; can be negative
  double mean_squared_error_noise = 0;
};

/// Of images of one shape. All NaN when a pixel is not finite, or where the image has a single sample and thus no
/// halves. Standard errors take the values of one pixel for correlated, as the gates of one path are, and pixels for
/// independent. The variance of the sum over a pixel is on average the square of its sum of e = rho'(I - T) D / 2, for
/// normal noise of whatever correlation; few bright samples make that too large. The scatter of the sums over pixels
/// bounds it, too, being too large by how much the residuals differ between pixels: the smaller of both is taken.
/// Stated over true: 0.71 to 1.13 at the start and the target of seven scenes, but 2.4 once, where the random numbers of an
/// image are spread over it, so that errors of pixels cancel, which this does not see.
LossEstimate estimate_loss(const SplitImage& image, const GatedImage& target, const RobustLoss& rho = {});

/// d(loss)/d(image), an estimate without the bias of the residual's noise (as above). `image` must come from random
/// numbers independent of those that estimate the derivative it is multiplied with.
GatedImage loss_adjoint(const SplitImage& image, const GatedImage& target, const RobustLoss& rho = {});

/// The same from an image without halves: for the squared loss unbiased, too, for others biased by rho''' v / 2.
GatedImage loss_adjoint(const GatedImage& image, const GatedImage& target, const RobustLoss& rho = {});

/// Root of a mean squared error, 0 where its estimate is not above 0: the images agree within the noise.
double root_mean_square_error(double mean_squared_error);

/// Over pixels, gates and channels.
double mean_square(const GatedImage& image);

/// Sum over all entries of a * b.
double inner_product(const GatedImage& a, const GatedImage& b);

}  // namespace isochron
