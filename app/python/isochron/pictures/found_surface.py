"""What a reconstruction found, the fit's surface and back-projection's, in the wall's frame."""

import pathlib

import numpy as np

from isochron.captures import read_capture
from isochron.errors import InputError
from isochron.mesh_files import read_run_surface
from isochron.pictures.capture_run import METRES, Surface
from isochron.pictures.reading import PlotError, numbers, read_yaml
from isochron.pictures.wall import Wall

SHAPE = "surface"  # as reconstructions name it in their scenes
FIT, BACK_PROJECTION = f"geometry/final_{SHAPE}.ply", "back_projection.ply"

DARK = 0.05  # of a surface's largest albedos


def width_at_half(offsets, values):
    """Of a response's peak, between the first and the last crossing of half its height."""
    above = np.flatnonzero(values >= values.max() / 2)
    ends = []
    for inside, outside in ((above[0], above[0] - 1), (above[-1], above[-1] + 1)):
        if not 0 <= outside < len(values):
            ends.append(offsets[inside])
            continue
        share = (values[inside] - values.max() / 2) / (values[inside] - values[outside])
        ends.append(offsets[inside] + share * (offsets[outside] - offsets[inside]))
    return ends[1] - ends[0]


class FoundSurface:
    """`surfaces` are those of the fit and of back-projection, in this order, of which the first may be missing."""

    shape = SHAPE

    def __init__(self, directory):
        self.directory = directory
        self.experiment = read_yaml(directory / "experiment.yaml")
        self.name = str(self.experiment.get("name", directory.name))
        summary = directory / "summary.yaml"
        self.summary = read_yaml(summary) if summary.exists() else {}
        try:
            capture = read_capture(self._capture_file())
            self.wall = Wall.of(capture)
            self.resolution = self._resolution(capture.delta_t)
        except InputError:
            raise
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            raise PlotError(f"{directory / 'experiment.yaml'}: cannot be read: {error}") from error
        self.fit = self._read(FIT, "fit") if (directory / FIT).exists() else None
        self.back_projection = self._read(BACK_PROJECTION, "back-projection")
        self.surfaces = [surface for surface in (self.fit, self.back_projection) if surface]

    def _capture_file(self):
        """What the run ended with, or, of one that is under way, what it began with."""
        if (self.directory / "final.h5").exists():
            return self.directory / "final.h5"
        scene = self.directory / pathlib.PurePath(self.experiment["scene"])
        return scene.parent / pathlib.PurePath(read_yaml(scene)["capture"]["file"])

    def _resolution(self, bin_width):
        """Along the depth, of what the response alone can tell apart: half of its width, or a bin's where that is more."""
        gates = self.experiment.get("gates") or {}
        response, width = gates.get("response"), 0.0
        if isinstance(response, dict):
            unit = METRES.get(gates.get("unit", "scene"), float(gates.get("scene_unit_m") or 1))
            width = width_at_half(numbers(response["offsets"]), numbers(response["values"])) * unit
        return max(width, bin_width) / 2

    def _read(self, file, name):
        points, triangles, values = read_run_surface(self.directory / file)
        return Surface(name, self.wall.place(points), triangles, values.get("albedo"), values.get("standard_error"))

    @staticmethod
    def least_lit(surface):
        """Albedo below which a part sends hardly any light, so that pictures need not be about it."""
        return -np.inf if surface.albedo is None else DARK * np.percentile(surface.albedo, 99)

    def lit(self, surface):
        """Which vertices [N] pictures are about."""
        return np.ones(len(surface.points), bool) if surface.albedo is None else surface.albedo >= self.least_lit(surface)

    def undetermined(self, errors):
        """Where the data do not say where the surface is: its standard error is unknown or above the resolution."""
        return ~(errors <= self.resolution)
