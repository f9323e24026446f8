#!/usr/bin/python3
"""How often the errors that runs state cover the truth, and whether the probabilities of their fits are uniform.

    scripts/error_coverage.py measure CSV [DRAWS]   40 draws: a quarter of an hour of processor time
    scripts/error_coverage.py table CSV             two tables in Markdown: quantities, and p-values of the fits

Small captures of a board around the corner, from photon counts: `letter` has a relief and smoothing, as experiments/letter.yaml,
`plate` is flat and tilted, `spot` the same lit at a single spot; `flat` is of one albedo and keeps its tilt. Each draw of each case has counts of its own, as dark bins that
cases share would make one sample of their backgrounds, and other random numbers of the fit. Counts are Poisson numbers about one
rendering of many samples: noise of the expected counts is no error of the fit, but makes its deviance larger.
A row is a quantity of a draw: found and true value, stated standard error, error over stated error, and the fit's p-value.
"""

import pathlib
import sys
import tempfile

import numpy as np
import yaml
from scipy.stats import kstest

from reproduction.measure import program
from reproduction.tables import markdown, read_rows, run_action, write_rows
from scenes import letter, mesh
import use_package
from isochron import exr

CASES = ("letter", "plate", "spot", "flat")
SIDE = 5  # vertices
EDGE = 0.5
DISTANCE = 0.5
NORMAL = 1.959964  # of the middle 95 % of a standard normal
COLUMNS = ("case", "draw", "quantity", "found", "truth", "standard_error", "z", "p_value")
GATES = {"kind": "bins", "unit": "ps", "scene_unit_m": 1, "start": 2880, "width": 24, "count": 72, "response": "response.csv"}
SAMPLES = 512
TRUE_SAMPLES = 65536  # variance over mean, summed over the 10368 readings of plate: 2, where the deviance scatters by 150
FIT_SAMPLES = 1024  # that the p-value rests on
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
    if case != "flat":
        yield rotation("tilt_x", [1, 0, 0], 5)
        yield rotation("tilt_y", [0, 1, 0], -4)
    yield {"name": "z", "type": "translation", "shape": "board", "direction": [0, 0, 1], "initial": 0.008, "target": 0.01}
    paint = {"name": "paint", "type": "albedo", "initial": 0.3}
    if case == "flat":
        paint |= {"material": "paint", "target": 0.5}
    else:
        paint |= {"shape": "board", "per": "vertex", "target": albedos.tolist()}
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
                  "target": {"images": "counts.exr"},
                  "samples": {"primal": SAMPLES, "interior": SAMPLES, "visibility": 0, "path_length": 0},
                  "loss": {"kind": "poisson"},
                  "optimizer": {"method": "levenberg_marquardt", "iterations": 12},
                  "output": {"geometry": "none", "frames": 0, "histogram_samples": FIT_SAMPLES}}
    (directory / "experiment.yaml").write_text(yaml.safe_dump(experiment), encoding="ascii")
    return {p["name"]: p["target"] for p in unknowns}


def render_expected(directory):
    """Expected counts of the case that the directory holds, channel by channel."""
    program("render", directory / "experiment.yaml", "-o", directory / "expected", "--at", "target", "--samples", TRUE_SAMPLES,
            "--set", "target={samples: 1}")  # there are no counts yet
    return exr.read(directory / "expected/render.exr")


def quantities(summary, truth):
    """(name, found, true, stated standard error) of what the data determine."""
    combinations = summary.get("combinations", {})
    for name in ("z", "tilt_x", "tilt_y", "dark"):
        if name in truth and name not in summary["undetermined"]:
            yield name, summary["parameters"][name], truth[name], summary["standard_errors"][name]
    for name, entry in combinations.items():
        one, sign, other = name.split()
        values = np.atleast_1d(truth[other])
        true = truth[one] * values if sign == "*" else truth[one] + values if sign == "+" else truth[one] - values
        name = f" {sign} ".join(sorted((one, other))) if sign == "*" else name
        yield name, entry["mean"], float(np.mean(true)), entry["mean_standard_error"]
        if sign == "*" and len(values) > 1:
            middle = len(values) // 2
            yield f"{name} at the middle", entry["values"][middle], float(true[middle]), entry["standard_errors"][middle]


def fit(directory, expected, case, draw, first_seed):
    """The summary of a run on counts of its own."""
    generator = np.random.default_rng([first_seed, CASES.index(case), draw])
    exr.write(directory / "counts.exr", {name: generator.poisson(mean) for name, mean in expected.items()})
    program("run", directory / "experiment.yaml", "-o", directory / "run", "--force", "--seed", first_seed + draw)
    return yaml.safe_load((directory / "run/summary.yaml").read_text(encoding="utf-8"))


def measure(file, draws=40, cases=CASES, first_seed=0):
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        folders = {case: pathlib.Path(temporary) / case for case in cases}
        for folder in folders.values():
            folder.mkdir()
        truths = {case: write(folder, case) for case, folder in folders.items()}
        expected = {case: render_expected(folder) for case, folder in folders.items()}
        for draw in range(1, 1 + int(draws)):
            for case, folder in folders.items():
                summary = fit(folder, expected[case], case, draw, first_seed)
                for name, found, true, error in quantities(summary, truths[case]):
                    numbers = (found, true, error, (found - true) / error, summary["fit"]["p_value"])
                    rows.append((case, draw, name, *(f"{v:.6g}" for v in numbers)))
                write_rows(file, COLUMNS, rows)


def p_values(rows, case):
    """One of each draw."""
    return [float(p) for p in {r["draw"]: r["p_value"] for r in rows if r["case"] == case}.values()]


def tables_of(rows):
    quantities_of, fits = [], []
    for case, name in dict.fromkeys((r["case"], r["quantity"]) for r in rows):
        own = [r for r in rows if (r["case"], r["quantity"]) == (case, name)]
        z = np.array([float(r["z"]) for r in own])
        error = np.median([float(r["standard_error"]) for r in own])
        quantities_of.append((case, name, len(own), f"{error:.2g}", f"{np.sqrt(np.mean(z**2)):.2f}",
                              f"{100 * np.mean(np.abs(z) < NORMAL):.0f} %"))
    for case in dict.fromkeys(r["case"] for r in rows):
        p = p_values(rows, case)
        test = kstest(p, "uniform")
        fits.append((case, len(p), f"{np.mean(p):.2f}", f"{100 * np.mean(np.less(p, 0.05)):.0f} %", f"{test.statistic:.2f}",
                     f"{test.pvalue:.2f}"))
    return "\n\n".join((
        markdown(["capture", "quantity", "draws", "stated error", "rms of error / stated", "covered by 95 %"], quantities_of),
        markdown(["capture", "draws", "mean p", "below 0.05", "distance from uniform", "probability"], fits)))


def table(file):
    print(tables_of(read_rows(file)))


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, table))
