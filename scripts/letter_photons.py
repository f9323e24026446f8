#!/usr/bin/python3
"""Errors of the hidden letter against the number of photons.

    scripts/letter_photons.py measure CSV      half an hour on two cores
    scripts/letter_photons.py plot CSV PNG

Gain and background of experiments/letter.yaml are multiplied by each of some factors, and so are their initial values. The
penalties on slopes count in mean squares of the target: they are divided by the factor's square, so that the same is expected
of relief and albedos. Where photons are many, samples and iterations are more, too: else they limit what is found.
"""

import pathlib
import statistics
import sys
import tempfile

import matplotlib
import yaml

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import LogLocator

import letter_errors
from reproduction.measure import ROOT, program
from reproduction.tables import read_rows, run_action, write_rows

FACTORS = (0.1, 0.3, 1, 3, 10)
EFFORT = {3: (2048, 4), 10: (4096, 6)}  # samples and iterations in place of the experiment's
DRAWS = 4
COLUMNS = ("factor", "draw", "counts", "depth_mm", "tilt_degrees", "relief_mm", "albedo", "seconds")
GOALS = {"depth_mm": 1, "tilt_degrees": 0.3, "albedo": 0.95}


def settings(experiment, factor, draw):
    """Overrides of the experiment; a seed of the target draws its counts."""
    yield f"target.seed={100 + draw}"
    if factor in EFFORT:
        samples, iterations = EFFORT[factor]
        yield from (f"samples.primal={samples}", f"samples.interior={samples}", f"optimizer.iterations={iterations}")
    for i, parameter in enumerate(experiment["parameters"]):
        if parameter["type"] in ("gain", "background"):
            for key in ("initial", "target"):
                yield f"parameters[{i}].{key}={factor * parameter[key]:.6g}"
        if "smoothing" in parameter:
            yield f"parameters[{i}].smoothing.slopes={float(parameter['smoothing']['slopes']) / factor**2:.6g}"


def measure(file):
    path = ROOT / "experiments/letter.yaml"
    experiment = yaml.safe_load(path.read_text(encoding="utf-8"))
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary) / "run"
        for draw in range(1, DRAWS + 1):
            for factor in FACTORS:
                words = [word for setting in settings(experiment, factor, draw) for word in ("--set", setting)]
                program("run", path, "-o", folder, "--force", *words)
                errors = letter_errors.errors(folder)
                rows.append((factor, draw, *(f"{errors[c]:.4g}" for c in COLUMNS[2:])))
                print(*rows[-1], flush=True)
                write_rows(file, COLUMNS, rows)


def plot(file, picture):
    rows = [{k: float(v) for k, v in row.items()} for row in read_rows(file)]
    counts = sorted({factor: statistics.mean(r["counts"] for r in rows if r["factor"] == factor)
                     for factor in {r["factor"] for r in rows}}.items())
    panels = (("depth_mm", "depth error (mm)"), ("tilt_degrees", "tilt error (degrees)"), ("albedo", "correlation of albedos"))
    figure, all_axes = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
    for axes, (key, label) in zip(all_axes, panels):
        values = [[abs(r[key]) for r in rows if r["factor"] == factor] for factor, _ in counts]
        axes.plot([c for (_, c), v in zip(counts, values) for _ in v], [x for v in values for x in v], ".",
                  color="0.6", label="one draw of the counts")
        axes.plot([c for _, c in counts], [statistics.median(v) for v in values], "o-", color="C0", label="median")
        axes.axhline(GOALS[key], color="C3", linestyle="--", linewidth=1, label="goal at the real capture's count")
        axes.axvline(next(c for factor, c in counts if factor == 1), color="0.8", linewidth=1, zorder=0)
        axes.set_xscale("log")
        if key != "albedo":
            axes.set_yscale("log")
            axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axes.yaxis.set_major_formatter("{x:g}")
            axes.yaxis.set_minor_formatter("")
        axes.set_xlabel("mean counts of a sensor point\n(background included)")
        axes.set_ylabel(label)
    all_axes[0].legend(fontsize=8)
    figure.suptitle("The hidden letter: errors against photon counts")
    figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, plot))
