"""Filtered back-projection of a capture's counts: where a surface would have to be to explain when light came back."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

CELLS = 64  # along the longer side of the picture
MOST_DEPTHS = 48
MOST_WORK = 1.2e9  # voxels times sensor points: some seconds


def _blocks(array, size):
    """Means over blocks of size[0] x size[1] sensor points; what is left over at the ends is cut."""
    x, y = (n // s * s for n, s in zip(array.shape[:2], size))
    array = array[:x, :y].reshape(x // size[0], size[0], y // size[1], size[1], *array.shape[2:])
    return array.mean(axis=(1, 3))


class BackProjection:
    """`picture` [up, across], the maximum along depth, on cells with the centres `up` and `across` (metres)."""

    def __init__(self, run, low, high, depths):
        """Depths: nearest and farthest of what was found, or None: whatever the bins reach."""
        wall = run.wall
        spacing = float(np.sqrt(np.prod(wall.high - wall.low) / run.used_points.size))
        # Narrower filters than the distance of sensor points, or than a bin, show noise rather than the scene.
        self.sigma = max(1.5 * run.delta, 1.25 * spacing)
        cell = (high - low).max() / CELLS
        self.across, self.up = (np.arange(a + cell / 2, b, cell) for a, b in zip(low, high))
        self.depths = self._depths(run, depths)
        counts, points, laser, extra = self._thinned(run)
        self.picture = self._project(run, counts, points, laser, extra).max(axis=0)

    def _depths(self, run, depths):
        if depths is None:
            # Half the way there and back; no nearer than a bin, where all that is close to the wall comes together.
            depths = max(run.start, run.delta) / 2, run.lengths[-1] / 2
        else:
            depths = max(depths[0] - 2.5 * self.sigma, run.delta / 2), depths[1] + 2.5 * self.sigma
        count = int(np.clip(np.ceil((depths[1] - depths[0]) / (self.sigma / 4)), 9, MOST_DEPTHS))
        return np.linspace(*depths, count)

    def _thinned(self, run):
        voxels = len(self.depths) * len(self.across) * len(self.up)
        side = int(np.ceil(np.sqrt(max(1.0, voxels * run.used_points.size / MOST_WORK))))
        size = [min(side, n) for n in run.used_points.shape]
        # Second derivatives take constants away, so backgrounds do not matter.
        counts = -gaussian_filter1d(run.counts, self.sigma / run.delta, axis=0, order=2, mode="nearest")
        counts = np.moveaxis(counts * run.used_points, 0, -1)
        blocks = [_blocks(a, size) for a in (counts, run.wall.points, run.wall.place(run.laser), run.extra)]
        return [b.reshape(-1, *b.shape[2:]) for b in blocks]

    def _project(self, run, counts, points, laser, extra):
        volume = np.zeros((len(self.depths), len(self.up), len(self.across)), np.float32)
        # Nothing came from voxels out of the bins' reach: the first and last entry are 0.
        histograms = np.pad(counts.astype(np.float32), ((0, 0), (1, 1)))
        # Arrays are made once, which takes half the time.
        way, found, bins = np.empty_like(volume), np.empty_like(volume), np.empty(volume.shape, np.intp)

        def distances(point, out):
            """From a point to all voxels."""
            within = (self.up[:, np.newaxis] - point[1]) ** 2 + (self.across - point[0]) ** 2
            beyond = (self.depths - point[2]) ** 2
            np.add(beyond[:, np.newaxis, np.newaxis].astype(np.float32), within.astype(np.float32), out=out)
            return np.sqrt(out, out=out)

        spot = None if run.confocal else distances(laser[0], np.empty_like(volume))
        for histogram, point, late in zip(histograms, points, extra):
            distances(point, way)
            way += way if spot is None else spot
            way += np.float32(late + run.delay - run.start + run.delta)
            way /= np.float32(run.delta)
            np.copyto(bins, way, casting="unsafe")
            volume += np.take(histogram, bins, mode="clip", out=found)
        return volume

    @property
    def extent(self):
        """Left, right, bottom and top of the picture's cells."""
        half = (self.across[1] - self.across[0]) / 2
        return self.across[0] - half, self.across[-1] + half, self.up[0] - half, self.up[-1] + half
