#!/usr/bin/python3
"""Whether the p-values of an experiment's fits are uniform where its model is right.

    scripts/fit_probabilities.py measure EXPERIMENT.yaml CSV [DRAWS]   50 draws
    scripts/fit_probabilities.py table CSV...                          a table in Markdown

The experiment fits photon counts of a capture. It runs once, and the expected counts of what it finds are the truth: each draw has
Poisson numbers about them, and other random numbers of the fit. So a measured capture can be asked, too, whose true model nobody knows.
A row is a draw; draw 0 is the experiment's own data.
"""

import dataclasses
import pathlib
import sys
import tempfile

import numpy as np
from scipy.stats import kstest

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
COLUMNS = ("experiment", "draw", *FIT)


def fit(experiment, folder, *options):
    program("run", experiment, "-o", folder, "--force", "--no-plots", "--set", "output.frames=0", *options)
    return isochron.read_run(folder).summary["fit"]


def measure(experiment, csv, draws=DRAWS, true_samples=TRUE_SAMPLES):
    rows = []

    def add(draw, found):
        rows.append((pathlib.Path(experiment).stem, draw, *(found[key] for key in FIT)))
        write_rows(csv, COLUMNS, rows)

    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        add(0, fit(experiment, folder / "first", "--set", f"output.histogram_samples={true_samples}"))
        expected = read_capture(folder / "first/final.h5")
        for draw in range(1, 1 + int(draws)):
            counts = np.random.default_rng([FIRST_SEED, draw]).poisson(np.maximum(expected.counts, 0))
            dataclasses.replace(expected, counts=counts).write(folder / "counts.h5")
            add(draw, fit(experiment, folder / "fit", "--seed", FIRST_SEED + draw,
                          "--set", f"target={{capture: {folder / 'counts.h5'}}}"))


def tables_of(rows):
    found = []
    for name in dict.fromkeys(r["experiment"] for r in rows):
        own = {int(r["draw"]): float(r["p_value"]) for r in rows if r["experiment"] == name}
        p = [value for draw, value in own.items() if draw]
        test = kstest(p, "uniform")
        found.append((name, f"{own[0]:.2g}", len(p), f"{np.mean(p):.2f}", f"{100 * np.mean(np.less(p, LEVEL)):.0f} %",
                      f"{test.statistic:.2f}", f"{test.pvalue:.2f}"))
    return markdown(["experiment", "p of its own data", "draws", "mean p", f"below {LEVEL}", "distance from uniform", "probability"],
                    found)


def table(*files):
    print(tables_of([row for file in files for row in read_rows(file)]))


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, table))
