"""Meshes that runs write: PLY (binary, little-endian, doubles) and OBJ; and those of scenes, where they are such files."""

import re

import numpy as np
from scipy.spatial.transform import Rotation

from isochron.pictures.reading import PlotError

PLY_VERTEX = ["property double x", "property double y", "property double z"]
PLY_FACE = np.dtype([("count", "u1"), ("vertices", "<i4", 3)])


def _read_ply(data):
    head, _, body = data.partition(b"end_header\n")
    lines = head.decode("ascii").split("\n")
    counts = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element ")}
    if "format binary_little_endian 1.0" not in lines or [l for l in lines if " double " in l] != PLY_VERTEX:
        raise ValueError("not a PLY file as runs write them")
    points = np.frombuffer(body, "<f8", 3 * counts["vertex"]).reshape(-1, 3)
    faces = np.frombuffer(body, PLY_FACE, counts["face"], points.nbytes)
    if np.any(faces["count"] != 3):
        raise ValueError("a face is no triangle")
    return points, faces["vertices"].astype(int)


def _read_obj(data):
    lines = [line.split() for line in data.decode("utf-8").splitlines()]
    points = np.array([[float(x) for x in words[1:4]] for words in lines if words[:1] == ["v"]])
    faces = [[int(w.split("/")[0]) - 1 for w in words[1:]] for words in lines if words[:1] == ["f"]]
    triangles = [(face[0], a, b) for face in faces for a, b in zip(face[1:], face[2:])]
    return points.reshape(-1, 3), np.array(triangles, int).reshape(-1, 3)


def name_in_files(shape):
    """A shape's name as in the names of a run's meshes: without letters that file systems may not have."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", shape)


def read_mesh(path):
    """Vertices [N, 3] and triangles [M, 3] of a file."""
    try:
        points, triangles = (_read_ply if path.suffix == ".ply" else _read_obj)(path.read_bytes())
        if not len(points) or not len(triangles) or triangles.min() < 0 or triangles.max() >= len(points):
            raise ValueError("a triangle has no vertex")
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise PlotError(f"{path}: cannot be read: {error}") from error
    return points, triangles


def read_scene_mesh(path, transform):
    """A mesh as the program numbers its vertices: those at one position are one, those without a face none."""
    points, triangles = read_mesh(path)
    _, first, inverse = np.unique(points + 0.0, axis=0, return_index=True, return_inverse=True)
    triangles = first[inverse][triangles]
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    kept = np.unique(triangles)
    points, triangles = points[kept], np.searchsorted(kept, triangles)
    points = points * float(transform.get("scale", 1))
    if "rotate" in transform:
        axis = np.asarray(transform["rotate"]["axis"], float)
        turn = np.radians(float(transform["rotate"]["degrees"])) / np.linalg.norm(axis)
        points = Rotation.from_rotvec(turn * axis).apply(points)
    return points + np.asarray(transform.get("translate", (0, 0, 0)), float), triangles
