"""Colour scales and the choice of gates, which all pictures share."""

import numpy as np

PERCENTILE = 99.5  # of the non-zero values: the end of the colour scale; outliers must not darken the rest
NON_FINITE = "magenta"
NON_FINITE_RGB = (255, 0, 255)


def scale_of(*arrays):
    """End of the colour scale: a high percentile of the non-zero magnitudes."""
    values = np.abs(np.concatenate([a.ravel() for a in arrays]))
    values = values[np.isfinite(values) & (values > 0)]
    return float(np.percentile(values, PERCENTILE)) if values.size else 1.0


def srgb(x):
    """Display encoding of linear light in [0, 1]."""
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def spread(most, first, last):
    """At most so many numbers, evenly spread from first to last."""
    return sorted({int(round(g)) for g in np.linspace(first, last, min(most, last - first + 1))})


def spread_over(most, lit, count):
    """The same from the first to the last of the gates that are `lit`; of all `count` where none is."""
    return spread(most, lit[0], lit[-1]) if len(lit) else spread(most, 0, count - 1)


def pick_gates(most, *stacks, among=None):
    """At most so many gates, evenly spread from the first to the last in which anything exceeds a hundredth of the scale; or of
    those `among` which one has to choose."""
    if among is not None:
        return [among[i] for i in spread(most, 0, len(among) - 1)]
    count = len(stacks[0])
    if count <= most:
        return list(range(count))
    peaks = np.max([np.abs(np.nan_to_num(s)).reshape(count, -1).max(1) for s in stacks], axis=0)
    return spread_over(most, np.flatnonzero(peaks > 0.01 * scale_of(*stacks)), count)


def pick_by_peaks(most, *peaks):
    """As pick_gates, by the largest magnitude of each gate, read from the header; None where all gates can be read."""
    count = len(peaks[0])
    if count <= most:
        return None
    largest = np.max(peaks, axis=0)
    lit = np.flatnonzero(largest > 0.01 * np.percentile(largest[largest > 0], 90)) if largest.any() else []
    return spread_over(most, lit, count)
