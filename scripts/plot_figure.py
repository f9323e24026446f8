#!/usr/bin/python3
"""Draws what scripts/figure computed.

usage: plot_figure.py 1|8|9|cove FOLDER PNG
"""

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import yaml
from matplotlib import colors
from matplotlib.cm import ScalarMappable

import use_package
from isochron import exr
from isochron.pictures import sheets

EXPERIMENTS = pathlib.Path(__file__).resolve().parent.parent / "experiments"
GATED = "radiance per scene unit of path length"


def channel(images, component):
    return images[f"{component}.gate000.Y"]


def show_image(axes, image, title):
    """A grey image as the eye would see it, exposed for its brightest half per cent."""
    shown = sheets.srgb(image / max(np.percentile(image, 99.5), 1e-30))
    axes.imshow(shown, cmap="gray", vmin=0, vmax=1, interpolation="nearest")
    axes.set_title(title, fontsize=9)
    axes.set(xticks=[], yticks=[])


def show_derivative(axes, image, scale, title):
    axes.imshow(image, cmap="RdBu_r", norm=colors.Normalize(-scale, scale), interpolation="nearest")
    axes.set_title(title, fontsize=9)
    axes.set(xticks=[], yticks=[])


def blank(axes, text):
    axes.set(xticks=[], yticks=[])
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, fontsize=9)


def color_bar(figure, axes, scale, label):
    mappable = ScalarMappable(colors.Normalize(-scale, scale), matplotlib.colormaps["RdBu_r"])
    bar = figure.colorbar(mappable, ax=axes, extend="both", fraction=0.05, pad=0.01, aspect=30)
    bar.set_label(label, fontsize=8)
    bar.ax.tick_params(labelsize=8)


def figure1(folder):
    steady = exr.read(folder / "steady/render.exr")["gate000.Y"]
    gated = exr.read(folder / "gated/render.exr")
    derivative = exr.read(folder / "derivative/turn.exr")
    centers = yaml.safe_load((EXPERIMENTS / "figure1.yaml").read_text())["gates"]["centers"]
    figure, axes = plt.subplots(2, 1 + len(centers), figsize=(2.05 * (1 + len(centers)) + 0.9, 4.5), layout="constrained")
    show_image(axes[0, 0], steady, "steady state")
    axes[1, 0].axis("off")
    blank(axes[1, 0], "derivative by the\ntree's rotation about\nthe vertical")
    images = [derivative[f"total.gate{g:03d}.Y"] for g in range(len(centers))]
    scale = np.percentile(np.abs(images), 98)
    for g, center in enumerate(centers):
        show_image(axes[0, 1 + g], gated[f"gate{g:03d}.Y"], f"path length {center:g}")
        show_derivative(axes[1, 1 + g], images[g], scale, f"derivative, {center:g}")
    color_bar(figure, axes[1, 1:], scale, "radiance per unit of\npath length, per degree")
    return figure


def figure8(folder):
    rows = {"gaussian": "gaussian", "boxcar": "boxcar", "truncated_gaussian": "truncated gaussian"}
    columns = {"finite_difference": "finite differences", "total": "ours", "interior": "interior",
               "visibility": "visibility", "path_length": "path_length"}
    figure, axes = plt.subplots(3, 6, figsize=(12.6, 6.4), layout="constrained")
    images = {kind: exr.read(folder / f"{kind}.exr") for kind in rows}
    scale = np.percentile(np.abs([channel(i, "total") for i in images.values()]), 98.5)
    for line, (kind, name) in zip(axes, rows.items()):
        show_image(line[0], channel(images[kind], "image"), "image" if kind == "gaussian" else "")
        line[0].set_ylabel(name, fontsize=10)
        for axis, (component, title) in zip(line[1:], columns.items()):
            title = title if kind == "gaussian" else ""
            if f"{component}.gate000.Y" in images[kind]:
                show_derivative(axis, channel(images[kind], component), scale, title)
            else:
                show_derivative(axis, np.zeros_like(channel(images[kind], "total")), scale, title)
                blank(axis, "none: this\ngate has no\njumps")
    color_bar(figure, axes[:, -1], scale, f"derivative by the height: {GATED}, per scene unit")
    return figure


def figure9(folder):
    rows = {"interior": "interior", "path_length": "path_length"}
    columns = {"standard": "standard sampling", "ellipsoidal": "ellipsoidal", "coupled": "ellipsoidal, coupled pairs"}
    images = exr.read(folder / "figure9.exr")
    lit = np.argwhere(channel(images, "image") > 0.02 * channel(images, "image").max())
    (top, left), (bottom, right) = np.maximum(lit.min(0) - 6, 0), lit.max(0) + 7
    images = {name: image[top:bottom, left:right] for name, image in images.items()}
    figure, axes = plt.subplots(2, 4, figsize=(11.5, 4.2), layout="constrained")
    show_image(axes[0, 0], channel(images, "image"), "image")
    axes[1, 0].axis("off")
    for line, (term, name) in zip(axes, rows.items()):
        scale = sheets.scale_of(channel(images, f"{term}_coupled"))
        for axis, (method, title) in zip(line[1:], columns.items()):
            if term == "path_length" and method == "standard":
                show_derivative(axis, np.zeros_like(channel(images, "image")), scale, "")
                blank(axis, "none: random paths do\nnot have given lengths")
            else:
                show_derivative(axis, channel(images, f"{term}_{method}"), scale, title)
        line[1].set_ylabel(name, fontsize=10)
        color_bar(figure, line, scale, "radiance per unit of path\nlength, per scene unit")
    return figure


def cove(folder):
    centers = yaml.safe_load((EXPERIMENTS / "cove.yaml").read_text())["gates"]["centers"]
    rows = {"without": "without", "with": "with light subpaths"}
    images, derivatives = ({row: exr.read(folder / row / name) for row in rows} for name in ("render.exr", "height.exr"))
    figure, axes = plt.subplots(4, len(centers), figsize=(1.75 * len(centers) + 1, 7.4), layout="constrained")
    scale = np.percentile(np.abs(list(derivatives["with"].values())), 99)
    for line, (row, name) in enumerate(rows.items()):
        axes[line, 0].set_ylabel(f"image, {name}", fontsize=8)
        axes[2 + line, 0].set_ylabel(f"derivative, {name}", fontsize=8)
        for g, center in enumerate(centers):
            gate = f"gate{g:03d}.Y"
            brightest = max(np.percentile(images["with"][gate], 98), 1e-30)
            axes[line, g].imshow(sheets.srgb(images[row][gate] / brightest), cmap="gray", vmin=0, vmax=1, interpolation="nearest")
            axes[line, g].set_title(f"path length {center:g}" if line == 0 else "", fontsize=9)
            show_derivative(axes[2 + line, g], derivatives[row][f"total.{gate}"], scale, "")
            axes[line, g].set(xticks=[], yticks=[])
    color_bar(figure, axes[2:], scale, f"derivative by the lamp's height:\n{GATED}, per scene unit")
    return figure


def main(arguments):
    figures = {"1": figure1, "8": figure8, "9": figure9, "cove": cove}
    if len(arguments) != 3 or arguments[0] not in figures:
        print("usage: plot_figure.py 1|8|9|cove FOLDER PNG", file=sys.stderr)
        return 2
    figure = figures[arguments[0]](pathlib.Path(arguments[1]))
    path = pathlib.Path(arguments[2])
    figure.savefig(path, dpi=80)
    print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
