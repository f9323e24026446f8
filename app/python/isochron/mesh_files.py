"""Files of meshes: OBJ, PLY, OFF and STL, text or binary, also as a scene places them."""

import re
import struct
from dataclasses import dataclass

import numpy as np

from isochron.errors import InputError


@dataclass
class Polygons:
    """`points` [N, 3] and `faces`, lists of numbers of points that run counter-clockwise seen from the outside, or an array
    where all are as long. Where the file gives normals, they are `normals` [M, 3], and `corners` are numbers of them, as
    faces are of points."""

    points: np.ndarray
    faces: list | np.ndarray
    normals: np.ndarray | None = None
    corners: list | np.ndarray | None = None

    def triangles(self):
        """[M, 3]; what has more corners is cut from its first one."""
        if isinstance(self.faces, np.ndarray) and self.faces.shape[1] == 3:
            return self.faces
        return np.array([(face[0], a, b) for face in self.faces for a, b in zip(face[1:], face[2:])], int).reshape(-1, 3)


def read_polygons(path, kind=None):
    """A file as it is. `kind`: obj, ply, off or stl in place of the name's end. Raises InputError."""
    kind = kind or path.suffix[1:]
    if kind not in READERS:
        raise InputError(f"{path}: '.{kind}' is no kind of mesh (allowed: {', '.join('.' + k for k in READERS)})")
    try:
        mesh = READERS[kind](path.read_bytes())
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except (KeyError, ValueError, IndexError, StopIteration, RuntimeError, struct.error):
        raise InputError(f"{path}: is damaged") from None
    if not len(mesh.faces) or min(map(len, mesh.faces)) < 3 or not np.isfinite(mesh.points).all():
        raise InputError(f"{path}: has no faces, or points that are not finite")
    corners = mesh.faces if isinstance(mesh.faces, np.ndarray) else np.concatenate(mesh.faces)
    if corners.min() < 0 or corners.max() >= len(mesh.points):
        raise InputError(f"{path}: a face has a corner that is not there")
    return mesh


def read_mesh(path):
    """Vertices [N, 3] and triangles [M, 3] of a file. Raises InputError."""
    mesh = read_polygons(path)
    return mesh.points, mesh.triangles()


