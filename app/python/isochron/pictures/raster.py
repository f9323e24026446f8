"""What is seen of a mesh along parallel lines: the nearest triangle that each line meets."""

import numpy as np

MOST_PAIRS = 2_000_000  # of triangles and lines that are tried at a time, to save memory
ON_THE_EDGE = 1e-9  # of a triangle's extent: lines through an edge that two triangles share meet one of them


class Seen:
    """Of vertices (across, up, depth) [N, 3] by lines at all `across` [W] and `up` [H], which increase: `depth` [H, W], NaN where a
    line meets nothing."""

    def __init__(self, points, triangles, across, up):
        self._triangles = np.asarray(triangles)
        shape = len(up), len(across)
        self.depth = np.full(shape, np.nan)
        self._met, self._weights = np.zeros(shape, int), np.zeros((*shape, 3))
        corners = np.asarray(points, float)[self._triangles]
        low, high = corners.min(axis=1), corners.max(axis=1)
        columns, rows = ((np.searchsorted(lines, low[:, k]), np.searchsorted(lines, high[:, k], "right"))
                         for k, lines in enumerate((across, up)))
        widths, sizes = columns[1] - columns[0], (columns[1] - columns[0]) * (rows[1] - rows[0])
        ends = np.cumsum(sizes)
        for part in np.split(np.arange(len(corners)), np.flatnonzero(np.diff(ends // MOST_PAIRS)) + 1):
            tried = np.repeat(part, sizes[part])
            number = np.arange(len(tried)) - np.repeat(np.cumsum(sizes[part]) - sizes[part], sizes[part])
            row, column = rows[0][tried] + number // widths[tried], columns[0][tried] + number % widths[tried]
            self._add(corners, tried, row, column, np.stack([across[column], up[row]], axis=-1))

    def _add(self, corners, tried, row, column, place):
        a, b, c = (corners[tried, k] for k in range(3))
        with np.errstate(divide="ignore", invalid="ignore"):  # triangles that stand on edge have no weights
            weights = np.stack([_turn(b, c, place), _turn(c, a, place), _turn(a, b, place)], axis=-1)
            weights /= weights.sum(axis=-1, keepdims=True)
        met = (weights >= -ON_THE_EDGE).all(axis=-1)
        tried, row, column, weights = tried[met], row[met], column[met], weights[met]
        depth = (weights * corners[tried, :, 2]).sum(axis=-1)
        order = np.argsort(-depth, kind="stable")  # the nearest last, which stays
        order = order[~(depth[order] >= self.depth[row, column][order])]
        at = row[order], column[order]
        self.depth[at], self._met[at], self._weights[at] = depth[order], tried[order], weights[order]

    def of(self, values):
        """Values of the vertices [N], linear within triangles."""
        seen = (self._weights * np.asarray(values, float)[self._triangles[self._met]]).sum(axis=-1)
        return np.where(np.isfinite(self.depth), seen, np.nan)


def _turn(a, b, place):
    """Twice the area of the triangle of two points and a place, as seen; negative where it runs clockwise."""
    return (a[:, 0] - place[:, 0]) * (b[:, 1] - place[:, 1]) - (b[:, 0] - place[:, 0]) * (a[:, 1] - place[:, 1])
