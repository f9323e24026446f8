"""A run that fitted a capture: counts, expected counts, the wall and the recovered surfaces, as arrays in metres."""

import dataclasses
import pathlib
import re

import numpy as np

from isochron import exr
from isochron.captures import read_capture
from isochron.errors import InputError
from isochron.mesh_files import name_in_files, read_run_mesh, read_scene_mesh
from isochron.pictures.reading import PlotError, numbers, read_yaml
from isochron.pictures.wall import Wall
from isochron.runs import read_values

METRES_PER_PS = 299792458e-12
METRES = {"ps": METRES_PER_PS, "ns": 1000 * METRES_PER_PS}  # of a unit of time; light's way in it


def names_of(shape):
    """Of a parameter's key `shape`: one name, several or none."""
    return [str(name) for name in shape] if isinstance(shape, list) else [] if shape is None else [str(shape)]


def mirrored(capture):
    """Light goes both ways alike: of one point that looks while the laser scans, with the spots as points of one row and it as the spot."""
    spots = capture.laser.reshape(-1, 1, 3)
    return dataclasses.replace(capture, counts=capture.counts.reshape(len(capture.counts), -1, 1), points=spots,
                               normals=np.broadcast_to(capture.normals.reshape(1, 1, 3), spots.shape), laser=capture.points.reshape(1, 3),
                               origins=capture.origins and capture.origins[::-1])


class Surface:
    """A shape as the fit left it: vertices in the wall's frame; for each of them, or None, an albedo and the standard error of its
    place along the normal, in metres."""

    def __init__(self, name, points, triangles, albedo, errors=None):
        self.name, self.points, self.triangles, self.albedo, self.errors = name, points, triangles, albedo, errors


