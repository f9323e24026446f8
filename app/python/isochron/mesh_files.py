"""Files of meshes: OBJ, PLY, OFF and STL, text or binary, also as a scene places them."""

import pathlib
import re
import struct
from dataclasses import dataclass, field

import numpy as np

from isochron.errors import InputError


@dataclass
class Polygons:
    """`points` [N, 3] and `faces`, lists of numbers of points that run counter-clockwise seen from the outside, or an array
    where all are as long. Where the file gives normals, they are `normals` [M, 3], and `corners` are numbers of them, as
    faces are of points. `values` are what a PLY file says beside that of its vertices: name -> [N]."""

    points: np.ndarray
    faces: list | np.ndarray
    normals: np.ndarray | None = None
    corners: list | np.ndarray | None = None
    values: dict = field(default_factory=dict)

    def triangles(self):
        """[M, 3], of polygons cut as the program does: from their first corner where they are convex, else so that the area is
        least, which loses none, concave or bent."""
        if isinstance(self.faces, np.ndarray) and self.faces.shape[1] == 3:
            return self.faces
        sizes = np.array([len(face) for face in self.faces])
        cut = [None] * len(sizes)
        for size in np.unique(sizes):
            chosen = np.flatnonzero(sizes == size)
            corners = np.array([self.faces[face] for face in chosen])
            for face, own, is_convex in zip(chosen, corners, _convex(self.points[corners])):
                fan = is_convex or size == 3
                cut[face] = [(0, i, i + 1) for i in range(1, size - 1)] if fan else _least_area(self.points[own])
                cut[face] = own[np.array(cut[face])]
        return np.concatenate(cut)


def _convex(polygons):
    """Whether polygons [K, corners, 3] are strictly convex along the axis nearest to their normals."""
    points = polygons - polygons[:, :1]
    normals = np.cross(points, np.roll(points, -1, axis=1)).sum(axis=1)
    axis = np.abs(normals).argmax(axis=1)
    rows = np.arange(len(points))
    flat = np.stack([points[rows, :, (axis + i) % 3] for i in (1, 2)], axis=2)
    side = np.roll(flat, -1, axis=1) - flat
    following = np.roll(side, -1, axis=1)
    turn = (side[..., 0] * following[..., 1] - side[..., 1] * following[..., 0]) * np.sign(normals[rows, axis])[:, None]
    angle = np.arctan2(turn, (side * following).sum(axis=2)).sum(axis=1)
    return (turn > 0).all(axis=1) & (angle < 3 * np.pi)  # once round


def _least_area(points):
    """The triangles, of numbers of corners, of least area among those with the fewest that have as good as none."""
    count = len(points)
    flat_costs = 4 * count * (np.ptp(points, axis=0) ** 2).sum()  # more than all areas together
    cost, tips = np.zeros((count, count)), np.zeros((count, count), int)
    for span in range(2, count):
        for first in range(count - span):
            last = first + span
            between = np.arange(first + 1, last)
            a, b = points[between] - points[first], points[last] - points[first]
            area = np.linalg.norm(np.cross(a, b), axis=1)
            longest = np.maximum(np.maximum((a * a).sum(axis=1), ((a - b) ** 2).sum(axis=1)), b @ b)
            all_costs = cost[first, between] + cost[between, last] + area + flat_costs * (area <= 1e-6 * longest)
            best = all_costs.argmin()
            cost[first, last], tips[first, last] = all_costs[best], between[best]
    triangles, left = [], [(0, count - 1)]
    while left:
        first, last = left.pop()
        if last - first > 1:
            tip = tips[first, last]
            triangles.append((first, tip, last))
            left += [(first, tip), (tip, last)]
    return triangles


def read_polygons(path, kind=None):
    """A file as it is. `kind`: obj, ply, off or stl in place of the name's end. Raises InputError."""
    path = pathlib.Path(path)
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
    """Vertices [N, 3] as a file counts them and triangles [M, 3]. Raises InputError."""
    mesh = read_polygons(path)
    return mesh.points, mesh.triangles()


def read_run_mesh(path):
    """A mesh that a run wrote, with the vertices alone that have a face: those that parameters have values for."""
    return read_run_surface(path)[:2]


def read_run_surface(path):
    """As read_run_mesh, and what the file says of these vertices: name -> [N], such as `albedo`."""
    mesh = read_polygons(path)
    triangles = mesh.triangles()
    used, renumbered = np.unique(triangles, return_inverse=True)
    return mesh.points[used], renumbered.reshape(triangles.shape), {name: each[used] for name, each in mesh.values.items()}


def read_vertex_values(path, name):
    """A property of a PLY file's vertices [N], as the file counts them. Raises InputError, also where there is none."""
    values = read_polygons(path).values
    if name not in values:
        raise InputError(f"{path}: vertices have no property '{name}' (there are: {', '.join(values) or 'none'})")
    return values[name]


