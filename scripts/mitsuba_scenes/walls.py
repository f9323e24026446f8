"""The walls of captures: points that a detector looks at, and where a laser's ray meets the wall.

A wall has `shape`, `normal` (towards the detector), `points` (rows one after the other), `lines` (our keys), hit() and, where
not all pixels look at it, `seen`: of each pixel whether it does.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from . import matrices
from .writing import vector_text

ON_PLANE = 1e-5  # of the largest coordinate: files hold single precision
COARSE = 1e-3  # planes that are counted as one, to find the wall


class Hits(NamedTuple):
    points: np.ndarray
    shapes: list
    normals: np.ndarray
    rays: np.ndarray


class RectangleWall:
    """A rectangle with an nlos_capture_meter: the film's pixels cover it, and the detector looks at their middles."""

    def __init__(self, shape, meter, matrix, film):
        self.shape, self.matrix = shape, matrix
        self.origin = meter.point("sensor_origin", np.zeros(3))
        self.normal = facing(shape, self.origin, shape.mesh.face_normals()[0], matrix[:3, 3])
        u, v = ((np.arange(size) + 0.5) / size for size in (film.width, film.height))
        self.points = self.point(*np.meshgrid(u, v)).reshape(-1, 3)
        across = self.points[film.width - 1] - self.points[0] if film.width > 1 else matrix[:3, 0]
        down = self.points[-film.width] - self.points[0] if film.height > 1 else matrix[:3, 1]
        corner, across, down = map(vector_text, (self.points[0], across, down))
        self.seen = None
        self.lines = [f"  sensor: {{corner: {corner}, across: {across}, down: {down}, size: [{film.width}, {film.height}]}}"]

    def point(self, u, v):
        """Of texture coordinates from 0 to 1."""
        return matrices.points(self.matrix, np.stack([2 * np.asarray(u) - 1, 2 * np.asarray(v) - 1, 0 * np.asarray(u)], -1))

    def hit(self, origin, direction):
        """Where a ray meets it, or none."""
        return next(iter(first_hits([self.shape], origin, [direction]).points), None)


class SeenWall:
    """The plane that most pixels of a perspective camera see; the detector looks along their middles. Pixels that see something
    else have the point of the next pixel that sees the wall, and are masked."""

    def __init__(self, shapes, sensor, film, slope, report):
        matrix = sensor.transform()
        self.origin, self.shapes = matrix[:3, 3], shapes
        x = slope * (1 - 2 * (np.arange(film.width) + 0.5) / film.width)
        y = slope * (film.height - 2 * np.arange(film.height) - 1) / film.width
        x, y = np.meshgrid(x, y)
        rays = matrices.directions(matrix, np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3))
        hits = first_hits(shapes, self.origin, rays)
        if not hits.shapes:
            sensor.fail("sees no wall")
        first, on_wall = most_seen_plane(hits)
        self.shape, places = hits.shapes[first], hits.points[on_wall]
        self.normal = facing(self.shape, self.origin, hits.normals[first], hits.points[first])
        self.seen = np.zeros(len(rays), bool)
        self.seen[hits.rays[on_wall]] = True
        pixels = np.stack(np.divmod(np.arange(len(rays)), film.width), axis=1)
        self.points = places[cKDTree(pixels[self.seen]).query(pixels)[1]]
        if self.seen.all():
            self.seen = None
        else:
            report.note(sensor.place, f"{sensor}: {(~self.seen).sum()} of its {len(rays)} pixels do not see the wall, "
                        f"{self.shape.name}: mask.npy masks them")
        self.lines = ["  sensor: {points: [" + ", ".join(map(vector_text, self.points)) + "]}"]

    def hit(self, origin, direction):
        return next(iter(first_hits(self.shapes, origin, [direction]).points), None)


def facing(shape, origin, normal, place):
    """The unit normal on the detector's side."""
    normal = normal / np.linalg.norm(normal)
    if normal @ (origin - place) >= -ON_PLANE * max(np.abs(origin).max(), np.abs(place).max()):
        return normal
    bsdf = shape.node.only("bsdf")
    if bsdf is None or bsdf.type != "twosided":
        shape.node.fail("turns its back to the detector")
    return -normal


def most_seen_plane(hits):
    """A hit on the plane that most hits lie on, and for each hit whether it lies there."""
    normals = hits.normals / np.linalg.norm(hits.normals, axis=1, keepdims=True)
    heights, size = (normals * hits.points).sum(axis=1), np.abs(hits.points).max()
    cells = np.round(np.column_stack([normals, heights / size]) / COARSE)
    _, first, counts = np.unique(cells, axis=0, return_index=True, return_counts=True)
    first = first[counts.argmax()]
    return first, np.abs((hits.points - hits.points[first]) @ normals[first]) <= ON_PLANE * size


def first_hits(shapes, origin, directions):
    """Of the rays that hit something: where first, the shapes there, their normals (of any length), and which rays they are."""
    directions = np.asarray(directions, float)
    nearest = np.full(len(directions), np.inf)
    found, normals = [None] * len(directions), np.zeros((len(directions), 3))
    for shape in shapes:
        for face in shape.mesh.faces:
            for b, c in zip(face[1:-1], face[2:]):
                first = shape.mesh.points[face[0]]
                edges = shape.mesh.points[b] - first, shape.mesh.points[c] - first
                distance = distances(origin - first, directions, *edges)
                for ray in np.flatnonzero(distance < nearest):
                    nearest[ray], found[ray], normals[ray] = distance[ray], shape, np.cross(*edges)
    hit = np.isfinite(nearest)
    points = origin + directions[hit] * nearest[hit, np.newaxis]
    return Hits(points, [shape for shape in found if shape is not None], normals[hit], np.flatnonzero(hit))


def distances(offset, directions, edge1, edge2):
    """Along rays from a point to a triangle, whose first corner is `offset` before it; infinite where they miss it. Borders
    belong to the triangle."""
    slack = 1e-9
    p = np.cross(directions, edge2)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / (p @ edge1)
        u = (p @ offset) * inverse
        q = np.cross(offset, edge1)
        v = (directions @ q) * inverse
        t = (q @ edge2) * inverse
        inside = (u >= -slack) & (v >= -slack) & (u + v <= 1 + slack) & (t >= 0)
    return np.where(inside, t, np.inf)
