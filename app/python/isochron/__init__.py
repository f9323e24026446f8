"""isochron: inverse rendering for time-of-flight imaging.

Experiment renders, differentiates and optimises. read_run, read_image, read_exr and read_capture read results, also without the
compiled part of the package. reconstruct finds the hidden surface behind a capture's photon counts, back_project shows where it
may be. isochron.torch makes images that PyTorch differentiates.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from isochron.errors import InputError
from isochron.experiment import Experiment, resume
from isochron.exr import read as read_exr
from isochron.exr import write as write_exr
from isochron.image import Coordinates, Image
from isochron.parallel import set_threads, threads
from isochron.reconstruction import reconstruct
from isochron.records import Evaluation, Gradient, Iteration, Parameter
from isochron.runs import Run, read_image, read_run

if TYPE_CHECKING:
    from isochron.back_projection import BackProjection, back_project
    from isochron.captures import Capture, read_capture, write_capture

__all__ = ["BackProjection", "Capture", "Coordinates", "Evaluation", "Experiment", "Gradient", "Image", "InputError", "Iteration",
           "Parameter", "Run", "back_project", "read_capture", "read_exr", "read_image", "read_run", "reconstruct", "resume",
           "set_threads", "threads", "write_capture", "write_exr"]


def __getattr__(name: str) -> Any:
    # h5py takes long to load.
    if name in ("Capture", "read_capture", "write_capture"):
        from isochron import captures

        return getattr(captures, name)
    if name in ("BackProjection", "back_project"):
        from isochron import back_projection

        return getattr(back_projection, name)
    raise AttributeError(f"module 'isochron' has no attribute '{name}'")


def __dir__() -> list[str]:
    return __all__