class CaptureRun:
    """What the pictures of a run need; of several spots of the laser the first. Arrays of light are [T, Sx, Sy]."""

    ps = METRES_PER_PS

    def __init__(self, directory):
        self.directory = directory
        if not directory.is_dir():
            raise PlotError(f"{directory}: no such folder")
        if not (directory / "experiment.yaml").exists():
            raise PlotError(f"{directory}: not the folder of a run, it has no experiment.yaml")
        self.experiment = read_yaml(directory / "experiment.yaml")
        self.name = str(self.experiment.get("name", directory.name))
        if not is_capture(directory, self.experiment):
            raise PlotError(f"{directory}: not the run of a capture, its scene has no key `capture`")
        for name, why in (("final.h5", "not finished, or its gates are no bins of time"), ("target.exr", "damaged")):
            if not (directory / name).exists():
                raise PlotError(f"{directory}: the run has no {name}: {why}")
        gates = self.experiment.get("gates") or {}
        self.scene_unit = float(gates.get("scene_unit_m") or 1)
        self.gate_unit = METRES.get(gates.get("unit", "scene"), self.scene_unit)
        try:
            self._read_fit(directory / "final.h5")
        except InputError:
            raise
        except (OSError, KeyError, ValueError, TypeError, IndexError) as error:
            reason = str(error).strip("'\"")
            raise PlotError(f"{directory / 'final.h5'}: cannot be read: {reason}") from error
        self.counts = self._read_counts(directory / "target.exr")
        self._read_readings()
        self._read_parameters()
        self._read_surfaces()

    def _read_fit(self, path):
        capture = read_capture(path)
        self.mirrored = capture.points.size == 3 and capture.laser is not None and capture.laser.size > 3
        if self.mirrored:
            capture = mirrored(capture)
        light, points = capture.counts, capture.points
        behind = points.ndim - 1
        self.spots = int(np.prod(light.shape[1:-behind]))
        first = (slice(None),) + (0,) * (light.ndim - 1 - behind)
        self.fit = light[first].reshape(len(light), points.shape[0], -1)
        self.points = points.reshape(points.shape[0], -1, 3)
        self.delta, self.start = capture.delta_t, capture.t_start
        laser = (points if capture.laser is None else capture.laser).reshape(-1, 3)
        origins = capture.origins
        flat = self.points.reshape(-1, 3)
        self.confocal = self.spots == 1 and laser.shape == flat.shape and np.allclose(laser, flat)
        self.laser = self.points if self.confocal else np.broadcast_to(laser[0], self.points.shape)
        # Lengths count from the wall; where times do from laser and detector, these ways are to be taken off.
        self.extra = np.zeros(self.points.shape[:2])
        if origins:
            self.extra = sum(np.linalg.norm(ends - origin, axis=-1)
                             for ends, origin in zip((self.laser, self.points), origins))
        self.wall = Wall.of(capture)
        self.lengths = self.start + self.delta * np.arange(len(self.fit) + 1)  # borders of the bins
        self.times = self.lengths / METRES_PER_PS

    def _read_counts(self, path):
        """The target as the fit saw it: a measurement's bins may be several of its file's, and a rendering has none."""
        bins, columns, rows = self.fit.shape
        try:
            images = exr.read(path)
        except OSError as error:
            raise PlotError(f"{path}: {error}") from error
        names = {int(n[4:-2]): n for n in images if re.fullmatch(r"gate\d+\.Y", n)}
        if self.mirrored:
            images = {name: image.T for name, image in images.items()}
        image = images[names[0]] if 0 in names else np.empty((0, 0))
        if sorted(names) != list(range(bins)) or image.shape != (rows * self.spots, columns):
            raise PlotError(f"{path}: not {bins} gates of {columns} x {rows * self.spots} readings, as final.h5 has")
        return np.stack([images.pop(names[g])[:rows].T for g in range(bins)]).astype(np.float32)

    def _read_readings(self):
        """Which points and bins the fit used."""
        target = self.experiment.get("target") or {}
        self.used_points = np.ones(self.points.shape[:2], bool)
        self.used_bins = np.ones(len(self.fit), bool)
        if target.get("mask") and not self.mirrored:
            path = self.directory / target["mask"]
            try:
                self.used_points = np.load(path) != 0
            except (OSError, ValueError) as error:
                raise PlotError(f"{path}: cannot be read: {error}") from error
            if self.used_points.shape != self.points.shape[:2] or not self.used_points.any():
                raise PlotError(f"{path}: does not fit the sensor points, or leaves none")
        if target.get("histograms"):  # others are not rendered, and black
            self.used_points &= self.fit.any(axis=0)
        if target.get("window"):
            first, last = numbers(target["window"]) * self.scene_unit
            centres = (self.lengths[1:] + self.lengths[:-1]) / 2
            self.used_bins = (centres >= first) & (centres <= last)

    def _read_parameters(self):
        """Final values by name: those that summary.yaml gives, or, of a run that is under way, the checkpoint's."""
        self.summary, self.values = read_values(self.directory)
        try:
            self.specs = {spec["name"]: spec for spec in self.experiment.get("parameters") or []}
            self.unknowns = sum(len(v) for v in self.values.values())
            offsets = [n for n, s in self.specs.items() if s.get("type") == "time_offset" and n in self.values]
            self.time_offset = sum(float(self.values[n][0]) for n in offsets) * self.gate_unit
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise PlotError(f"{self.directory}: the parameters cannot be read: {error}") from error

    @property
    def delay(self):
        """By how much of path length light is counted late: the time offset, and where the response peaks."""
        response = (self.experiment.get("gates") or {}).get("response")
        if not isinstance(response, dict):
            return self.time_offset
        peak = np.argmax(numbers(response["values"]))
        return self.time_offset + numbers(response["offsets"])[peak] * self.gate_unit

    def unit_of(self, name):
        """Of a parameter's values, for labels."""
        kind = self.specs.get(name, {}).get("type")
        if kind == "time_offset":
            unit = (self.experiment.get("gates") or {}).get("unit", "scene")
            return f" {unit}" if unit in METRES else ""
        return "°" if kind in ("rotation", "camera_rotation") else ""

    def _read_surfaces(self):
        """Shapes that moved, of which the run wrote meshes; and those that were painted where the scene has them."""
        paints = {str(spec.get("shape")): name for name, spec in self.specs.items()
                  if spec.get("type") == "albedo" and spec.get("per") == "vertex" and name in self.values}
        self.surfaces = []
        for path in sorted((self.directory / "geometry").glob("final_*")):
            name = path.stem.removeprefix("final_")
            shape = next((s for s in paints if name_in_files(s) == name), name)
            self._add_surface(path, shape, read_run_mesh(path), paints.pop(shape, None))
        moved = {name for spec in self.specs.values() if spec.get("type") != "albedo" for name in names_of(spec.get("shape"))}
        for shape, paint in paints.items():
            path, transform = self._find_shape(shape)
            if path is not None and shape not in moved:
                self._add_surface(path, shape, read_scene_mesh(path, transform), paint)

    def _find_shape(self, name):
        """File and transform of a shape of the scene; None where there is none."""
        scene = self.directory / str(self.experiment.get("scene", ""))
        if scene.is_file():
            for entry in read_yaml(scene).get("shapes") or []:
                path = scene.parent / str(entry.get("file", ""))
                if str(entry.get("name")) == name:
                    return path, entry.get("transform") or {}
        return None, {}

    def _add_surface(self, path, name, mesh, paint):
        points, triangles = mesh
        albedo = self.values[paint] if paint else None
        if albedo is not None and len(albedo) != len(points):
            raise PlotError(f"{path}: {len(points)} vertices, but {len(albedo)} albedos in {paint}")
        self.surfaces.append(Surface(name, self.wall.place(points * self.scene_unit), triangles, albedo))


def is_capture(directory, experiment):
    """Whether the experiment's scene is one of a capture, as far as its file can tell."""
    scene = directory / pathlib.PurePath(str(experiment.get("scene", "")))
    if not scene.is_file():
        return (directory / "final.h5").exists()
    try:
        return "capture" in read_yaml(scene)
    except PlotError:
        return False
