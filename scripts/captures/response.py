"""The instrument's response, from the light that a confocal capture's wall reflects directly."""

import numpy as np

FURTHEST_PS = 64  # that a point's time zero may be off
FAINTEST = 1e-3  # of the peak: less is not followed
STANDARD_ERRORS = 3  # above the background, else it is noise
BLOCK = 16  # bins that are averaged to find out where the light ends


def background(counts):
    """Counts per bin and point without light: the darkest sixteenth of the time."""
    mean = counts.mean(axis=(1, 2))
    return min(part.mean() for part in np.array_split(mean, min(16, len(mean))))


def _moving_average(values, width):
    return np.convolve(values, np.ones(width) / width, mode="valid")


def alignment(counts, level, furthest):
    """Bins by which each point's direct light comes later than that of the others: the most likely shift of the
    average. Zero where the file begins with the peak: shifts of a decay look like its brightness."""
    bins, points = len(counts), counts[0].size
    flat = counts.reshape(bins, points)
    shifts = np.zeros(points, int)
    first = int(flat.sum(axis=1).argmax()) - 2 * furthest
    if furthest < 1 or first < furthest or first + 5 * furthest > bins:
        return shifts
    window = np.arange(first, first + 4 * furthest)
    template = flat.mean(axis=1)
    for _ in range(2):
        template = np.maximum(template, 0.1 * max(level, 1e-3))
        scores = []
        for shift in range(-furthest, furthest + 1):
            part = template[window - shift]
            scores.append(np.log(part / part.sum()) @ flat[window])
        shifts = np.argmax(scores, axis=0) - furthest
        shifts -= int(np.rint(shifts.mean()))  # what they have in common is for the template to show
        template = average(flat, shifts)
    return shifts


def average(flat, shifts):
    """The average of the points' counts, each taken from `shift` bins later. Bins that few points have are zero."""
    total, seen = np.zeros(len(flat)), np.zeros(len(flat))
    for shift in np.unique(shifts):
        rows = np.arange(max(0, -shift), len(flat) - max(0, shift))
        chosen = flat[:, shifts == shift]
        total[rows] += chosen[rows + shift].sum(axis=1)
        seen[rows] += chosen.shape[1]
    return np.where(seen > 0.5 * flat.shape[1], total / np.maximum(seen, 1), 0)


def extent(light, level, points):
    """First and last (excluded) bin of the direct light."""
    peak = int(light.argmax())
    smooth = _moving_average(light, BLOCK)
    noise = np.sqrt(np.maximum(smooth + level, 0) / (points * BLOCK))
    dark = smooth < np.maximum(STANDARD_ERRORS * noise, FAINTEST * light[peak])
    after = np.flatnonzero(dark[peak:])
    before = np.flatnonzero(dark[: max(0, peak - BLOCK + 1)])
    return (int(before[-1]) + BLOCK if len(before) else 0), (peak + int(after[0]) if len(after) else len(light))


def measure(counts, bin_ps, start_ps, end_ps=None):
    """Offsets in ps and values of unit integral, from counts [T, X, Y] whose first bin begins at start_ps; None where
    no light stands out. The light ends where it is faint, or at end_ps."""
    level = background(counts)
    shifts = alignment(counts, level, int(np.ceil(FURTHEST_PS / bin_ps)))
    light = average(counts.reshape(len(counts), -1), shifts) - level
    if len(light) <= BLOCK or light.max() <= 0:
        return None
    first, last = extent(light, level, counts[0].size)
    if end_ps is not None:
        last = min(len(light), int(np.ceil((end_ps - start_ps) / bin_ps)))
    if last <= first:
        return None
    values = np.maximum(light[first:last], 0)
    values /= values.sum() * bin_ps
    # Only the points' differences are taken out: the file's time zero, on average right, stays what it is.
    late = np.average(shifts, weights=counts.sum(axis=0).reshape(-1) + 1e-9) * bin_ps
    centres = start_ps + late + (np.arange(first, last) + 0.5) * bin_ps
    # The outer halves of the first and the last bin belong to it too. Even steps, which are faster to look up.
    offsets = centres[0] + (np.arange(2 * len(centres) + 1) - 1) * (bin_ps / 2)
    return offsets, np.interp(offsets, centres, values)
