"""Writes captures in the HDF5 layout of the `tal` library, and tables of responses."""

import contextlib
import os

import h5py
import numpy as np

from captures.reading import CaptureError

H_FORMATS = {"UNKNOWN": 0, "T_Sx_Sy": 1, "T_Lx_Ly_Sx_Sy": 2, "T_Si": 3, "T_Li_Si": 4}
GRID_FORMATS = {"UNKNOWN": 0, "N_3": 1, "X_Y_3": 2}


def _write_enumeration(file, name, members, value):
    file.create_dataset(name, (1,), dtype=h5py.enum_dtype(members, basetype="i"), data=[members[value]])


@contextlib.contextmanager
def _temporary(path):
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


def write_response(path, offsets, values):
    lines = [f"{offset:.10g},{value:.6g}\n" for offset, value in zip(offsets, values)]
    with _temporary(path) as temporary:
        temporary.write_text("offset,value\n" + "".join(lines), encoding="ascii")


def write_capture(path, counts, delta_t, t_start, points, normal, laser, original_format):
    """counts [T, Sx, Sy]; points [Sx, Sy, 3] in metres, as are the bins; laser is one point, or None: confocal."""
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
