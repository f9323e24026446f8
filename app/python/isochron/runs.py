"""Folders of runs, read into arrays."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np

from isochron.errors import InputError
from isochron.image import Coordinates, Image
from isochron.mesh_files import read_mesh
from isochron.pictures.reading import Folder, PlotError, numbers, read_log, read_stack, read_yaml


def read_values(directory: pathlib.Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What summary.yaml says (empty of a run under way), and values by parameter: the final ones, else the checkpoint's."""
    summary, values = {}, {}
    try:
        if (directory / "summary.yaml").exists():
            summary = read_yaml(directory / "summary.yaml")
            values = summary["parameters"]
        elif (directory / "checkpoint.yaml").exists():
            entries = read_yaml(directory / "checkpoint.yaml")["parameters"]
            values = {entry["name"]: entry["value"] for entry in entries}
        return summary, {name: numbers(value) for name, value in values.items()}
    except PlotError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise PlotError(f"{directory}: the parameters cannot be read: {error}") from error


def read_image(path: Any, component: str = "") -> Image:
    """Gated images [gate, row, column, channel] of an EXR file, with coordinates. component: of a file of derivatives, one of
    total, interior, visibility, path_length. Raises InputError."""
    path = pathlib.Path(path)
    try:
        stacks = read_stack(path)
        if component not in stacks:
            raise InputError(f"{path}: there is no component '{component}' (allowed: {', '.join(map(repr, stacks))})")
        stack = stacks[component]
        gates = Folder(path.parent).gates(path, len(stack))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    centers = np.empty(0) if gates.centers is None else np.asarray(gates.centers, float)
    return Image(stack if stack.ndim == 4 else stack[..., np.newaxis], Coordinates(centers, gates.unit, gates.quantity))


class Run:
    """A run's folder: what is in its files when they are asked for, also of a run that is under way."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.folder = folder
        self.summary: dict[str, Any]
        """What summary.yaml says; empty of a run that is under way."""
        self.values: dict[str, np.ndarray]
        """Name -> values of the parameter, final or as of the last iteration, in its unit."""
        self.summary, self.values = read_values(folder)

    def __repr__(self) -> str:
        return f"<isochron.Run {self.folder}: {self.status}>"

    @property
    def status(self) -> str:
        """converged, iterations_reached, diverged, interrupted; 'under way' before that."""
        return str(self.summary.get("status", "under way"))

    @property
    def experiment(self) -> dict[str, Any]:
        """experiment.yaml: what was run, everything resolved."""
        return read_yaml(self.folder / "experiment.yaml")

    @property
    def log(self) -> dict[str, np.ndarray]:
        """Column of log.csv -> array [row]; row i is what iteration i starts from."""
        return read_log(self.folder / "log.csv")

    @property
    def target(self) -> Image:
        """[gate, row, column, channel]"""
        return read_image(self.folder / "target.exr")

    @property
    def initial(self) -> Image:
        """[gate, row, column, channel]"""
        return read_image(self.folder / "initial.exr")

    @property
    def final(self) -> Image:
        """[gate, row, column, channel]"""
        return read_image(self.folder / "final.exr")

    def meshes(self, when: str = "final") -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Shape -> vertices [vertex, xyz], as its mesh's file counts them, and triangles [triangle, 3] of the shapes that
        parameters move.
        when: initial, final, target or the number of an iteration that the run wrote, such as 000010."""
        start = f"{when}_"
        files = sorted((self.folder / "geometry").glob(f"{start}*.*"))
        return {path.stem.removeprefix(start): read_mesh(path) for path in files}


def read_run(folder: Any) -> Run:
    """The folder of a run, finished or under way. Raises InputError."""
    folder = pathlib.Path(folder)
    if not (folder / "experiment.yaml").exists():
        raise InputError(f"{folder}: not the folder of a run, it has no experiment.yaml")
    return Run(folder)
