#!/usr/bin/python3
"""How often the errors that runs state cover the truth.

    scripts/error_coverage.py measure CSV [DRAWS]   40 draws: a quarter of an hour of processor time
    scripts/error_coverage.py table CSV             a table in Markdown

Small captures of a board around the corner, from photon counts: `letter` has a relief and smoothing, as experiments/letter.yaml,
`plate` is flat and tilted, `spot` the same lit at a single spot. Each draw has other counts and other random numbers of the fit.
A row is a quantity of a draw: found and true value, stated standard error, and error over stated error.
"""

import pathlib
import sys
import tempfile

import numpy as np
import yaml

from reproduction.measure import program
from reproduction.tables import read_rows, run_action, write_rows
from scenes import letter, mesh

CASES = ("letter", "plate", "spot")
SIDE = 5  # vertices
EDGE = 0.5
DISTANCE = 0.5
NORMAL = 1.959964  # of the middle 95 % of a standard normal
COLUMNS = ("case", "draw", "quantity", "found", "truth", "standard_error", "z")
GATES = {"kind": "bins", "unit": "ps", "scene_unit_m": 1, "start": 2880, "width": 24, "count": 72, "response": "response.csv"}
SAMPLES = 512
PENALTY = {"relief": 0.006, "paint": 7.0e-7}


def board():
    """Vertices from the top left, their triangles, and albedos."""
    along = np.linspace(-0.5 * EDGE, 0.5 * EDGE, SIDE)
    y, x = np.meshgrid(-along, along, indexing="ij")
    vertices = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    albedos = 0.5 + 0.2 * np.sin(9 * vertices[:, 0] + 4 * vertices[:, 1]) * np.cos(7 * vertices[:, 1] - 1)
    return (vertices, mesh.grid(SIDE, SIDE)[:, ::-1]), albedos


def scene(laser):
    return {"capture": {"sensor": {"corner": [-0.35, 0.35, 0], "across": [0.7, 0, 0], "down": [0, -0.7, 0], "size": [12, 12]},
                        "normal": [0, 0, 1], "laser": laser},
            "materials": {"paint": {"type": "diffuse", "albedo": 0.5}},
            "shapes": [{"name": "board", "file": "board.obj", "material": "paint",
                        "transform": {"translate": [0, 0, DISTANCE]}}]}


def parameters(case, vertices, albedos):
    def rotation(name, axis, target):
        return {"name": name, "type": "rotation", "shape": "board", "axis": axis, "pivot": "center", "initial": 0.8 * target,
                "target": target}

    if case == "letter":
        relief = letter.relief(vertices[:, 0], vertices[:, 1])
        yield {"name": "relief", "type": "vertices", "shape": "board", "direction": [0, 0, 1],
               "smoothing": {"slopes": PENALTY["relief"]}, "initial": 0, "target": relief.tolist()}
    yield rotation("tilt_x", [1, 0, 0], 5)
    yield rotation("tilt_y", [0, 1, 0], -4)
    yield {"name": "z", "type": "translation", "shape": "board", "direction": [0, 0, 1], "initial": 0.008, "target": 0.01}
    paint = {"name": "paint", "type": "albedo", "shape": "board", "per": "vertex", "initial": 0.3, "target": albedos.tolist()}
    if case == "letter":
        paint["smoothing"] = {"slopes": PENALTY["paint"]}
    yield paint
    yield {"name": "gain", "type": "gain", "initial": 200, "target": 120}
    yield {"name": "dark", "type": "background", "initial": 1, "target": 2}


def write(directory, case):
    """The case's experiment and its scene. Returns the true values by parameter."""
    shape, albedos = board()
    mesh.write_obj(directory / "board.obj", shape, "rows from the top, facing -z")
    offsets = np.arange(0, 1001, 2)
    rows = "".join(f"{t},{np.exp(-t / 60):.6f}\n" for t in offsets)
    (directory / "response.csv").write_text("offset,value\n" + rows, encoding="ascii")
    laser = {"points": [[0.05, 0, 0]]} if case == "spot" else "confocal"
    (directory / "scene.yaml").write_text(yaml.safe_dump(scene(laser)), encoding="ascii")
    unknowns = list(parameters(case, shape[0], albedos))
    experiment = {"name": case, "scene": "scene.yaml", "max_bounces": 1, "gates": GATES, "parameters": unknowns,
                  "target": {"samples": 4096, "noise": {"counts": True}},
                  "samples": {"primal": SAMPLES, "interior": SAMPLES, "visibility": 0, "path_length": 0},
                  "loss": {"kind": "poisson"},
                  "optimizer": {"method": "levenberg_marquardt", "iterations": 12},
                  "output": {"geometry": "none", "frames": 0, "histogram_samples": 1}}
    (directory / "experiment.yaml").write_text(yaml.safe_dump(experiment), encoding="ascii")
    return {p["name"]: p["target"] for p in unknowns}


def quantities(summary, truth):
    """(name, found, true, stated standard error) of what the data determine."""
    combinations = summary.get("combinations", {})
    for name in ("z", "tilt_x", "tilt_y", "dark"):
        if name not in summary["undetermined"]:
            yield name, summary["parameters"][name], truth[name], summary["standard_errors"][name]
    for name, entry in combinations.items():
        one, sign, other = name.split()
        values = np.asarray(truth[other])
        true = truth[one] * values if sign == "*" else truth[one] + values if sign == "+" else truth[one] - values
        yield name, entry["mean"], float(np.mean(true)), entry["mean_standard_error"]
        if sign == "*":
            middle = len(values) // 2
            yield f"{name} at the middle", entry["values"][middle], float(true[middle]), entry["standard_errors"][middle]


def measure(file, draws=40, cases=CASES, first=1):
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        directory = pathlib.Path(temporary)
        for draw in range(first, first + int(draws)):
            for case in cases:
                truth = write(directory, case)
                program("run", directory / "experiment.yaml", "-o", directory / "run", "--force", "--seed", draw, "--set",
                        f"target.seed={100 + draw}")
                summary = yaml.safe_load((directory / "run/summary.yaml").read_text(encoding="utf-8"))
                for name, found, true, error in quantities(summary, truth):
                    rows.append((case, draw, name, *(f"{v:.6g}" for v in (found, true, error, (found - true) / error))))
                write_rows(file, COLUMNS, rows)


def table(file):
    rows = read_rows(file)
    print("| capture | quantity | draws | stated error | rms of error / stated | covered by 95 % |\n|---|---|---|---|---|---|")
    for case, name in dict.fromkeys((r["case"], r["quantity"]) for r in rows):
        own = [r for r in rows if (r["case"], r["quantity"]) == (case, name)]
        z = np.array([float(r["z"]) for r in own])
        error = np.median([float(r["standard_error"]) for r in own])
        print(f"| {case} | {name} | {len(own)} | {error:.2g} | {np.sqrt(np.mean(z**2)):.2f} | "
              f"{100 * np.mean(np.abs(z) < NORMAL):.0f} % |")


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, table))
