#pragma once
#include "core/image/image.h"

namespace isochron {

/// Mean over pixels, gates and channels of (image - target)^2. Images of one shape. NaN when a pixel is not
/// finite.
double mean_squared_error(const GatedImage& image, const GatedImage& target);

/// d(mean_squared_error)/d(image): 2 (image - target) / N. `image` must come from random numbers independent
/// of those that estimate the derivative it is multiplied with (theory, section 6).
GatedImage loss_adjoint(const GatedImage& image, const GatedImage& target);

/// Root of the mean square over pixels, gates and channels.
double root_mean_square(const GatedImage& image);

/// Sum over all entries of a * b.
double inner_product(const GatedImage& a, const GatedImage& b);

}  // namespace isochron
