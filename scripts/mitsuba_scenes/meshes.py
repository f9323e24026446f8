"""Meshes: Mitsuba's primitives, OBJ and PLY files with their normals, and transforms of them."""

from dataclasses import dataclass

import numpy as np
from isochron.mesh_files import Polygons, read_polygons
from scenes import mesh as solids

from . import matrices

BENT = np.cos(np.radians(1))  # less is rounding of the file's numbers


@dataclass
class Mesh(Polygons):
    flat: bool = True  # Mitsuba shades its facets flat, as we do

    def by_size(self):
        """Faces of one size at a time: their numbers and their points' numbers, [K, size]."""
        sizes = np.array([len(face) for face in self.faces])
        for size in np.unique(sizes):
            chosen = np.flatnonzero(sizes == size)
            yield chosen, np.array([self.faces[face] for face in chosen])

    def face_normals(self):
        """Of unit length; zero where a face has no area."""
        result = np.empty((len(self.faces), 3))
        for chosen, faces in self.by_size():
            p = self.points[faces] - self.points[faces[:, :1]]
            result[chosen] = np.cross(p[:, 1:-1], p[:, 2:]).sum(axis=1)
        return unit(result)


def unit(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def of_arrays(mesh):
    vertices, triangles = mesh
    return Mesh(np.asarray(vertices, float), [list(triangle) for triangle in np.asarray(triangles).tolist()])


def rectangle():
    return Mesh(solids.square(2)[0], [[0, 1, 2, 3]])


def cube():
    return of_arrays(solids.box(2))


def disk(fineness):
    angles = 2 * np.pi * np.arange(4 << fineness) / (4 << fineness)
    return Mesh(np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1), [list(range(len(angles)))])


def cylinder(fineness):
    """Around the z axis from 0 to 1, open at both ends."""
    ring = disk(fineness).points
    sides = len(ring)
    faces = [[i, (i + 1) % sides, sides + (i + 1) % sides, sides + i] for i in range(sides)]
    return Mesh(np.concatenate([ring, ring + (0, 0, 1)]), faces)


def sphere(fineness):
    """20 * 4^fineness triangles with corners on the unit sphere."""
    points, triangles = solids.icosphere()
    for _ in range(fineness - 1):
        ends = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        edges, index = np.unique(ends, axis=0, return_inverse=True)
        ab, bc, ca = (index.reshape(3, -1) + len(points))
        a, b, c = triangles.T
        middles = points[edges].mean(axis=1)
        points = np.concatenate([points, middles / np.linalg.norm(middles, axis=1, keepdims=True)])
        triangles = np.concatenate([np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return of_arrays((points, triangles))


def read(path, kind):
    """A file of Mitsuba's shapes `obj` and `ply`. Raises InputError."""
    return of_polygons(read_polygons(path, kind))


def of_polygons(found):
    faces = [list(face) for face in found.faces]
    return Mesh(found.points, faces, found.normals, faces if found.corners is found.faces else found.corners)


def shaded_by_its_normals(mesh):
    """Mitsuba's front is where the normals at the corners point: faces turned accordingly. Without such normals it makes
    smooth ones."""
    normals = mesh.face_normals()
    if mesh.corners is None:
        mesh.flat = bool((np.abs(normals @ normals[0]) > BENT).all())
        return mesh
    faces, directions = list(mesh.faces), unit(mesh.normals)
    mesh.flat = True
    for chosen, _ in mesh.by_size():
        corners = np.array([mesh.corners[face] for face in chosen])
        along = np.einsum("fcx,fx->fc", directions[corners], normals[chosen])
        for face in chosen[along.sum(axis=1) < 0]:
            faces[face] = faces[face][::-1]
        mesh.flat &= bool((np.abs(along) > BENT).all())
    mesh.faces = faces
    return mesh


def transformed(mesh, matrix, flip):
    """A mirrored mesh keeps its outside, unless it is to be flipped."""
    mirrored = np.linalg.det(matrix[:3, :3]) < 0
    faces = [face[::-1] for face in mesh.faces] if mirrored != flip else mesh.faces
    return Mesh(matrices.points(matrix, mesh.points), faces, flat=mesh.flat)


def obj_text(mesh, comment):
    lines = [f"# {comment}"]
    lines += ["v " + " ".join(f"{x + 0.0:.15g}" for x in point) for point in mesh.points]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in mesh.faces]
    return "\n".join(lines) + "\n"
