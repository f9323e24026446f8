"""The light-cone transform of confocal captures (O'Toole et al. 2018), for comparison: with v = r^2 in place of time and u = z^2 in place
of depth, counts are the albedo convolved with a kernel that is the same everywhere, which a Wiener filter divides out."""

import dataclasses

import numpy as np
from scipy import fft

FALLOFF = 2  # light of a small diffuse surface decreases with r^4 = v^2
CELLS = 512  # along v and u
FINER = 8  # parts of a cell along each side over which the kernel is averaged


@dataclasses.dataclass
class Volume:
    """[across, up, depth], lengths in metres; the wall's points are a grid at right angles, the depth that from the wall."""

    albedo: np.ndarray
    across: np.ndarray
    up: np.ndarray
    squares: np.ndarray  # of depths


def counts_over_squares(capture, delay, reach):
    """Counts [Sx, Sy, CELLS] between squares of distances up to reach^2, and the step of these: none is lost or counted twice."""
    edges = np.linspace(0, reach**2, CELLS + 1)
    lengths = capture.t_start + capture.delta_t * np.arange(len(capture.counts) + 1) - delay
    before = np.concatenate([np.zeros((1, *capture.counts.shape[1:])), np.cumsum(capture.counts, axis=0, dtype=float)])
    place = np.clip((2 * np.sqrt(edges) - lengths[0]) / capture.delta_t, 0, len(lengths) - 1)
    first = np.minimum(place.astype(int), len(lengths) - 2)
    share = (place - first)[:, np.newaxis, np.newaxis]
    return np.moveaxis(np.diff((1 - share) * before[first] + share * before[first + 1], axis=0), 0, -1), edges[1]


def kernel(shape, steps, step):
    """Of a surface at the origin: where v is the square of the distance across, on a grid that goes round. Its norm is 1."""
    squares = []
    for count, width in zip(shape, steps):
        cells = fft.fftfreq(count, 1 / count)
        parts = (np.arange(FINER) + 0.5) / FINER - 0.5
        squares.append(((cells[:, np.newaxis] + parts) * width) ** 2 / step)
    values = np.zeros(shape, np.float32)
    rows, columns = (index.ravel() for index in np.indices(shape[:2]))
    for i in range(FINER):
        for j in range(FINER):
            cell = (squares[0][:, i, np.newaxis] + squares[1][:, j]).ravel()
            first = cell.astype(int)
            for late, share in ((0, first + 1 - cell), (1, cell - first)):
                inside = first + late < shape[2] // 2
                np.add.at(values, (rows[inside], columns[inside], first[inside] + late), share[inside])
    return values / np.linalg.norm(values)


def volumes(capture, delay, reach, ratios):
    """For each ratio of signal to noise, which is the filter's only setting, a Volume. delay: by how much of path length light is counted
    late; reach: the greatest distance that is looked at, in metres."""
    counts, step = counts_over_squares(capture, delay, reach)
    places = np.arange(CELLS) + 0.5
    data = (counts * places**FALLOFF).astype(np.float32)
    shape = tuple(2 * n for n in data.shape)  # what goes round meets nothing
    across, up = capture.points[:, 0, 0], capture.points[0, :, 1]
    steps = [abs(axis[1] - axis[0]) for axis in (across, up)]
    response = fft.rfftn(kernel(shape, steps, step))
    spectrum = fft.rfftn(data, shape)
    squares = step * places
    for ratio in ratios:
        found = fft.irfftn(spectrum * np.conj(response) / (np.abs(response) ** 2 + 1 / ratio), shape)
        found = found[tuple(slice(n) for n in data.shape)] * 2 * np.sqrt(squares)
        yield Volume(found.astype(np.float32), across, up, squares)


def surface(volume, least):
    """Vertices and triangles where the maximum along the depth reaches `least` of the greatest one; depths are those of parabolas
    through the maxima."""
    peak = np.clip(volume.albedo.argmax(axis=2), 1, CELLS - 2)
    before, at, after = (np.take_along_axis(volume.albedo, peak[..., np.newaxis] + i, axis=2)[..., 0] for i in (-1, 0, 1))
    bend = before - 2 * at + after
    off = np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, 1), 0)
    depth = np.sqrt(np.maximum(np.interp(peak + off, np.arange(CELLS), volume.squares), 0))
    vertices = np.stack([*np.meshgrid(volume.across, volume.up, indexing="ij"), depth], axis=-1).reshape(-1, 3)
    number = np.arange(depth.size).reshape(depth.shape)
    a, b, c, d = (number[i].ravel() for i in (np.s_[:-1, :-1], np.s_[1:, :-1], np.s_[1:, 1:], np.s_[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    seen = (at >= least * at.max()).ravel()
    return vertices, triangles[seen[triangles].all(axis=1)]
