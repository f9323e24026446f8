"""The surface behind a capture's photon counts."""

from __future__ import annotations

import os
import pathlib
import tempfile
from typing import TYPE_CHECKING, Any

from isochron.dictionary import write_table
from isochron.errors import InputError
from isochron.experiment import extension
from isochron.progress import Progress, showing
from isochron.records import Callback, row_callback
from isochron.runs import Run, read_run

if TYPE_CHECKING:
    from isochron.captures import Capture


def _capture_file(capture: str | os.PathLike[str] | Capture, place: pathlib.Path) -> str:
    if isinstance(capture, (str, os.PathLike)):
        return os.fspath(capture)
    path = place / "capture.h5"
    capture.write(path)
    return os.fspath(path)


def _response_file(response: Any, place: pathlib.Path) -> str:
    if response is None or isinstance(response, (str, os.PathLike)):
        return "" if response is None else os.fspath(response)
    path = place / "response.npy"
    write_table(path, response)
    return os.fspath(path)


def reconstruct(capture: str | os.PathLike[str] | Capture, response: Any = None, seconds: float = 300,
                callback: Callback | None = None, *, folder: str | os.PathLike[str] | None = None, seed: int = 1,
                force: bool = False, progress: Progress = None) -> Run:
    """Finds the hidden surface, as `isochron reconstruct` does, into a folder (default: runs/NAME of the file), and reads its run.

    capture: a file or what read_capture gives. response: how much later than it arrives light is counted, a file (`offset,value`) or a
    pair of arrays, offsets in ps. seconds: what the fit may take on two cores. callback, force, progress: as of Experiment.run. The mesh is
    `geometry/final_surface.ply` of the folder. Raises InputError, also where nothing stands out of the background: the folder's
    summary.yaml then says how many photons that would take.
    """
    with tempfile.TemporaryDirectory() as temporary, showing(progress, extension(), of_run=True) as shown:
        place = pathlib.Path(temporary)
        found = extension().reconstruct(_capture_file(capture, place), _response_file(response, place),
                                        "" if folder is None else os.fspath(folder), seconds, seed, force, row_callback(callback, shown))
    if found is None:
        raise InputError("no light of a hidden surface stands out of the background")
    return read_run(found)
