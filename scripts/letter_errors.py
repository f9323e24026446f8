#!/usr/bin/python3
"""How far a run of experiments/letter.yaml ends from the truth, as JSON: scripts/letter_errors.py RUN

All is judged by the surface, since relief and pose can make up for each other, and where the letter is: vertices have the true
albedo as weight, for what is black sends no light.

    depth_mm       mean distance of the surface from the wall, found - true
    tilt_degrees   between planes that are fitted to both surfaces
    relief_mm      rms difference of what the surfaces are beyond these planes
    albedo         correlation with the truth over all vertices, unweighted; a common factor is the gain's
    counts         mean per sensor point, background included; background: its share by the true value
    seconds        of the run
"""

import json
import pathlib
import sys

import numpy as np
import yaml

import use_package
from isochron import exr
from isochron.mesh_files import read_mesh

WALL_NORMAL = np.array([0.0, 0.0, 1.0])


def plane(points, weights):
    """Of z over x and y: value at the origin and two slopes, by weighted least squares."""
    columns = np.stack([np.ones(len(points)), points[:, 0], points[:, 1]], axis=1)
    root = np.sqrt(weights)
    return np.linalg.lstsq(columns * root[:, None], points[:, 2] * root, rcond=None)[0], columns


def normal(coefficients):
    n = np.array([-coefficients[1], -coefficients[2], 1])
    return n / np.linalg.norm(n)


def surface_errors(found, true, weights):
    weights = weights / weights.sum()
    depth = weights @ (found - true) @ WALL_NORMAL
    (a, left), (b, right) = plane(found, weights), plane(true, weights)
    beyond = (found[:, 2] - left @ a) - (true[:, 2] - right @ b)
    return {"depth_mm": 1000 * depth,
            "tilt_degrees": float(np.degrees(np.arccos(min(1.0, normal(a) @ normal(b))))),
            "relief_mm": 1000 * float(np.sqrt(weights @ beyond**2))}


def errors(run):
    summary = yaml.safe_load((run / "summary.yaml").read_text(encoding="utf-8"))
    experiment = yaml.safe_load((run / "experiment.yaml").read_text(encoding="utf-8"))
    paint = next(p for p in experiment["parameters"] if p["name"] == "paint")
    truth = paint["target"]
    if isinstance(truth, str):
        truth = np.loadtxt(run / truth)
    truth, found = np.asarray(truth, dtype=float), np.asarray(summary["parameters"]["paint"])
    target = exr.read(run / "target.exr")
    image = np.sum([np.asarray(channel, dtype=float) for channel in target.values()], axis=0)
    return {**surface_errors(*(read_mesh(run / f"geometry/{which}_board.ply")[0] for which in ("final", "target")), truth),
            "albedo": float(np.corrcoef(found, truth)[0, 1]),
            "counts": float(image.mean()),
            "seconds": float(summary["seconds"])}


def main(arguments):
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    print(json.dumps({k: float(f"{v:.4g}") for k, v in errors(pathlib.Path(arguments[0])).items()}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
