"""Points of a capture that measure nothing, and points that count far more than the others without light."""

import dataclasses
import math

import numpy as np
import scipy.stats

FALSE_ALARM = 1e-3  # that a capture without a faulty point is said to have one
MEDIAN_BELOW, MEDIAN_ABOVE = math.log(2), 1 / 3  # the mean of Poisson numbers, at most
DARKEST = 16  # the part of the time, one of so many, in which points are compared


@dataclasses.dataclass
class Faults:
    """Sensor points [Sx, Sy]."""

    not_finite: np.ndarray
    negative: np.ndarray
    silent: np.ndarray
    hot: np.ndarray
    dark_counts: np.ndarray
    """In the darkest part of the time"""
    dark_median: float
    """Of those that are not dead"""

    @property
    def dead(self):
        return self.not_finite | self.negative | self.silent


def _law(mean, variance):
    """Poisson counts whose expectations differ from point to point by a gamma law, so that they have this mean and variance."""
    if variance <= mean * (1 + 1e-9) or mean <= 0:
        return scipy.stats.poisson(mean)
    return scipy.stats.nbinom(mean**2 / (variance - mean), mean / variance)


def _robust_law(counts, beyond_median):
    """Of whole numbers, most of which follow one law, with a mean that is so much greater than their median. The distance of the
    quartiles loses less than one by rounding: the law is rather too wide than too narrow."""
    first, median, third = np.percentile(counts, [25, 50, 75])
    quartiles_apart = 2 * scipy.stats.norm.ppf(0.75)  # of a standard normal law
    return _law(max(median + beyond_median, 0), ((third - first + 1) / quartiles_apart) ** 2)


def find(counts, keep_negative):
    """Faults of counts [T, ..., Sx, Sy]. Silent points count nothing, hot ones so much in the darkest bins that among as many
    points without fault this would happen in one capture of 1/FALSE_ALARM, if their expectations follow a gamma law of the
    spread that the quartiles show. Both are looked for among whole numbers; of others, silent is what is all zero."""
    over = tuple(range(counts.ndim - 2))
    not_finite = ~np.isfinite(counts).all(axis=over)
    negative = np.zeros_like(not_finite) if keep_negative else (counts < 0).any(axis=over)
    silent, hot = (counts == 0).all(axis=over), np.zeros_like(not_finite)
    good = ~(not_finite | negative | silent)
    dark = np.zeros(good.shape)
    if not good.any() or (silent.any() and not (counts[..., good] != 0).any()):
        return Faults(not_finite, negative, np.zeros_like(hot), hot, dark, 0.0)
    times = np.median(counts[..., good].reshape(len(counts), -1), axis=1)
    if len(times) >= DARKEST:
        darkest = np.argsort(times, kind="stable")[: max(1, len(times) // DARKEST)]
    else:
        darkest = np.arange(len(times))
    dark = np.where(good, counts[darkest].sum(axis=over, dtype=float), 0.0)
    whole = bool(good.sum() >= 4 and (counts[..., good] == np.rint(counts[..., good])).all() and (counts[..., good] >= 0).all())
    if whole:
        rate = FALSE_ALARM / good.sum()
        hot = good & (_robust_law(dark[good], MEDIAN_BELOW).sf(dark - 1) < rate)
        totals = counts.sum(axis=over, dtype=float)[good]
        silent = silent & (_robust_law(totals, -MEDIAN_ABOVE).pmf(0) < rate)
    return Faults(not_finite, negative, silent, hot, dark, float(np.median(dark[good])))
