"""Captures in the HDF5 layout of the `tal` library (experiments/FILES.md), read and written, and tables of responses. Lengths are in metres."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import pathlib
import warnings
from collections.abc import Iterator
from typing import Any

import h5py
import numpy as np

from isochron.errors import InputError
from isochron.files import replacing

H_FORMATS = {"UNKNOWN": 0, "T_Sx_Sy": 1, "T_Lx_Ly_Sx_Sy": 2, "T_Si": 3, "T_Li_Si": 4}
GRID_FORMATS = {"UNKNOWN": 0, "N_3": 1, "X_Y_3": 2}


class CaptureError(InputError):
    """A file or an option that cannot be used: one line."""


@dataclasses.dataclass(eq=False)
class Capture:
    """Histograms of a wall's points, and where these are."""

    counts: np.ndarray
    """[bin, Sx, Sy], with several spots of the laser [bin, Lx, Ly, Sx, Sy]; grids of points in no order have one axis for two."""
    points: np.ndarray
    """[Sx, Sy, xyz] of the sensor points."""
    normals: np.ndarray
    laser: np.ndarray | None
    """[Lx, Ly, xyz] of the laser's spots; None where the file names none: the sensor points, one by one."""
    delta_t: float
    """Width of a bin, as optical path."""
    t_start: float
    """Where the first bin begins, as optical path."""
    origins: tuple[np.ndarray, np.ndarray] | None
    """Of laser and sensor, where the ways from and to there count in the optical path; else None."""
    laser_normals: np.ndarray | None = None
    """[Lx, Ly, xyz]"""

    def write(self, path: Any) -> None:
        """As a file that experiments can read, counts with 32 bits. Raises CaptureError."""
        write_capture(path, self.counts, self.delta_t, self.t_start, self.points, self.normals, self.laser,
                      laser_normal=self.laser_normals, origins=self.origins)


def _grid(points: Any, what: str) -> np.ndarray:
    """[Sx, Sy, xyz]; points in no order are a grid of one row, a single one is a grid of one. Raises CaptureError."""
    found = np.asarray(points, float)
    found = found[np.newaxis, np.newaxis] if found.ndim == 1 else found[:, np.newaxis] if found.ndim == 2 else found
    if found.ndim != 3 or found.shape[2] != 3 or not found.size:
        raise CaptureError(f"{what} of {np.shape(points)} (allowed: [Sx, Sy, xyz], or [N, xyz])")
    return found


def _normals_of(normal: Any, points: Any, grid: np.ndarray, what: str) -> np.ndarray:
    """One for all, or one each. Raises CaptureError."""
    try:
        return np.broadcast_to(np.asarray(normal, float), np.shape(points)).reshape(grid.shape)
    except ValueError:
        raise CaptureError(f"{what} of {np.shape(normal)} do not fit points of {np.shape(points)}") from None


def _find(file: h5py.File, name: str) -> np.ndarray | None:
    """A dataset's values; None where it is missing or empty, which is how tal writes what is unknown."""
    if name not in file or not isinstance(file[name], h5py.Dataset) or not file[name].size:
        return None
    return np.asarray(file[name][()])


def _plane_normal(points: np.ndarray, origins: tuple[np.ndarray, np.ndarray] | None) -> np.ndarray | None:
    """As the program takes it, see core/image/capture_file.h."""
    flat = np.asarray(points, float).reshape(-1, 3)
    extents, axes = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)[1:]
    if len(extents) < 3 or not extents[1] > 1e-5 * extents[0]:
        return None
    normal = axes[2] * np.sign(axes[2][np.abs(axes[2]).argmax()])
    for origin in (origins or ())[::-1]:
        way = np.asarray(origin, float).reshape(3) - flat[0]
        if abs(way @ normal) > 1e-3 * np.linalg.norm(way):
            return np.asarray(normal * np.sign(way @ normal))
    return np.asarray(normal)


def _normals(file: h5py.File, name: str, points: np.ndarray, origins: tuple[np.ndarray, np.ndarray] | None,
             wall: np.ndarray | None = None) -> np.ndarray:
    """The file's, or those of the plane that the points span, or else of `wall`."""
    normals = _find(file, name)
    if normals is not None:
        return normals
    normal = _plane_normal(points, origins)
    normal = wall if normal is None else normal
    if normal is None:
        raise ValueError(f"{name} is missing, and the points span no plane")
    warnings.warn(f"{file.filename}: {name} is missing: the wall is taken as the plane of the points", stacklevel=3)
    return np.broadcast_to(normal, np.shape(points))


def read_capture(path: Any) -> Capture:
    """Reads a measurement, or a rendering of one such as a run's final.h5. Missing fields are replaced as the program does, with a
    warning. Raises CaptureError."""
    try:
        with h5py.File(path, "r") as file:
            counted = bool(file["t_accounts_first_and_last_bounces"][()])
            origins = (file["laser_xyz"][()], file["sensor_xyz"][()]) if counted else None
            points, laser, start = file["sensor_grid_xyz"][()], _find(file, "laser_grid_xyz"), _find(file, "t_start")
            normals = _normals(file, "sensor_grid_normals", points, origins)
            if start is None:
                warnings.warn(f"{path}: t_start is missing: taken as 0", stacklevel=2)
            return Capture(
                counts=np.asarray(file["H"][()], np.float32),
                points=points,
                normals=normals,
                laser=laser,
                delta_t=float(file["delta_t"][()]),
                t_start=0.0 if start is None else float(start.reshape(-1)[0]),
                origins=origins,
                laser_normals=None if laser is None else _normals(file, "laser_grid_normals", laser, origins, normals.reshape(-1, 3)[0]),
            )
    except (OSError, KeyError, ValueError, TypeError) as error:
        reason = str(error).strip("'\"").splitlines()[0]
        raise CaptureError(f"{path}: cannot be read: {reason}") from error


