"""Meshes: Mitsuba's primitives, OBJ and PLY files with their normals, and transforms of them.

A mesh has `points` [N, 3] and `faces`, lists of numbers of points that run counter-clockwise seen from the outside. Where
its file gives normals, they are `normals` [M, 3], and `corners` are lists of their numbers, as faces are of points.
"""

from dataclasses import dataclass

import numpy as np
from scenes import mesh as solids

from . import matrices

BENT = np.cos(np.radians(1))  # less is rounding of the file's numbers


class MeshError(Exception):
    pass


@dataclass
class Mesh:
    points: np.ndarray
    faces: list
    normals: np.ndarray | None = None
    corners: list | None = None
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


def read_obj(path):
    points, normals, faces, corners = [], [], [], []
    with open(path, encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            words = line.split()
            try:
                if words[:1] == ["v"]:
                    points.append([float(word) for word in words[1:4]])
                elif words[:1] == ["vn"]:
                    normals.append([float(word) for word in words[1:4]])
                elif words[:1] == ["f"]:
                    parts = [word.split("/") for word in words[1:]]
                    faces.append([counted(part[0], len(points)) for part in parts])
                    has_normals = all(len(part) == 3 and part[2] for part in parts)
                    corners.append([counted(part[2], len(normals)) for part in parts] if has_normals else None)
            except ValueError:
                raise MeshError(f"line {number}: '{line.strip()}' is not understood") from None
    largest = max((max(face) for face in faces), default=-1)
    if largest >= len(points) or max((max(c) for c in corners if c), default=-1) >= len(normals):
        raise MeshError("a face has a corner that is not there")
    points = np.array(points, float).reshape(-1, 3)
    return Mesh(points, faces, np.array(normals, float), corners) if faces and all(corners) else Mesh(points, faces)


def counted(word, count):
    number = int(word)
    if number == 0 or number < -count:
        raise ValueError
    return number - 1 if number > 0 else count + number


PLY_TYPES = {"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
             "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
             "double": "f8", "float64": "f8"}


def read_ply(path):
    data = path.read_bytes()
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise MeshError("is no PLY file")
    end = data.index(b"\n", end) + 1
    header = [line.split() for line in data[:end].decode("ascii", "replace").splitlines()]
    order, elements = None, []
    for words in header:
        if words[:1] == ["format"]:
            order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append((words[-1], [PLY_TYPES[kind] for kind in words[2:-1] or words[1:-1]]
                                    if words[1] == "list" else PLY_TYPES[words[1]]))
    read = AsciiRows(data[end:]) if order == "" else BinaryRows(data, end, order)
    tables = {name: read.table(count, properties) for name, count, properties in elements}
    vertices, faces = tables["vertex"], tables["face"]
    points = np.stack([vertices[axis] for axis in "xyz"], axis=1).astype(float)
    name = "vertex_indices" if "vertex_indices" in faces else "vertex_index"
    faces = [np.asarray(face, int).tolist() for face in faces[name]]
    if faces and not 0 <= min(map(min, faces)) <= max(map(max, faces)) < len(points):
        raise MeshError("a face has a corner that is not there")
    if "nx" not in vertices:
        return Mesh(points, faces)
    normals = np.stack([vertices["n" + axis] for axis in "xyz"], axis=1).astype(float)
    return Mesh(points, faces, normals, faces)


class BinaryRows:
    def __init__(self, data, offset, order):
        self.data, self.offset, self.order = data, offset, order

    def values(self, kind, count):
        values = np.frombuffer(self.data, self.order + kind, count, self.offset)
        self.offset += values.nbytes
        return values

    def table(self, count, properties):
        if all(isinstance(kind, str) for _, kind in properties):
            rows = np.frombuffer(self.data, [(name, self.order + kind) for name, kind in properties], count, self.offset)
            self.offset += rows.nbytes
            return {name: rows[name] for name, _ in properties}
        table = {name: [] for name, _ in properties}
        for _ in range(count):
            for name, kind in properties:
                length = 1 if isinstance(kind, str) else int(self.values(kind[0], 1)[0])
                table[name].append(self.values(kind if isinstance(kind, str) else kind[1], length))
        return table


class AsciiRows:
    def __init__(self, data):
        self.words = iter(data.split())

    def table(self, count, properties):
        table = {name: [] for name, _ in properties}
        for _ in range(count):
            for name, kind in properties:
                if isinstance(kind, str):
                    table[name].append(float(next(self.words)))
                else:
                    length = int(next(self.words))
                    table[name].append([float(next(self.words)) for _ in range(length)])
        return table


def read(path, reader):
    try:
        mesh = reader(path)
    except (KeyError, ValueError, IndexError, StopIteration, RuntimeError):
        raise MeshError("is damaged") from None
    if not mesh.faces or min(map(len, mesh.faces)) < 3 or not np.isfinite(mesh.points).all():
        raise MeshError("has no faces, or points that are not finite")
    return mesh


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
    lines += ["v " + " ".join(f"{x + 0.0:.9g}" for x in point) for point in mesh.points]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in mesh.faces]
    return "\n".join(lines) + "\n"
