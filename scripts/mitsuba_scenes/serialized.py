"""Mitsuba's own files of meshes, `serialized`, versions 3 and 4: several meshes, each compressed by itself."""

import struct
import zlib

import numpy as np
from isochron.errors import InputError
from isochron.mesh_files import Polygons

MAGIC = 0x041C
NORMALS, TEXTURE_COORDINATES, COLOURS, FACE_NORMALS, DOUBLE = 0x1, 0x2, 0x8, 0x10, 0x2000


def read(path, index):
    """The mesh with this number, and whether its facets are flat. Raises InputError."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    try:
        start, version = place_of(data, path, index)
        return unpacked(zlib.decompressobj().decompress(data[start + 4 :]), version)
    except InputError:
        raise
    except (struct.error, ValueError, zlib.error):
        raise InputError(f"{path}: is damaged") from None


def place_of(data, path, index):
    """Where the mesh begins, and the file's version."""
    magic, version = struct.unpack_from("<HH", data)
    if magic != MAGIC or version not in (3, 4):
        raise InputError(f"{path}: is no serialized mesh of version 3 or 4")
    (count,) = struct.unpack_from("<I", data, len(data) - 4)
    if not 0 <= index < count:
        raise InputError(f"{path}: shape_index {index} of {count} meshes")
    kind, size = ("Q", 8) if version == 4 else ("I", 4)
    (start,) = struct.unpack_from("<" + kind, data, len(data) - 4 - size * (count - index))
    if struct.unpack_from("<HH", data, start) != (magic, version):
        raise ValueError
    return start, version


def unpacked(data, version):
    (flags,) = struct.unpack_from("<I", data)
    at = 4 if version == 3 else data.index(b"\0", 4) + 1  # behind its name
    vertices, triangles = struct.unpack_from("<QQ", data, at)
    at += 16
    number = np.dtype("<f8" if flags & DOUBLE else "<f4")

    def rows(kind, count, columns):
        nonlocal at
        found = np.frombuffer(data, kind, count * columns, at).reshape(count, columns)
        at += found.nbytes
        return found

    points = rows(number, vertices, 3).astype(float)
    normals = rows(number, vertices, 3).astype(float) if flags & NORMALS else None
    for flag, columns in ((TEXTURE_COORDINATES, 2), (COLOURS, 3)):
        if flags & flag:
            rows(number, vertices, columns)
    faces = rows("<u4" if vertices <= 0xFFFFFFFF else "<u8", triangles, 3).astype(int)
    if not len(faces) or faces.max() >= vertices or not np.isfinite(points).all():
        raise ValueError
    return Polygons(points, faces, normals, None if normals is None else faces), bool(flags & FACE_NORMALS)
