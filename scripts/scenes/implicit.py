"""Closed meshes of implicit surfaces: a smooth union of ellipsoidal blobs, polygonised by a dual method ("surface
nets"): one vertex per grid cell that the surface crosses, one quad per grid edge. Vertices then slide along the
surface towards the mean of their neighbours, which makes triangles nearly regular and leaves no slivers.
"""

import numpy as np

ROOT = 0.72  # a blob alone has its surface where 1 - (d / support)^2 = ROOT; nearer to 1, blobs melt together more


class Blobs:
    """Sum of kernels (1 - d^2)^3 minus ROOT^3, positive inside; d in units of each blob's support."""

    def __init__(self):
        self._blobs = []

    def add(self, centre, radii, tilt=0.0):
        """radii: semi-axes of the surface of this blob alone; tilt: degrees, turns its x axis towards y."""
        c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
        axes = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) / np.reshape(radii, (3, 1)) * np.sqrt(1 - ROOT)
        self._blobs.append((np.asarray(centre, dtype=float), axes))

    def value_and_gradient(self, points):
        value, gradient = np.full(len(points), -(ROOT**3)), np.zeros((len(points), 3))
        for centre, axes in self._blobs:
            local = (points - centre) @ axes.T
            inside = np.maximum(1 - (local * local).sum(1), 0)
            value += inside**3
            gradient -= 6 * (inside * inside)[:, None] * (local @ axes)
        return value, gradient


def polygonise(field, low, high, cell, relaxations=30):
    """The level set of a `value_and_gradient` field within the box [low, high], which it must not touch."""
    axes = [np.arange(a, b + cell, cell) for a, b in zip(low, high)]
    shape = [len(a) for a in axes]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    inside = field.value_and_gradient(points.reshape(-1, 3))[0].reshape(shape) > 0
    index = np.full(shape, -1)
    corners = sum(inside[i : shape[0] - 1 + i, j : shape[1] - 1 + j, k : shape[2] - 1 + k].astype(int)
                  for i in (0, 1) for j in (0, 1) for k in (0, 1))
    crossed = np.argwhere((corners > 0) & (corners < 8))
    index[tuple(crossed.T)] = np.arange(len(crossed))
    vertices = points[tuple(crossed.T)] + 0.5 * cell
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        step = np.eye(3, dtype=int)
        here = inside[tuple(slice(0, n - 1) for n in shape)]
        there = np.roll(inside, -1, axis)[tuple(slice(0, n - 1) for n in shape)]
        for sign in (True, False):
            at = np.argwhere((here == sign) & (there != sign))
            ring = [at, at - step[u], at - step[u] - step[v], at - step[v]]
            quad = np.stack([index[tuple(cells.T)] for cells in ring], 1)
            quads.append(quad if sign else quad[:, ::-1])
    quads = np.concatenate(quads)
    return _triangles(_relax(field, vertices, quads, relaxations, 0.25 * cell), quads)


def _project(field, vertices, reach):
    """A Newton step to the surface, no longer than `reach`."""
    value, gradient = field.value_and_gradient(vertices)
    slope = np.sqrt((gradient * gradient).sum(1))
    step = np.clip(value, -reach * slope, reach * slope) / (slope * slope)
    return vertices - step[:, None] * gradient


def _relax(field, vertices, quads, times, reach):
    ends = np.concatenate([np.stack([quads[:, k], quads[:, (k + 1) % 4]], 1) for k in range(4)])
    count = np.bincount(ends[:, 0], minlength=len(vertices))[:, None]
    for _ in range(times):
        mean = np.zeros_like(vertices)
        np.add.at(mean, ends[:, 0], vertices[ends[:, 1]])
        vertices = _project(field, vertices + 0.5 * (mean / count - vertices), reach)
    return vertices


def _triangles(vertices, quads):
    """Splits every quad along its shorter diagonal; coordinates rounded to 1e-5, so that the last bits of another
    processor's arithmetic do not show."""
    vertices = np.round(vertices, 5)
    a, b, c, d = (vertices[quads[:, k]] for k in range(4))
    first = ((a - c) ** 2).sum(1) <= ((b - d) ** 2).sum(1)
    split = np.where(first[:, None], quads[:, [0, 1, 2, 0, 2, 3]], quads[:, [1, 2, 3, 1, 3, 0]])
    return vertices, split.reshape(-1, 3)
