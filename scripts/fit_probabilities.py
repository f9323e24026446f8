#!/usr/bin/python3
"""Whether the p-values of an experiment's fits are uniform where its model is right.

    scripts/fit_probabilities.py measure EXPERIMENT.yaml CSV [DRAWS]   50 draws
    scripts/fit_probabilities.py table CSV...                          a table in Markdown

The experiment fits photon counts of a capture. It runs once, and the expected counts of what it finds are the truth: each draw has
Poisson numbers about them, and other random numbers of the fit. So a measured capture can be asked, too, whose true model nobody knows.
A row is a draw; draw 0 is the experiment's own data. `true_z` is the deviance of a draw's counts beside the truth itself, less what is
expected, in standard deviations. A fit's own z scatters with it: their difference tells by a few draws how far fits end from where they
should.
"""

import dataclasses
import pathlib
import sys
import tempfile

import numpy as np
from scipy.stats import kstest, norm, poisson

from reproduction.measure import program
from reproduction.tables import markdown, read_rows, run_action, write_rows
import use_package
import isochron
from isochron.captures import read_capture

DRAWS = 50
FIRST_SEED = 1000
TRUE_SAMPLES = 65536  # their noise is an error of the model: of hidden_s, 0.15 of the deviance's spread at a quarter of them
LEVEL = 0.01  # below which a verdict is `unexplained`
FIT = ("deviance", "degrees_of_freedom", "p_value", "verdict")
COLUMNS = ("experiment", "draw", *FIT, "true_z")


def deviance(counts, means):
    return 2 * (np.where(counts > 0, counts * np.log(np.maximum(counts, 1) / means), 0) - counts + means)


def true_z_of(means):
    """The function of counts. Moments are interpolated between means 1 % apart."""
    means = np.maximum(means, 1e-9)
    grid = np.geomspace(means.min(), means.max() * 1.01, 2 + int(100 * np.log(means.max() / means.min() + 1)))
    numbers = np.arange(int(grid[-1] + 12 * np.sqrt(grid[-1]) + 30))
    weights = [poisson.pmf(numbers, mean) for mean in grid]
    first = np.array([w @ deviance(numbers, mean) for w, mean in zip(weights, grid)])
    second = np.array([w @ deviance(numbers, mean) ** 2 for w, mean in zip(weights, grid)])
    expected = np.interp(means, grid, first).sum()
    deviation = np.sqrt(np.interp(means, grid, second - first**2).sum())
    return lambda counts: (deviance(counts, means).sum() - expected) / deviation


def fit(experiment, folder, *options):
    program("run", experiment, "-o", folder, "--force", "--no-plots", "--set", "output.frames=0", *options)
    return isochron.read_run(folder).summary["fit"]


def measure(experiment, csv, draws=DRAWS, true_samples=TRUE_SAMPLES):
    rows = []

    def add(draw, found, true_z=""):
        rows.append((pathlib.Path(experiment).stem, draw, *(found[key] for key in FIT), true_z))
        write_rows(csv, COLUMNS, rows)

    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        add(0, fit(experiment, folder / "first", "--set", f"output.histogram_samples={true_samples}"))
        expected = read_capture(folder / "first/final.h5")
        means = np.maximum(expected.counts, 0)
        true_z = true_z_of(means)
        for draw in range(1, 1 + int(draws)):
            counts = np.random.default_rng([FIRST_SEED, draw]).poisson(means)
            dataclasses.replace(expected, counts=counts).write(folder / "counts.h5")
            add(draw, fit(experiment, folder / "fit", "--seed", FIRST_SEED + draw,
                          "--set", f"target={{capture: {folder / 'counts.h5'}}}"), f"{true_z(counts):.4f}")


def tables_of(rows):
    found = []
    for name in dict.fromkeys(r["experiment"] for r in rows):
        own = {int(r["draw"]): float(r["p_value"]) for r in rows if r["experiment"] == name}
        p = [value for draw, value in own.items() if draw]
        test = kstest(p, "uniform")
        shifts = [norm.isf(float(r["p_value"])) - float(r["true_z"]) for r in rows if r["experiment"] == name and r.get("true_z")]
        found.append((name, f"{own[0]:.2g}", len(p), f"{np.mean(p):.2f}", f"{100 * np.mean(np.less(p, LEVEL)):.0f} %",
                      f"{test.statistic:.2f}", f"{test.pvalue:.2f}",
                      f"{np.mean(shifts):.2f} ± {np.std(shifts, ddof=1) / np.sqrt(len(shifts)):.2f}" if len(shifts) > 1 else ""))
    return markdown(["experiment", "p of its own data", "draws", "mean p", f"below {LEVEL}", "distance from uniform", "probability",
                     "z of fits less that of the truth"], found)


def table(*files):
    print(tables_of([row for file in files for row in read_rows(file)]))


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, table))
