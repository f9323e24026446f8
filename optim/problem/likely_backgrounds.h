// The backgrounds that make counts most likely beside a given light.
#pragma once
#include "optim/problem/goodness_of_fit.h"

namespace isochron {

/// Gives each unknown background of the model that is off its bounds the value, not below zero, at which the sum of (N - m) / V(m) over
/// its readings vanishes (loss.h: V is the mean m above the loss's scale). Either half of `image` gets a background of its own, with the
/// other half's V, as noise that weighs itself would make it too large; so what the noise of images does to backgrounds is in the halves'
/// difference. One that comes to zero is no longer free. Changes the model and `image` alike.
void take_likely_backgrounds(CountModel& model, SplitImage& image, const GatedImage& counts, const ReadingLoss& loss);

}  // namespace isochron
