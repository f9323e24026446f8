// Where backgrounds of a measurement begin: at the level of its dark bins. A point that counts ten thousand times what its
// neighbours do (a hot pixel) would else throw every other unknown off in the first step, as its residuals are weighted
// by the variance of the far smaller count that is expected there.
#pragma once
#include <vector>

#include "core/image/image.h"
#include "optim/experiment/experiment.h"
#include "optim/problem/readings.h"

namespace isochron {

/// Mean count per bin, of each set of pixels p, p + sets, p + 2 sets, ..., over its dark bins: those that count no more than
/// background alone would, but for one bin in a thousand. Found by leaving the others out again and again. Light that is as
/// faint as the background's noise counts in. NaN where none of the set's readings count.
std::vector<double> dark_levels(const GatedImage& counts, const Readings& readings, int sets);

/// Gives backgrounds per sensor point, and other backgrounds without initial value, those of the dark bins within their bounds. A
/// list of initial values stays; so does the single number of points whose readings do not count. `counts` is a null pointer
/// where the target is no measurement. Throws InputError where an initial value is missing.
void begin_at_dark_bins(std::vector<ParameterSpec>& parameters, const GatedImage* counts, const Readings& readings,
                        int sensor_points);

}  // namespace isochron