def name_in_files(shape):
    """A shape's name as in the names of a run's meshes: without letters that file systems may not have."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", shape)


def read_scene_mesh(path, transform):
    """A mesh as the program numbers its vertices: rounded to float, those at one position are one, those without a face
    none."""
    from scipy.spatial.transform import Rotation  # takes long to load

    points, triangles = read_mesh(path)
    points = points.astype(np.float32).astype(float)
    _, first, inverse = np.unique(points + 0.0, axis=0, return_index=True, return_inverse=True)
    triangles = first[inverse.ravel()][triangles]
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    kept = np.unique(triangles)
    points, triangles = points[kept], np.searchsorted(kept, triangles)
    points = points * float(transform.get("scale", 1))
    if "rotate" in transform:
        axis = np.asarray(transform["rotate"]["axis"], float)
        turn = np.radians(float(transform["rotate"]["degrees"])) / np.linalg.norm(axis)
        points = Rotation.from_rotvec(turn * axis).apply(points)
    return points + np.asarray(transform.get("translate", (0, 0, 0)), float), triangles


def _read_obj(data):
    points, normals, faces, corners = [], [], [], []
    for number, line in enumerate(data.decode("utf-8", "replace").splitlines(), 1):
        words = line.split()
        try:
            if words[:1] == ["v"]:
                points.append([float(word) for word in words[1:4]])
            elif words[:1] == ["vn"]:
                normals.append([float(word) for word in words[1:4]])
            elif words[:1] == ["f"]:
                parts = [word.split("/") for word in words[1:]]
                faces.append([_counted(part[0], len(points)) for part in parts])
                has_normals = all(len(part) == 3 and part[2] for part in parts)
                corners.append([_counted(part[2], len(normals)) for part in parts] if has_normals else None)
        except ValueError:
            raise InputError(f"line {number}: '{line.strip()}' is not understood") from None
    if max((max(c) for c in corners if c), default=-1) >= len(normals):
        raise InputError("a face has a corner that is not there")
    points = np.array(points, float).reshape(-1, 3)
    return Polygons(points, faces, np.array(normals, float), corners) if faces and all(corners) else Polygons(points, faces)


def _counted(word, count):
    number = int(word)
    if number == 0 or number < -count:
        raise ValueError
    return number - 1 if number > 0 else count + number


PLY_TYPES = {"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
             "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
             "double": "f8", "float64": "f8"}
PLY_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def _read_ply(data):
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise InputError("is no PLY file")
    end = data.index(b"\n", end) + 1
    header = [line.split() for line in data[:end].decode("ascii", "replace").splitlines()]
    order, elements = None, []
    for words in header:
        if words[:1] == ["format"]:
            order = PLY_ORDERS[words[1]]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append((words[-1], [PLY_TYPES[kind] for kind in words[2:-1]] if words[1] == "list"
                                    else PLY_TYPES[words[1]]))
    read = _TextRows(data[end:]) if order == "" else _BinaryRows(data, end, order)
    tables = {name: read.table(count, properties) for name, count, properties in elements}
    vertices, faces = tables["vertex"], tables["face"]
    points = np.stack([vertices[axis] for axis in "xyz"], axis=1).astype(float)
    faces = faces["vertex_indices" if "vertex_indices" in faces else "vertex_index"]
    faces = faces.astype(int) if isinstance(faces, np.ndarray) else [np.asarray(face, int).tolist() for face in faces]
    if "nx" not in vertices:
        return Polygons(points, faces)
    normals = np.stack([vertices["n" + axis] for axis in "xyz"], axis=1).astype(float)
    return Polygons(points, faces, normals, faces)


class _BinaryRows:
    def __init__(self, data, offset, order):
        self.data, self.offset, self.order = data, offset, order

    def values(self, kind, count):
        values = np.frombuffer(self.data, kind if isinstance(kind, list) else self.order + kind, count, self.offset)
        self.offset += values.nbytes
        return values

    def table(self, count, properties):
        """Columns by name: arrays, or lists of arrays where a list's length changes from row to row."""
        lists = [name for name, kind in properties if isinstance(kind, list)]
        if len(lists) < 2 and (rows := self.even_rows(count, properties)) is not None:
            return {name: rows[name] for name, _ in properties}
        table = {name: [] for name, _ in properties}
        for _ in range(count):
            for name, kind in properties:
                if isinstance(kind, list):
                    table[name].append(self.values(kind[1], int(self.values(kind[0], 1)[0])))
                else:
                    table[name].append(self.values(kind, 1)[0])
        return table

    def even_rows(self, count, properties):
        """All rows at once where lists are as long as that of the first one; else None, and nothing is read."""
        start, kinds, lengths = self.offset, [], {}
        for name, kind in properties:
            if isinstance(kind, list):
                before = sum(np.dtype(k[1]).itemsize for k in kinds)
                lengths[name] = int(np.frombuffer(self.data, self.order + kind[0], 1, start + before)[0]) if count else 0
                kinds += [(f"{name} count", self.order + kind[0]), (name, self.order + kind[1], lengths[name])]
            else:
                kinds.append((name, self.order + kind))
        if start + count * np.dtype(kinds).itemsize > len(self.data):
            return None
        rows = self.values(kinds, count)
        if any((rows[f"{name} count"] != length).any() or length < 2 for name, length in lengths.items()):
            self.offset = start
            return None
        return rows


class _TextRows:
    def __init__(self, data):
        self.words = iter(data.split())

    def table(self, count, properties):
        table = {name: [] for name, _ in properties}
        for _ in range(count):
            for name, kind in properties:
                if isinstance(kind, list):
                    table[name].append([float(next(self.words)) for _ in range(int(next(self.words)))])
                else:
                    table[name].append(float(next(self.words)))
        return table


def _read_off(data):
    lines = (line.split("#")[0].split() for line in data.decode("utf-8", "replace").splitlines())
    lines = iter([words for words in lines if words])
    header = next(lines)
    if header not in (["OFF"], ["COFF"], ["NOFF"], ["CNOFF"], ["STOFF"]):
        raise InputError("does not begin with OFF")
    points, faces = (int(word) for word in next(lines)[:2])
    points = np.array([[float(word) for word in next(lines)[:3]] for _ in range(points)]).reshape(-1, 3)
    return Polygons(points, [_off_face(next(lines)) for _ in range(faces)])


def _off_face(words):
    count = int(words[0])
    if len(words) <= count:
        raise ValueError
    return [int(word) for word in words[1:1 + count]]


STL_FACE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])


def _read_stl(data):
    """Three points of each triangle, as they stand there."""
    if len(data) >= 84 and len(data) == 84 + STL_FACE.itemsize * struct.unpack_from("<I", data, 80)[0]:
        points = np.frombuffer(data, STL_FACE, offset=84)["corners"].reshape(-1, 3).astype(float)
    else:
        if not data.lstrip().startswith(b"solid"):
            raise InputError("is no STL file")
        words = [line.split() for line in data.decode("utf-8", "replace").splitlines()]
        points = np.array([[float(x) for x in w[1:4]] for w in words if w[:1] == ["vertex"]]).reshape(-1, 3)
    return Polygons(points, np.arange(len(points)).reshape(-1, 3))


READERS = {"obj": _read_obj, "ply": _read_ply, "off": _read_off, "stl": _read_stl}
