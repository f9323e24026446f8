"""The strip that the paper shows for a reconstruction: images through four gates at the start, halfway, at the end and at
the target, the derivatives by an unknown there, and the errors of images and parameters over the iterations."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import yaml
from matplotlib import colors

import use_package
from isochron import exr
from isochron.pictures import curves, reading, sheets

from .measure import ROOT, program, values

STATES = ("initial", "middle", "final", "target")


def point(unknowns):
    """The values as --at takes them."""
    return ",".join(f"{name}={value!r}" for name, value in unknowns.items())


def render(name, entry, folder, halfway, samples=None):
    """Renders what the strip shows into folder/strip: STATE/render.exr, and derivatives of all but the target."""
    count = samples or entry.samples
    common = ["--set", f"resolution=[{entry.resolution[0]}, {entry.resolution[1]}]", "--set", "target.samples=1", "--samples"]
    at = {"initial": "initial", "middle": point(halfway), "final": point(values(folder)), "target": "target"}
    resolved = yaml.safe_load((folder / "experiment.yaml").read_text(encoding="utf-8"))
    for state, where in at.items():
        out = folder / "strip" / state
        experiment = ROOT / f"experiments/{name}.yaml"
        bounces = (resolved["target"] if state == "target" else resolved)["max_bounces"]
        program("render", experiment, "-o", out, "--at", where, *common, count, "--set", f"max_bounces={bounces}")
        if state != "target":
            # Boundary terms cost more per sample than images do, and derivatives are looked at for their shape alone.
            program("derive", experiment, "-o", out, "--at", where, "--parameter", entry.unknown, *common, max(count // 4, 2))


def draw(name, entry, folder, file):
    strip = folder / "strip"
    images = {s: reading.read_stack(strip / s / "render.exr")[""][list(entry.gates)] for s in STATES}
    slopes = {s: reading.read_stack(strip / s / f"{entry.unknown}.exr")["total"][list(entry.gates)] for s in STATES[:3]}
    rows, side, shape = len(entry.gates), 1.2, images["target"].shape[1:3]
    figure = plt.figure(figsize=(7 * side + 3.4, max(rows * side * shape[0] / shape[1], 2.6) + 0.5), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=[7 * side, 3.4])
    cells = left.subplots(rows, 7, squeeze=False)
    # Every gate has its own exposure, the same in all states: gates differ by orders of magnitude.
    words = reading.Folder(folder)
    for row, gate in enumerate(entry.gates):
        exposure = sheets.scale_of(*(images[s][row] for s in STATES))
        steep = np.abs(np.concatenate([slopes[s][row].ravel() for s in STATES[:3]]))
        steepest = np.percentile(steep[steep > 0], 97) if steep.any() else 1  # noise has outliers
        for column, state in enumerate(STATES):
            image = sheets.srgb(images[state][row] / exposure)
            cells[row, column].imshow(image, cmap="gray", vmin=0, vmax=1, interpolation="nearest")
        for column, state in enumerate(STATES[:3], 4):
            slope = slopes[state][row]
            cells[row, column].imshow(slope, cmap="RdBu_r", norm=colors.Normalize(-steepest, steepest), interpolation="nearest")
        center = "steady" if words.centers is None else f"{words.centers[gate]:.4g}"
        cells[row, 0].set_ylabel(center, fontsize=8)
    for axes, title in zip(cells[0], [*STATES, *(f"∂/∂{entry.unknown}\n{s}" for s in STATES[:3])]):
        axes.set_title(title, fontsize=8)
    for axes in cells.flat:
        axes.set(xticks=[], yticks=[])
    _curves(right, reading.read_log(folder / "log.csv"))
    sheets.save(figure, file)


def _curves(figure, log):
    for axes, (column, title) in zip(figure.subplots(2, 1, sharex=True), (("image_rmse", "image RMSE"), ("param_rmse", "parameter RMSE"))):
        axes.semilogy(log["iteration"], np.where(log[column] > 0, log[column], np.nan), lw=1,
                      color={"image_rmse": "tab:blue", "param_rmse": "tab:red"}[column])
        axes.set_title(title, fontsize=8)
        if column == "image_rmse" and (note := curves.gap_note(log[column])):
            axes.set_xlabel(note, fontsize=6)
        axes.tick_params(which="both", labelsize=7)
        axes.grid(True, which="both", lw=0.4, alpha=0.4)
    axes.set_xlabel("iteration", fontsize=8)
