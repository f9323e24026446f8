#!/usr/bin/python3
"""What the photons of a capture can tell of the depths of a shape that is known: how far the fit of `isochron reconstruct` is from what
it could be at best.

usage: shape_bound.py RUN TRUTH [--keep FOLDER]     the folder of a reconstruction, and the true mesh (OBJ, PLY), in the capture's coordinates

The run's last level is made again, from the true mesh in triangles of its size, with its smoothing. Standard errors there are the Cramer-Rao
bound of the photons and the smoothing together; depths that are off by normal numbers of these have the median and 80 % below. JSON, in mm:

    bound     {median_mm, within_80_mm} of such numbers
    begun_at_the_truth     the same of the depths that this fit ends at, and its silhouette
    found     the same of the run
"""

import argparse
import json
import pathlib
import sys
import tempfile

import numpy as np
import yaml
from scipy.optimize import brentq
from scipy.special import erf

import rabbit_errors
from isochron.mesh_files import read_mesh, read_polygons
from isochron.pictures.raster import Seen
from reproduction.measure import program
from scenes import mesh

LINES = 301


def last_level(run):
    return max((run / "levels").iterdir(), key=lambda level: int(level.name))


def begun_at(truth, run, folder):
    """The folder of the fit."""
    settings = yaml.safe_load((run / "experiment.yaml").read_text(encoding="utf-8"))
    level = last_level(run)
    last = yaml.safe_load((level / "experiment.yaml").read_text(encoding="utf-8"))
    shape, *_ = (p for p in settings["parameters"] if "remesh" in p)
    size = yaml.safe_load((run / "summary.yaml").read_text(encoding="utf-8"))["levels"][-1]["edge_length"]
    shape["remesh"] = {"levels": 1, "edge_length": size}
    for parameter, fitted in zip(settings["parameters"], last["parameters"]):
        if "smoothing" in parameter:
            parameter["smoothing"] = fitted["smoothing"]
            parameter["smoothing"].pop("evidence", None)
        if parameter["type"] == "albedo":
            parameter["initial"] = float(np.median(fitted["initial"]))
    settings["scene"] = str(folder / "scene.yaml")
    settings["target"]["capture"] = str(run / settings["target"]["capture"])
    if isinstance(settings["gates"].get("response"), str):
        settings["gates"]["response"] = str(run / settings["gates"]["response"])
    scene = yaml.safe_load((run / "scene.yaml").read_text(encoding="utf-8"))
    scene["capture"]["file"] = str(run / scene["capture"]["file"])
    mesh.write_obj(folder / "truth.obj", truth, "Truth")
    scene["shapes"][0]["file"] = "truth.obj"
    (folder / "scene.yaml").write_text(yaml.safe_dump(scene, sort_keys=False), encoding="utf-8")
    (folder / "experiment.yaml").write_text(yaml.safe_dump(settings, sort_keys=False), encoding="utf-8")
    program("run", folder / "experiment.yaml", "-o", folder / "fit", "--force")
    return folder / "fit"


def surface(run):
    return run / "geometry/final_surface.ply"


def normals(vertices, triangles):
    corners = vertices[triangles]
    own = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(sums, triangles[:, k], own)
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)


def quantiles(spreads):
    """Of the absolute values of normal numbers of these standard deviations, each as likely."""
    below = lambda share: brentq(lambda x: erf(x / spreads / np.sqrt(2)).mean() - share, 0, 20 * spreads.max())
    return {"median_mm": below(0.5), "within_80_mm": below(0.8)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path)
    parser.add_argument("truth", type=pathlib.Path)
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the fit; default: a temporary one")
    options = parser.parse_args()
    true = read_mesh(options.truth)
    low, high = true[0].min(axis=0), true[0].max(axis=0)
    lines = [np.linspace(low[k] - 0.1 * (high - low)[k], high[k] + 0.1 * (high - low)[k], LINES) for k in (0, 1)]
    seen = lambda one: Seen(*one, *lines).depth
    depth = seen(true)
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        fitted = begun_at(true, options.run.resolve(), folder.resolve())
        polygons = read_polygons(surface(fitted))
        ends = polygons.points, polygons.triangles()
        errors = polygons.values["standard_error"] / np.maximum(np.abs(normals(*ends)[:, 2]), 1e-3)
        spreads = 1000 * Seen(*ends, *lines).of(errors)
        result = {"bound": quantiles(spreads[np.isfinite(spreads) & np.isfinite(depth)])}
        for name, found in (("begun_at_the_truth", seen(ends)), ("found", seen(read_mesh(surface(options.run))))):
            both, either = np.isfinite(found) & np.isfinite(depth), np.isfinite(found) | np.isfinite(depth)
            result[name] = {**rabbit_errors.errors_of_depths(1000 * (found - depth)[both]), "silhouette": both.sum() / either.sum()}
    print(json.dumps({name: {key: float(f"{value:.3g}") for key, value in each.items()} for name, each in result.items()}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
