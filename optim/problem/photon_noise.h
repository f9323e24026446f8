// Photon noise of a target: what a detector that counts single photons would have seen.
#pragma once
#include "core/base/random.h"
#include "core/image/image.h"

namespace isochron {

/// A Poisson count of the given mean (>= 0, finite). Sequential inversion below a mean of 10, else
/// transformed rejection (Hoermann 1993, algorithm PTRS); both exact up to round-off.
double poisson(double mean, Rng& rng);

/// Replaces every entry by the count of its photons, in the image's unit. `photons` (> 0) is the mean count
/// of a pixel and channel in the brightest gate (the one of the largest GatedImage::mean): an entry v counts
/// Poisson(photons v / m) photons, m that largest mean, and becomes count m / photons. The mean of the result
/// is the image, the variance of an entry v m / photons. Every pixel, gate and channel has random numbers of
/// its own, from `stream`. Entries below zero become zero; a black image stays black.
void add_photon_noise(GatedImage& image, double photons, const Stream& stream);

/// Replaces every entry, an expected count, by a Poisson number of that mean, with random numbers as above. Entries below
/// zero become zero.
void draw_counts(GatedImage& image, const Stream& stream);

}  // namespace isochron
