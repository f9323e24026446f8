#pragma once
#include "core/image/image.h"
#include "optim/experiment.h"

namespace isochron {

/// rho(r) of one residual r = image - target: r^2 up to |r| = scale, beyond it growing more slowly.
///   huber: 2 scale |r| - scale^2 beyond;  cauchy: scale^2 ln(1 + (r / scale)^2) everywhere.
struct RobustLoss {
  LossKind kind = LossKind::squared;
  double scale = 0;  ///< in the image's unit, > 0 where kind is not squared

  double value(double residual) const;
  /// rho'(r) / (2 r), in (0, 1]: by how much less a residual pulls than a squared one.
  double weight(double residual) const;
};

/// Mean over pixels, gates and channels of rho(image - target). Images of one shape. NaN when a pixel is not
/// finite.
double mean_loss(const GatedImage& image, const GatedImage& target, const RobustLoss& rho = {});

/// d(mean_loss)/d(image). `image` must come from random numbers independent of those that estimate the
/// derivative it is multiplied with (theory, section 6).
GatedImage loss_adjoint(const GatedImage& image, const GatedImage& target, const RobustLoss& rho = {});

/// Over pixels, gates and channels.
double mean_square(const GatedImage& image);

/// Sum over all entries of a * b.
double inner_product(const GatedImage& a, const GatedImage& b);

}  // namespace isochron
