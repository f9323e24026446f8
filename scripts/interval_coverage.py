#!/usr/bin/python3
"""How often the 95 % intervals of `isochron derive` and `isochron gradient` cover the truth.

    scripts/interval_coverage.py measure CSV [DRAWS]   500 estimates of each quantity
    scripts/interval_coverage.py table CSV             a table in Markdown

Estimates of a quantity differ by their random numbers. The truth is the mean of all of them, which is known 22 times better than
one; of coupled pairs under gates that are too narrow for them, of the estimates by kept lengths. A row is an estimate.
"""

import csv
import pathlib
import shutil
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import yaml

from error_coverage import NORMAL
from reproduction.measure import ROOT, program
from reproduction.tables import markdown, read_rows, run_action, write_rows

DRAWS = 500
FEWEST_DEVIATIONS = 4  # below which the program warns (optim/problem/heavy_tail.h)
COLUMNS = ("quantity", "draw", "mean", "standard_error", "effective_count", "half_width_95")
CONTACT = {"name": "contact", "scene": str(ROOT / "tests/data/cornell/scene.yaml"), "max_bounces": 2,
           "gates": {"kind": "gaussian", "centers": [7.0], "unit": "scene", "sigma": 0.5},
           "parameters": [{"name": "x", "type": "translation", "shape": "smallbox", "direction": [1, 0, 0], "initial": 0, "target": 0.1}],
           "samples": {"primal": 8, "interior": 8, "visibility": 8, "path_length": 0}, "optimizer": {"iterations": 1}}


class Quantity:
    """One number of a command's table: `where` are the values by which its row is known."""

    def __init__(self, command, experiment, where, *settings, truth=None):
        self.command, self.experiment, self.where, self.settings, self.truth = command, experiment, where, settings, truth


def total(parameter, gate):
    return {"parameter": parameter, "gate": str(gate), "component": "total"}


def samples(count):
    return [f"samples.{term}={count}" for term in ("primal", "interior", "visibility")]


PAIRS = "estimator.keep_length=false"
QUANTITIES = {
    "cube, gates of 0.001 %": Quantity("derive", "cube", total("height", 1)),
    "0.001 % by pairs": Quantity("derive", "cube", total("height", 1), PAIRS, truth="cube, gates of 0.001 %"),
    "cube, gates of 5 %": Quantity("derive", "cube", total("height", 1), "gates.sigma=0.25"),
    "box on a floor (contact)": Quantity("derive", CONTACT, total("x", 0)),
    "branches": Quantity("derive", "branches", total("angle", 0)),
    "cove": Quantity("derive", "cove", total("height", 0)),
    "corridor, gradient": Quantity("gradient", "corridor", {"parameter": "x"}, "target.samples=64", *samples(256)),
    "tree, gradient": Quantity("gradient", "tree", {"parameter": "light_x"}, "target.samples=16", "samples.path_length=4"),
    "height field, gradient": Quantity("gradient", "height_field", {"parameter": "height[60]"}, "target.samples=16"),
    "letter, gradient": Quantity("gradient", "letter", {"parameter": "z"}, "target.samples=16", *samples(16)),
    "rabbit, gradient": Quantity("gradient", "bunny", {"parameter": "x"}, "target.samples=16"),
}


def estimate(name, draw, folder):
    quantity = QUANTITIES[name]
    file = folder / "contact.yaml" if quantity.experiment is CONTACT else ROOT / f"experiments/{quantity.experiment}.yaml"
    out = folder / f"{list(QUANTITIES).index(name)}-{draw}"
    settings = [word for setting in quantity.settings for word in ("--set", setting)]
    program(quantity.command, file, "-o", out, "--threads", 1, "--seed", 1000 + draw, *settings)
    with open(out / f"{quantity.command}.csv", newline="") as lines:
        row = next(r for r in csv.DictReader(lines) if all(r[k] == v for k, v in quantity.where.items()))
    shutil.rmtree(out)
    value = "mean" if quantity.command == "derive" else "gradient"
    return [name, draw, *(f"{float(row[c]):.6g}" for c in (value, *COLUMNS[3:]))]


def measure(file, draws=DRAWS, names=tuple(QUANTITIES)):
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        folder = pathlib.Path(folder)
        (folder / "contact.yaml").write_text(yaml.safe_dump(CONTACT))
        rows = []
        for name in names:
            rows += pool.map(lambda draw: estimate(name, draw, folder), range(int(draws)))
            write_rows(pathlib.Path(file), COLUMNS, rows)


def truth_of(rows, name):
    return np.mean([float(r["mean"]) for r in rows if r["quantity"] == (QUANTITIES[name].truth or name)])


def table_of(rows):
    lines = []
    for name in dict.fromkeys(r["quantity"] for r in rows):
        own = [r for r in rows if r["quantity"] == name]
        truth = truth_of(rows, name)
        mean, error, half_width = (np.array([float(r[c]) for r in own]) for c in ("mean", "standard_error", "half_width_95"))
        shares = [np.mean(hit) for hit in (np.abs(mean - truth) <= half_width, mean - half_width > truth, mean + half_width < truth,
                                           np.abs(mean - truth) <= NORMAL * error)]
        rare = np.mean([float(r["effective_count"]) < FEWEST_DEVIATIONS for r in own])
        lines.append((name, len(own), *(f"{100 * share:.1f} %" for share in shares), f"{100 * rare:.0f} %",
                      f"{100 * np.median(half_width) / abs(truth):.2g} %" if np.median(half_width) < abs(truth) else "above 100 %"))
    return markdown(["quantity", "estimates", "truth covered", "interval above it", "below it", "covered by 1.96 standard errors",
                     "warned of", "half width / truth, median"], lines)


def table(file):
    print(table_of(read_rows(file)))


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, table))
