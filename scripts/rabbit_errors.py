#!/usr/bin/python3
"""How far a surface is from the hidden rabbit (scenes/rabbit), as who stands at the wall sees both, as JSON.

usage: rabbit_errors.py SURFACE     a mesh (PLY, OBJ), or a capture by rabbit_capture.py, which is back-projected

    median_mm, within_80_mm    of the differences in depth, where both are seen
    bias_mm                    median of found - true
    silhouette                 intersection over union of what is seen
    extra, missed              seen of one alone, over what is seen of the rabbit
    seconds                    of the back-projection
"""

import json
import pathlib
import sys
import time

import numpy as np

import use_package
from isochron.mesh_files import read_mesh, read_vertex_values
from isochron.pictures.raster import Seen

SCENE = pathlib.Path(__file__).resolve().parents[1] / "scenes/rabbit"
STEP = 0.002  # metres
HALF = 0.3
LINES = np.arange(-HALF, HALF, STEP)  # at right angles to the wall, each way


def depths(vertices, triangles):
    """Distance from the wall on a grid of lines; NaN where nothing is met."""
    return Seen(vertices, triangles, LINES, LINES).depth


def errors_of_depths(off):
    """Of differences in millimetres; NaN where there are none."""
    median, most = np.quantile(np.abs(off), [0.5, 0.8]) if off.size else (np.nan, np.nan)
    return {"median_mm": median, "within_80_mm": most}


def covered(path, true, along):
    """The share of true depths, on lines at right angles to the wall at all `along` each way, that lie within three standard errors of
    a reconstruction's surface; those are along its normals."""
    vertices, triangles = (np.asarray(array) for array in read_mesh(path))
    seen, corners = Seen(vertices, triangles, along, along), vertices[triangles]
    normals = np.zeros_like(vertices)
    np.add.at(normals, triangles, np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, None])
    cosine = np.abs(seen.of(normals[:, 2] / np.linalg.norm(normals, axis=1)))
    errors = np.abs(seen.depth - true) * cosine / seen.of(read_vertex_values(path, "standard_error"))
    return (errors[np.isfinite(errors)] <= 3).mean()


def compared(found, true):
    """What main prints, of depths on the same lines."""
    in_found, in_true = np.isfinite(found), np.isfinite(true)
    both = in_found & in_true
    off = 1000 * (found - true)[both]
    return {**errors_of_depths(off), "bias_mm": np.median(off) if off.size else np.nan,
            "silhouette": both.sum() / (in_found | in_true).sum(), "extra": (in_found & ~in_true).sum() / in_true.sum(),
            "missed": (in_true & ~in_found).sum() / in_true.sum()}


def errors(vertices, triangles):
    return compared(depths(vertices, triangles), depths(*read_mesh(SCENE / "rabbit.obj")))


def surface(path):
    """Vertices, triangles and the seconds that it took to find them."""
    if path.suffix != ".h5":
        return *read_mesh(path), {}
    sys.path.insert(0, str(SCENE.parents[1] / "build/python"))
    sys.modules.pop("isochron", None)
    import isochron

    start = time.monotonic()
    found = isochron.back_project(path, SCENE / "response.csv")
    return found.vertices, found.triangles, {"seconds": time.monotonic() - start}


def main(arguments):
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    vertices, triangles, spent = surface(pathlib.Path(arguments[0]))
    print(json.dumps({k: float(f"{v:.3g}") for k, v in {**errors(vertices, triangles), **spent}.items()}))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
