"""The wall's frame: what who stands at the wall and looks along its normal sees to the right, above and ahead."""

import numpy as np


class Axis:
    """A direction in the wall. Where it is an axis of the world, positions along it are the world's coordinates, which
    may decrease along the direction (`inverted`); else they count from the middle of the wall."""

    def __init__(self, direction, middle, label):
        main = int(np.argmax(np.abs(direction)))
        if abs(direction[main]) > 1 - 1e-6:
            self.unit, self.zero, self.label = np.eye(3)[main], 0.0, f"{'xyz'[main]} (m)"
            self.name = "xyz"[main]
            self.inverted = direction[main] < 0
        else:
            self.unit, self.zero, self.label, self.inverted = direction, float(direction @ middle), f"{label} (m)", False
            self.name = label.split(",")[0]


def _flattened(vector, normal):
    """The direction of what of `vector` lies in the wall; None where that is nothing."""
    within = vector - (vector @ normal) * normal
    size = np.linalg.norm(within)
    return within / size if size > 1e-9 * max(1.0, np.linalg.norm(vector)) and size > 0 else None


class Wall:
    """Points [Sx, Sy, 3], whose rows run downwards. A single row does not tell which way is up: then it is y, or x on a floor."""

    def __init__(self, points, normals):
        flat = points.reshape(-1, 3)
        self.middle = flat.mean(axis=0)
        self.normal = normals.mean(axis=0) / np.linalg.norm(normals.mean(axis=0))
        up = _flattened((points[:, 0] - points[:, -1]).mean(axis=0), self.normal) if points.shape[1] > 1 else None
        if up is None:
            up = _flattened(np.eye(3)[1 if abs(self.normal[1]) < 0.9 else 0], self.normal)
        self.across = Axis(np.cross(self.normal, up), self.middle, "to the right, from the wall's middle")
        self.up = Axis(up, self.middle, "up, from the wall's middle")
        self.points = self.place(points)
        low, high = self.points[..., :2].reshape(-1, 2).min(axis=0), self.points[..., :2].reshape(-1, 2).max(axis=0)
        self.low, self.high = low, high

    @classmethod
    def of(cls, capture):
        """That of a capture's sensor points; those in no order are one row."""
        return cls(capture.points.reshape(len(capture.points), -1, 3), capture.normals.reshape(-1, 3))

    def place(self, points):
        """(across, up, distance from the wall) of points of the world."""
        return np.stack([points @ self.across.unit - self.across.zero, points @ self.up.unit - self.up.zero,
                         (points - self.middle) @ self.normal], axis=-1)

    def world(self, places):
        """The opposite of `place`."""
        across, up, depth = np.moveaxis(np.asarray(places)[..., np.newaxis], -2, 0)
        return ((across + self.across.zero) * self.across.unit + (up + self.up.zero) * self.up.unit
                + (depth + self.middle @ self.normal) * self.normal)

    def spread_points(self, used):
        """Numbers (column, row) of four sensor points, or as many as there are, spread over those that are `used`: first
        the upper left as seen from the wall, then the upper right and the lower two; along a line, from the left."""
        candidates = np.argwhere(used)
        places = self.points[used][:, :2]
        places = places * [-1 if self.across.inverted else 1, -1 if self.up.inverted else 1]  # now right and up
        low, size = places.min(axis=0), np.ptp(places, axis=0)
        if size.min() > 0.05 * size.max():
            aims = low + size * np.array([[0.22, 0.78], [0.78, 0.78], [0.22, 0.22], [0.78, 0.22]])
        else:
            aims = low + size * np.linspace(0.12, 0.88, 4)[:, np.newaxis]
        chosen = []
        for aim in aims[: len(places)]:
            distance = np.linalg.norm(places - aim, axis=1)
            distance[chosen] = np.inf
            chosen.append(int(np.argmin(distance)))
        return [tuple(candidates[i]) for i in chosen]


class Plane:
    """depth = middle + slopes . (position - centre) through vertices; `flat` where none lies far off."""

    TOLERANCE = 2e-3  # of the extent: less than any picture of the depth would show

    def __init__(self, points):
        self.centre = points[:, :2].mean(axis=0)
        design = np.column_stack([points[:, :2] - self.centre, np.ones(len(points))])
        solution, *_ = np.linalg.lstsq(design, points[:, 2], rcond=None)
        self.slopes, self.middle = solution[:2], float(solution[2])
        extent = max(np.ptp(points[:, :2], axis=0).max(), np.ptp(points[:, 2]), 1e-12)
        self.flat = np.abs(design @ solution - points[:, 2]).max() < self.TOLERANCE * extent

    def describe(self, wall):
        tilts = np.degrees(np.arctan(self.slopes))
        return (f"{self.middle:.4f} m from the wall",
                f"tilts {tilts[0]:+.2f}° along {wall.across.name}, {tilts[1]:+.2f}° along {wall.up.name}")
