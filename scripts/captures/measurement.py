"""What a capture consists of, whatever file it came from."""

import dataclasses

import numpy as np
from isochron.captures import CaptureError

METRES_PER_PS = 299792458e-12
LEAD_PS = 500  # kept before time zero where bins are aligned: the pulse's rise belongs to the response


@dataclasses.dataclass
class Measurement:
    """Counts [T, Sx, Sy] or, with several spots of the laser, [T, Lx, Ly, Sx, Sy], and where their points are."""

    format: str
    name: str
    """Of the array of counts, for messages."""
    counts: np.ndarray
    bin_ps: float
    start_ps: float
    """When bin `lead` begins."""
    points: np.ndarray
    """[Sx, Sy, 3], metres"""
    normals: np.ndarray
    """[3] or [Sx, Sy, 3]"""
    laser: np.ndarray | None = None
    """[Lx, Ly, 3]; None: confocal"""
    laser_normals: np.ndarray | None = None
    """[Lx, Ly, 3]; None: the wall's"""
    origins: tuple | None = None
    """Of laser and sensor, where times include the ways from and to there"""
    lead: int = 0
    """Bins before time zero"""
    said: list = dataclasses.field(default_factory=list)
    """Lines of what was assumed"""


def on_grid(counts, points):
    """Counts [T, N, 1] and points [N, 1, 3] of a grid in the plane of two axes as [T, X, Y] and [X, Y, 3]: columns along the first
    of the two, rows against the second. Others stay as they are."""
    flat = points.reshape(-1, 3)
    if points.shape[1] != 1 or len(flat) < 4:
        return counts, points
    extent = np.ptp(flat, axis=0)
    step = 1e-5 * extent.max()  # grids may be rounded to 32 bits
    across, down = (axis for axis in range(3) if axis != int(extent.argmin()))
    if extent.min() > step:
        return counts, points
    columns, rows = (np.unique(np.rint(flat[:, axis] / step), return_inverse=True)[1] for axis in (across, down))
    shape = columns.max() + 1, rows.max() + 1
    number = columns * shape[1] + shape[1] - 1 - rows
    if shape[0] * shape[1] != len(flat) or len(np.unique(number)) != len(flat) or min(shape) < 2:
        return counts, points
    order = np.argsort(number)
    return counts[:, order, 0].reshape(-1, *shape), flat[order].reshape(*shape, 3)


__all__ = ["LEAD_PS", "METRES_PER_PS", "CaptureError", "Measurement", "on_grid"]