def _write_enumeration(file: h5py.File, name: str, members: dict[str, int], value: str) -> None:
    file.create_dataset(name, (1,), dtype=h5py.enum_dtype(members, basetype="i"), data=[members[value]])


@contextlib.contextmanager
def _replacing(path: Any) -> Iterator[pathlib.Path]:
    """The same with one line where it cannot be written."""
    try:
        with replacing(path) as temporary:
            yield temporary
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error).splitlines()[0]
        raise CaptureError(f"{path}: cannot be written: {reason}") from None


def write_response(path: pathlib.Path, offsets: np.ndarray, values: np.ndarray) -> None:
    """A table of a detector's response, as `response` of gates names it."""
    lines = [f"{offset:.10g},{value:.6g}\n" for offset, value in zip(offsets, values)]
    with _replacing(path) as temporary:
        temporary.write_text("offset,value\n" + "".join(lines), encoding="ascii")


def write_array(path: pathlib.Path, values: np.ndarray) -> None:
    """A NumPy file, such as the mask of a target. Raises CaptureError."""
    with _replacing(path) as temporary, open(temporary, "wb") as file:
        np.save(file, values)


def _histograms(counts: Any, points: np.ndarray, spots: np.ndarray | None) -> tuple[np.ndarray, bool]:
    """Counts as files hold them, and whether several spots go with every point. Raises CaptureError."""
    counts, grid = np.asarray(counts), points.shape[:2]
    sizes = counts.shape[1:]
    flat = (grid, (points.size // 3,)) if 1 in grid else (grid,)
    if sizes in flat and (spots is None or spots.size in (3, points.size)):
        return counts.reshape(-1, *grid), False
    if spots is not None:
        of_laser = spots.shape[:2]
        lasers = (of_laser, (spots.size // 3,)) if 1 in of_laser else (of_laser,)
        if sizes in [one + other for one in lasers for other in flat]:
            return counts.reshape(-1, *of_laser, *grid), True
    raise CaptureError(f"counts of {counts.shape} do not fit points of {grid} and spots of {None if spots is None else spots.shape[:2]}")


def write_capture(path: Any, counts: np.ndarray, delta_t: float, t_start: float, points: Any, normal: Any, laser: Any = None,
                  original_format: str = "arrays", *, laser_normal: Any = None, origins: Any = None) -> None:
    """Writes a measurement that experiments can read.

    counts: [bin, Sx, Sy], of several spots [bin, Lx, Ly, Sx, Sy]; sensor points and spots in no order have one axis for two,
    [bin, N], [bin, M, N] or [bin, M, Sx, Sy]. points: [Sx, Sy, xyz] or [N, xyz], in metres, as are the bins' width and start
    (optical path). normal: of the wall, or one for each point. laser: one spot, several, [Lx, Ly, xyz] or [M, xyz], each of which
    goes with every point, or None: confocal, as where the spots are `points` and the counts have one histogram for each.
    laser_normal: like `normal`, which it is where it is None. origins of laser and sensor, where times include the ways from and
    to there. Raises CaptureError.
    """
    path = pathlib.Path(path)
    try:
        sensor = _grid(points, "points")
        spots = sensor if laser is None else _grid(laser, "spots of the laser")
        normals = _normals_of(normal, points, sensor, "normals")
        if laser_normal is None:
            wall = np.asarray(normal, float)
            laser_normal = wall if laser is None or wall.ndim == 1 else wall.reshape(-1, 3)[0]
        spot_normals = _normals_of(laser_normal, points if laser is None else np.atleast_2d(laser), spots, "normals of the laser's spots")
        counts, several = _histograms(counts, sensor, None if laser is None else spots)
    except CaptureError as error:
        raise CaptureError(f"{path}: {error}") from None
    # In memory: where a disk is full, HDF5 fails in ways that cannot be caught.
    with h5py.File("capture", "w", driver="core", backing_store=False) as file:
        file.create_dataset("H", data=counts, dtype="f4", compression="gzip", shuffle=True)
        _write_enumeration(file, "H_format", H_FORMATS, "T_Lx_Ly_Sx_Sy" if several else "T_Sx_Sy")
        for name, xyz, of_wall in (("sensor", sensor, normals), ("laser", spots, spot_normals)):
            file[f"{name}_grid_xyz"] = xyz
            file[f"{name}_grid_normals"] = of_wall
            _write_enumeration(file, f"{name}_grid_format", GRID_FORMATS, "X_Y_3")
        file["laser_xyz"], file["sensor_xyz"] = (np.zeros(3), np.zeros(3)) if origins is None else origins
        file["delta_t"] = delta_t
        file["t_start"] = t_start
        file["t_accounts_first_and_last_bounces"] = origins is not None
        file["scene_info"] = f"{{original_format: {original_format}}}"
        file.flush()
        image = file.id.get_file_image()
    with _replacing(path) as temporary:
        temporary.write_bytes(image)
