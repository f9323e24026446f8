// What tells a surface from noise, and from what light of other surfaces adds up to.
#pragma once
#include <vector>

namespace isochron {

/// The number of standard deviations above which a normal variable lies with that probability, in (0, 0.5).
double normal_quantile_above(double probability);

/// The value from which on a voxel is more likely a surface's than not. The filter has no mean, so that light of surfaces
/// elsewhere, which comes in time by chance, adds up to either sign alike, while a surface's sum is positive. So above t there are
/// as many of others' light as there are below -t: the threshold is the t that makes the right ones less the wrong ones, (positive -
/// negative) - negative, most. `values`: those of significant voxels, of either sign, in any order. Zero where none is positive.
double surface_threshold(std::vector<float> values);

}  // namespace isochron