def write_ply(path, points, triangles):
    """A binary file of vertices [N, 3], as doubles, and triangles [M, 3], which `path` names."""
    coordinates = "".join(f"property double {axis}\n" for axis in "xyz")
    faces = np.empty(len(triangles), [("size", "u1"), ("corners", "<i4", 3)])
    faces["size"], faces["corners"] = 3, triangles
    with open(path, "wb") as file:
        file.write((f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{coordinates}"
                    f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n").encode())
        np.ascontiguousarray(points, "<f8").tofile(file)
        faces.tofile(file)


def name_in_files(shape):
    """A shape's name as in the names of a run's meshes: without letters that file systems may not have."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", shape)


def read_scene_mesh(path, transform):
    """A mesh of a scene where it is there, with the vertices that the program takes: those at one position are one, those
    without a face none."""
    from scipy.spatial.transform import Rotation  # takes long to load

    points, triangles = read_mesh(path)
    cell = np.abs(points[np.unique(triangles)]).max() * 2.0**-44 or 1  # rounding in double precision
    _, first, inverse = np.unique(np.round(points / cell) + 0.0, axis=0, return_index=True, return_inverse=True)
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


MARK = b"\xef\xbb\xbf"


def _lines(data, comment=None, continued=False):
    """Number and words of each line that has some, whether it ends in LF, CR or CRLF. `continued`: a line that ends in a
    backslash goes on in the next one."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError("is text in UTF-16 (allowed: UTF-8)")
    begun = None
    for number, line in enumerate(re.split(b"\r\n|\r|\n", data), 1):
        while line.startswith(MARK):
            line = line[len(MARK):]
        text = line.decode("utf-8", "replace")
        text = (text.partition(comment)[0] if comment else text).rstrip()
        first, before = begun or (number, "")
        begun = (first, f"{before}{text[:-1]} ") if continued and text.endswith("\\") else None
        words = (before + text).split()
        if words and not begun:
            yield first, words
    if begun and begun[1].split():
        yield begun[0], begun[1].split()


def _number(word):
    if "_" in word:  # which Python takes between digits
        raise ValueError
    return float(word)


def _read_obj(data):
    points, normals, faces, corners = [], [], [], []
    for number, words in _lines(data, "#", continued=True):
        try:
            if words[0] == "v":
                points.append([_number(words[i]) for i in (1, 2, 3)])
            elif words[0] == "vn":
                normals.append([_number(words[i]) for i in (1, 2, 3)])
            elif words[0] in ("f", "fo"):
                parts = [word.split("/") for word in words[1:]]
                faces.append([_counted(part[0], len(points)) for part in parts])
                has_normals = all(len(part) == 3 and part[2] for part in parts)
                corners.append([_counted(part[2], len(normals)) for part in parts] if has_normals else None)
        except (ValueError, IndexError):
            raise InputError(f"line {number}: '{' '.join(words)}' is not understood") from None
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
    data = data.removeprefix(MARK)
    first = re.match(rb"ply[ \t]*(\r\n|\r|\n)", data)
    # In a file whose lines end in CR alone a LF behind the header is of the data.
    end = first and re.search(rb"[\r\n][ \t]*end_header[^\r\n]*" + (rb"\r" if first[1] == b"\r" else rb"(\r\n|\r|\n)"), data)
    if not end:
        raise InputError("is no PLY file")
    end = end.end()
    header = [words for _, words in _lines(data[:end])]
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
    places = [f"{kind}{axis}" for kind in ("", "n") for axis in "xyz"]
    values = {name: np.array(vertices[name], float) for name, kind in next(properties for element, _, properties in elements if element == "vertex")
              if not isinstance(kind, list) and name not in places}
    if "nx" not in vertices:
        return Polygons(points, faces, values=values)
    normals = np.stack([vertices["n" + axis] for axis in "xyz"], axis=1).astype(float)
    return Polygons(points, faces, normals, faces, values)


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
    """A line for each row; what a row does not take of it is passed over."""

    def __init__(self, data):
        self.rows = _lines(data)

    def table(self, count, properties):
        table = {name: [] for name, _ in properties}
        for _ in range(count):
            words = iter(next(self.rows)[1])
            for name, kind in properties:
                if isinstance(kind, list):
                    table[name].append([_number(next(words)) for _ in range(int(next(words)))])
                else:
                    table[name].append(_number(next(words)))
        return table


OFF = re.compile("(off|coff|noff|cnoff|stoff|stcoff|stnoff|stcnoff)?([0-9]+)?$", re.IGNORECASE)


def _read_off(data):
    lines = (words for _, words in _lines(data, "#"))
    first, *counts = next(lines)
    header = OFF.match(first)
    if not header or first.startswith("nOFF"):
        raise InputError("does not begin with OFF")
    counts = [header[2], *counts] if header[2] else counts or next(lines)
    points, faces = (int(word) for word in counts[:2])
    points = np.array([[_number(row[i]) for i in (0, 1, 2)] for row in (next(lines) for _ in range(points))]).reshape(-1, 3)
    return Polygons(points, [_off_face(next(lines)) for _ in range(faces)])


def _off_face(words):
    count = int(words[0])
    if len(words) <= count:
        raise ValueError
    return [int(word) for word in words[1:1 + count]]


STL_FACE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
STL_NAMES = re.compile("(end ?)?solid.*", re.IGNORECASE)


def _read_stl(data):
    """Three points of each triangle, as they stand there."""
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    size = 84 + count * STL_FACE.itemsize
    if len(data) >= 84 and len(data) >= size:
        if len(data) >= size + STL_FACE.itemsize and data[size:].strip(b"\0"):
            raise InputError(f"{len(data) - size} bytes follow the {count} facets that its header states")
        points = np.frombuffer(data, STL_FACE, count, offset=84)["corners"].reshape(-1, 3).astype(float)
    else:
        lines = [" ".join(words).lower() for _, words in _lines(data)]
        if b"\0" in data or not lines or not lines[0].startswith("solid"):
            raise InputError("is no STL file")
        words = " ".join(STL_NAMES.sub("", line) for line in lines).split()
        places = [i for i, word in enumerate(words) if word == "vertex"]
        points = np.array([[_number(words[i + k]) for k in (1, 2, 3)] for i in places]).reshape(-1, 3)
    return Polygons(points, np.arange(len(points)).reshape(-1, 3))


READERS = {"obj": _read_obj, "ply": _read_ply, "off": _read_off, "stl": _read_stl}
