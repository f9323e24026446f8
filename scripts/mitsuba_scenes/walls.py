"""The walls of captures: points that a detector looks at, and where a laser's ray meets the wall.

A wall has `shape`, `normal` (towards the detector), `points` (rows one after the other), `lines` (our keys) and hit().
"""

import numpy as np

from . import matrices
from .writing import vector_text

ON_PLANE = 1e-5  # of the largest coordinate: files hold single precision


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
        self.lines = [f"  sensor: {{corner: {corner}, across: {across}, down: {down}, size: [{film.width}, {film.height}]}}"]

    def point(self, u, v):
        """Of texture coordinates from 0 to 1."""
        return matrices.points(self.matrix, np.stack([2 * np.asarray(u) - 1, 2 * np.asarray(v) - 1, 0 * np.asarray(u)], -1))

    def hit(self, origin, direction):
        """Where a ray meets it, or none."""
        return next(iter(first_hits([self.shape], origin, [direction])[0]), None)


class SeenWall:
    """What a perspective camera sees, as long as that is flat; the detector looks along the middles of its pixels."""

    def __init__(self, shapes, sensor, film, slope, report):
        matrix = sensor.transform()
        self.origin, self.shapes = matrix[:3, 3], shapes
        x = slope * (1 - 2 * (np.arange(film.width) + 0.5) / film.width)
        y = slope * (film.height - 2 * np.arange(film.height) - 1) / film.width
        x, y = np.meshgrid(x, y)
        rays = matrices.directions(matrix, np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3))
        self.points, found, normals = first_hits(shapes, self.origin, rays)
        if not found:
            sensor.fail("sees no wall")
        if len(found) < len(rays):
            report.attempt(sensor.fail, f"{len(rays) - len(found)} of its {len(rays)} pixels see no wall")
        self.shape = found[0]
        heights = (self.points - self.points[0]) @ normals[0]
        if np.abs(heights).max() > ON_PLANE * np.abs(self.points).max():
            sensor.fail(f"it sees more than a flat wall: {', '.join(sorted({shape.name for shape in found}))}")
        self.normal = facing(self.shape, self.origin, normals[0], self.points[0])
        self.lines = ["  sensor: {points: [" + ", ".join(map(vector_text, self.points)) + "]}"]

    def hit(self, origin, direction):
        return next(iter(first_hits(self.shapes, origin, [direction])[0]), None)


def facing(shape, origin, normal, place):
    """The unit normal on the detector's side."""
    normal = normal / np.linalg.norm(normal)
    if normal @ (origin - place) >= -ON_PLANE * max(np.abs(origin).max(), np.abs(place).max()):
        return normal
    bsdf = shape.node.only("bsdf")
    if bsdf is None or bsdf.type != "twosided":
        shape.node.fail("turns its back to the detector")
    return -normal


def first_hits(shapes, origin, directions):
    """Of the rays that hit something: where first, the shapes there and their normals."""
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
    return points, [shape for shape in found if shape is not None], normals[hit]


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
