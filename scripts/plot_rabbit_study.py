#!/usr/bin/python3
"""Draws what rabbit_study.py measured: errors of depth, and silhouettes, against photons, points and seconds.

usage: plot_rabbit_study.py [FOLDER [PNG]]     default: experiments/measured and experiments/figures/rabbit_study.png
"""

import pathlib
import statistics
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import LogLocator, NullFormatter

from reproduction.tables import read_rows

ROOT = pathlib.Path(__file__).resolve().parents[1]
USUAL = ROOT / "experiments/measured", ROOT / "experiments/figures/rabbit_study.png"
METHODS = {"fit": ("reconstruction", "C0", "o"), "back_projection": ("back-projection", "C1", "s"),
           "light_cone": ("light-cone transform", "C2", "^")}
ERRORS = {"median_mm": ("median", "-"), "within_80_mm": ("80 %", "--")}
SWEEPS = {"photons": "photons per point", "points": "points of the wall along each side", "seconds": "seconds, wall"}


def medians(rows, sweep, value):
    """x and medians over seeds of what was found; x is what was varied, of sweeps over seconds what was spent."""
    kinds = {}
    for row in rows:
        if row[value]:
            kinds.setdefault(row["limit"] if sweep == "seconds" else row[sweep], []).append(row)
    points = [(statistics.median(float(row[sweep]) for row in own), statistics.median(float(row[value]) for row in own))
              for own in kinds.values()]
    return [list(column) for column in zip(*sorted(points))] or [[], []]


def draw_column(upper, lower, rows, sweep):
    for method, (name, colour, marker) in METHODS.items():
        own = [row for row in rows if row["method"] == method]
        for value, (words, line) in ERRORS.items():
            upper.plot(*medians(own, sweep, value), line, color=colour, marker=marker, ms=5, label=f"{name}, {words}")
            if method != "back_projection":
                upper.plot(*medians(own, sweep, f"shared_{value}"), line, color=colour, lw=0.8, alpha=0.5,
                           label=f"{name}, where back-projection is, {words}")
        lower.plot(*medians(own, sweep, "silhouette"), "-", color=colour, marker=marker, ms=5)
    unexplained = [row for row in rows if row["method"] == "fit" and row["median_mm"] and row["verdict"] != "explained"]
    upper.plot([float(row[sweep]) for row in unexplained], [float(row["median_mm"]) for row in unexplained], "x", color="black", ms=7,
               label="a draw that the reconstruction does not explain")


def finish(upper, lower, rows, sweep):
    for axes in (upper, lower):
        axes.set_xscale("log")
        axes.grid(True, which="both", alpha=0.2)
        axes.tick_params(labelleft=True)
    upper.set_yscale("log")
    for axis in (upper.yaxis, lower.xaxis):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    if sweep != "seconds":
        lower.set_xticks(sorted({float(row[sweep]) for row in rows}))
    lower.set_ylim(0, 1)
    lower.set_xlabel(SWEEPS[sweep])


def figure_of(tables):
    """tables: sweep -> rows."""
    figure = plt.figure(figsize=(max(9, 4.4 * len(tables)), 8.4), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=[6.5, 1])
    axes = above.subplots(2, len(tables), sharex="col", sharey="row", squeeze=False, height_ratios=[1.6, 1])
    for column, (sweep, rows) in zip(axes.T, tables.items()):
        draw_column(*column, rows, sweep)
        finish(*column, rows, sweep)
    axes[0, 0].set_ylabel("error of depth (mm)")
    axes[1, 0].set_ylabel("silhouettes:\nintersection over union")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    below.legend(handles, labels, loc="center", ncols=3 if len(tables) > 2 else 2, fontsize=8)
    above.suptitle("The hidden rabbit: medians over draws of the photons")
    return figure


def main(arguments):
    if len(arguments) > 2 or any(argument.startswith("-") for argument in arguments):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    folder, picture = [*arguments, *USUAL[len(arguments):]]
    tables = {sweep: read_rows(path) for sweep in SWEEPS if (path := pathlib.Path(folder) / f"rabbit_{sweep}.csv").exists()}
    if not tables:
        print(f"plot_rabbit_study.py: {folder}: no rabbit_*.csv", file=sys.stderr)
        return 2
    figure_of(tables).savefig(picture, dpi=100)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
