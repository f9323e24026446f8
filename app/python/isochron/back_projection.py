"""Filtered back-projection of captures: where surfaces would have to be to explain when light came back."""

from __future__ import annotations

import dataclasses
import os
from typing import TYPE_CHECKING, Any

import numpy as np

from isochron.errors import InputError
from isochron.progress import Progress, showing

if TYPE_CHECKING:
    from isochron.captures import Capture

METRES = {"m": 1.0, "ps": 0.299792458e-3, "ns": 0.299792458}
"""Of optical path, by unit."""


@dataclasses.dataclass(eq=False)
class BackProjection:
    """A box of the space in front of the wall that holds all that is significant. Lengths are in metres, `across`, `up` and `depth`
    those of the wall's frame: see to_capture. Arrays are empty where nothing is significant."""

    across: np.ndarray
    """Middles of the voxels, evenly spaced, as those `up` and along the `depth`, which is the distance from the wall."""
    up: np.ndarray
    depth: np.ndarray
    albedo: np.ndarray
    """[depth, up, across], with a factor that is not known. Zero where the search, coarse to fine, has not come to."""
    significance: np.ndarray
    """[depth, up, across], in standard deviations of the counts' Poisson noise."""
    least_albedo: float
    """A voxel is a surface's where albedo and significance reach these."""
    least_significance: float
    depth_map: np.ndarray
    """[up, across]: distance from the wall of the first surface; NaN where there is none."""
    depth_resolution: float
    """What can be told apart, along the depth and across it."""
    lateral_resolution: float
    vertices: np.ndarray
    """[vertex, xyz] of a mesh of all surfaces that the wall sees, in the capture's coordinates."""
    triangles: np.ndarray
    """[triangle, 3], counter-clockwise seen from the wall."""
    vertex_albedo: np.ndarray
    """[vertex], relative: the mean is 1."""
    origin: np.ndarray
    """Of the wall's frame, the middle of the sensor points, in the capture's coordinates."""
    axes: np.ndarray
    """[3, xyz]: unit vectors across, up and along the wall's normal."""

    @property
    def surface(self) -> np.ndarray:
        """[depth, up, across]: whether a voxel is a surface's."""
        return np.asarray((self.albedo >= self.least_albedo) & (self.significance >= self.least_significance))

    def to_capture(self, points: Any) -> np.ndarray:
        """From [..., (across, up, depth)] to the capture's coordinates."""
        return np.asarray(self.origin + np.asarray(points, float) @ self.axes)


def _spots(capture: Capture) -> np.ndarray | None:
    """[spot, xyz]; None where the laser points are the sensor points, one by one."""
    points = int(np.prod(capture.points.shape[:-1]))
    laser = None if capture.laser is None else np.reshape(capture.laser, (-1, 3))
    histograms = capture.counts[0].size
    if histograms == points and (laser is None or len(laser) == points != 1):
        return None
    if laser is None or histograms != points * len(laser):
        raise InputError(f"counts of {capture.counts.shape} do not fit {points} points and {0 if laser is None else len(laser)} spots")
    return laser


def _response(response: Any, unit: str) -> tuple[np.ndarray, np.ndarray] | None:
    if response is None:
        return None
    if unit not in METRES:
        raise InputError(f"unit '{unit}': none of {', '.join(METRES)}")
    if isinstance(response, (str, os.PathLike)):
        try:
            table = os.fspath(response).endswith(".npy")
            response = (np.load(response) if table else np.loadtxt(response, delimiter=",", skiprows=1, ndmin=2)).T
        except (OSError, ValueError) as error:
            raise InputError(f"{os.fspath(response)}: cannot be read: {str(error).splitlines()[0]}") from error
    offsets, values = (np.asarray(column, float) for column in response)
    return offsets * METRES[unit], values


def back_project(capture: Any, response: Any = None, *, unit: str = "ps", used: Any = None,
                 false_alarms: float = 0.01, progress: Progress = None) -> BackProjection:
    """capture: a file or what read_capture gives. response: how much later than it arrives light is counted, a file (`offset,value`) or a
    pair of arrays, offsets in `unit` (ps, ns, m). used: [Sx, Sy], zero for dead points. false_alarms: the probability that noise makes
    anything significant. progress: as of Experiment. Raises InputError."""
    from isochron import _core, captures

    if isinstance(capture, (str, os.PathLike)):
        capture = captures.read_capture(capture)
    spots = _spots(capture)
    counts = np.reshape(capture.counts, (len(capture.counts), -1)).T
    normals = np.reshape(np.broadcast_to(capture.normals, capture.points.shape), (-1, 3))
    with showing(progress, _core):
        fields = _core.back_project(counts, np.reshape(capture.points, (-1, 3)), normals, spots, capture.delta_t, capture.t_start,
                                    None if capture.origins is None else np.reshape(capture.origins, (2, 3)),
                                    _response(response, unit), None if used is None else np.ravel(used), false_alarms)
    return BackProjection(**fields)
