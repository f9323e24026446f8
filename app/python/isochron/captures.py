"""Captures in the HDF5 layout of the `tal` library, read and written, and tables of responses. Lengths are in metres."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import pathlib
from collections.abc import Iterator
from typing import Any

import h5py
import numpy as np

from isochron.errors import InputError

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


def read_capture(path: Any) -> Capture:
    """A measurement, or a rendering of one such as a run's final.h5. Raises CaptureError."""
    try:
        with h5py.File(path, "r") as file:
            counted = bool(file["t_accounts_first_and_last_bounces"][()])
            return Capture(
                counts=np.asarray(file["H"][()], np.float32),
                points=file["sensor_grid_xyz"][()],
                normals=file["sensor_grid_normals"][()],
                laser=file["laser_grid_xyz"][()] if "laser_grid_xyz" in file else None,
                delta_t=float(file["delta_t"][()]),
                t_start=float(file["t_start"][()]),
                origins=(file["laser_xyz"][()], file["sensor_xyz"][()]) if counted else None,
            )
    except (OSError, KeyError, ValueError, TypeError) as error:
        reason = str(error).strip("'\"").splitlines()[0]
        raise CaptureError(f"{path}: cannot be read: {reason}") from error


def _write_enumeration(file: h5py.File, name: str, members: dict[str, int], value: str) -> None:
    file.create_dataset(name, (1,), dtype=h5py.enum_dtype(members, basetype="i"), data=[members[value]])


@contextlib.contextmanager
def _temporary(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """A name beside `path` that becomes it where all went well: there is a whole file or none."""
    temporary = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error).splitlines()[0]
        raise CaptureError(f"{path}: cannot be written: {reason}") from None
    finally:
        temporary.unlink(missing_ok=True)


def write_response(path: pathlib.Path, offsets: np.ndarray, values: np.ndarray) -> None:
    """A table of a detector's response, as `response` of gates names it."""
    lines = [f"{offset:.10g},{value:.6g}\n" for offset, value in zip(offsets, values)]
    with _temporary(path) as temporary:
        temporary.write_text("offset,value\n" + "".join(lines), encoding="ascii")


def write_capture(path: Any, counts: np.ndarray, delta_t: float, t_start: float, points: np.ndarray, normal: Any, laser: Any = None,
                  original_format: str = "arrays") -> None:
    """A measurement that experiments can read. counts [bin, Sx, Sy]; points [Sx, Sy, xyz] in metres, as are the bins' width and
    start (optical path); normal: of the wall, or [Sx, Sy, xyz]; laser is one point, or None: confocal. Raises CaptureError."""
    path = pathlib.Path(path)
    grid = points if laser is None else np.asarray(laser, float).reshape(1, 1, 3)
    # In memory: where a disk is full, HDF5 fails in ways that cannot be caught.
    with h5py.File("capture", "w", driver="core", backing_store=False) as file:
        file.create_dataset("H", data=counts, dtype="f4", compression="gzip", shuffle=True)
        _write_enumeration(file, "H_format", H_FORMATS, "T_Sx_Sy")
        for name, xyz in (("sensor", points), ("laser", grid)):
            file[f"{name}_grid_xyz"] = xyz
            file[f"{name}_grid_normals"] = np.broadcast_to(np.asarray(normal, float), xyz.shape)
            _write_enumeration(file, f"{name}_grid_format", GRID_FORMATS, "X_Y_3")
            file[f"{name}_xyz"] = np.zeros(3)
        file["delta_t"] = delta_t
        file["t_start"] = t_start
        file["t_accounts_first_and_last_bounces"] = False
        file["scene_info"] = f"{{original_format: {original_format}}}"
        file.flush()
        image = file.id.get_file_image()
    with _temporary(path) as temporary:
        temporary.write_bytes(image)
