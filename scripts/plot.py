#!/usr/bin/python3
"""Draws what the program wrote: a false-colour PNG beside every EXR of a folder, and rmse.png from log.csv.

usage: plot.py DIR
"""

import csv
import os
import pathlib
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import yaml
from matplotlib import colors
from matplotlib.cm import ScalarMappable

import exr

CHANNEL = re.compile(r"(?:(?P<component>.+)\.)?gate(?P<gate>\d+)\.(?P<channel>[RGBY])")
COMPONENTS = ["total", "interior", "visibility", "path_length"]
RUN_IMAGES = ["target", "initial", "final"]  # share one scale, to be compared
PERCENTILE = 99.5  # of the non-zero values: the end of the colour scale; outliers must not darken the rest
NON_FINITE = "magenta"


class PlotError(Exception):
    """Something that keeps a picture from being drawn, in one line."""


class Labels:
    """Words for titles and axes, as far as the folder's experiment.yaml knows them."""

    def __init__(self, directory):
        self.experiment, self.centers, self.unit, self.quantity = directory.name, None, "", "pixel value"
        path = directory / "experiment.yaml"
        if not path.exists():
            return
        try:
            data = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
            gates = data.get("gates") or {}
            self.experiment = str(data.get("name", self.experiment))
            centers = gates.get("centers")
            if isinstance(centers, dict):
                centers = np.linspace(centers["start"], centers["stop"], int(centers["count"]))
            if centers is not None:
                self.centers = [float(c) for c in np.atleast_1d(centers)]
            unit = gates.get("unit", "scene")
            self.unit = "scene units" if unit == "scene" else str(unit)
        except (yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError) as error:
            raise PlotError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
        steady = gates.get("kind") == "steady"
        self.quantity = "radiance" if steady else "radiance per scene unit of path length"

    def title(self, stem, gates):
        title = self.experiment if stem == self.experiment else f"{self.experiment}: {stem}"
        known = self.centers is not None and len(self.centers) == gates
        what = "path length" if self.unit == "scene units" else "travel time"
        return f"{title}\n(number of the gate: {what} at its centre, {self.unit})" if known else title

    def gate(self, gate, gates):
        known = self.centers is not None and len(self.centers) == gates
        name = f"gate {gate}" if gates <= 12 or not known else f"{gate}"
        return f"{name}: {self.centers[gate]:.5g}" if known else name


def read_stack(path):
    """component ('' for images) -> array of gates x height x width (grey) or gates x height x width x 3."""
    stacks = {}
    for name, image in exr.read(path).items():
        match = CHANNEL.fullmatch(name)
        if match:
            gates = stacks.setdefault(match["component"] or "", {})
            gates.setdefault(int(match["gate"]), {})[match["channel"]] = image.astype(float)
    if not stacks:
        raise PlotError(f"{path}: no channels named gateNNN.R/G/B, gateNNN.Y or COMPONENT.gateNNN.Y")
    out = {}
    for component, gates in stacks.items():
        layers = [gates[g] for g in sorted(gates)]
        if sorted(gates) != list(range(len(gates))) or any(set(l) not in ({"Y"}, set("RGB")) for l in layers):
            raise PlotError(f"{path}: incomplete gates or channels")
        if len({len(l) for l in layers}) != 1:
            raise PlotError(f"{path}: grey and colour gates in one file")
        grey = "Y" in layers[0]
        out[component] = np.stack([l["Y"] if grey else np.stack([l[c] for c in "RGB"], -1) for l in layers])
    return out


def scale_of(*arrays):
    """End of the colour scale: a high percentile of the non-zero magnitudes."""
    values = np.abs(np.concatenate([a.ravel() for a in arrays]))
    values = values[np.isfinite(values) & (values > 0)]
    return float(np.percentile(values, PERCENTILE)) if values.size else 1.0


def save(figure, path):
    temporary = path.with_name(path.name + ".tmp")
    figure.savefig(temporary, format="png", dpi=110)
    plt.close(figure)
    os.replace(temporary, path)


def srgb(x):
    """Display encoding of linear light in [0, 1]."""
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


class Grid:
    """A figure of equal cells below a title, with row names at the left and a colour bar at the right.

    All lengths are in inches.
    """

    TOP, BOTTOM, RIGHT, TITLE, GAP = 0.5, 0.15, 1.05, 0.24, 0.08

    def __init__(self, rows, columns, aspect, left):
        self.cell_width = float(np.clip(11 / columns, 1.0, 2.6))
        self.cell_height = self.cell_width / aspect
        self.left = left
        self.width = max(left + columns * (self.cell_width + self.GAP) + self.RIGHT, 4.6)
        self.height = max(self.TOP + rows * (self.cell_height + self.TITLE) + self.BOTTOM, 3.2)
        self.rows, self.columns = rows, columns
        self.figure = plt.figure(figsize=(self.width, self.height))

    def _axes(self, x, y, w, h):
        return self.figure.add_axes([x / self.width, y / self.height, w / self.width, h / self.height])

    def cell(self, row, column):
        x = self.left + column * (self.cell_width + self.GAP)
        y = self.height - self.TOP - (row + 1) * (self.cell_height + self.TITLE)
        axes = self._axes(x, y, self.cell_width, self.cell_height)
        axes.set_xticks([])
        axes.set_yticks([])
        return axes

    def title(self, text):
        x = self.left / self.width
        self.figure.text(x, 1 - 0.12 / self.height, text, ha="left", va="top", fontsize=10)

    def colorbar(self, mappable, label, extend):
        x = self.left + self.columns * (self.cell_width + self.GAP) + 0.05
        height = self.rows * (self.cell_height + self.TITLE) - self.TITLE
        height = float(np.clip(height, 1.9, 6.0))
        axes = self._axes(x, self.height - self.TOP - self.TITLE - height, 0.14, height)
        bar = self.figure.colorbar(mappable, cax=axes, extend=extend)
        bar.set_label(label, fontsize=8)
        bar.ax.tick_params(labelsize=8)
        bar.formatter.set_powerlimits((-3, 4))
        bar.ax.yaxis.get_offset_text().set(fontsize=8, ha="left")


def label_cell(axes, text, image):
    bad = np.count_nonzero(~np.isfinite(image))
    text += f" ({bad} not finite)" if bad else ""
    axes.set_title(text, fontsize=8, pad=3, color="red" if bad else "black")


def plot_images(path, stack, scale, labels):
    """The gated images of one file: grey scenes in false colour, RGB scenes in their own, equally exposed."""
    gates, height, width = stack.shape[:3]
    columns = gates if gates <= 6 else int(np.ceil(np.sqrt(1.4 * gates)))
    grid = Grid(-(-gates // columns), columns, width / height, 0.15)
    norm = colors.Normalize(0, scale)
    if stack.ndim == 4:
        shown = srgb(np.nan_to_num(stack / scale, nan=0, posinf=1, neginf=0))
        shown[~np.isfinite(stack).all(-1)] = colors.to_rgb(NON_FINITE)
        cmap = colors.ListedColormap(np.repeat(srgb(np.linspace(0, 1, 256))[:, None], 3, axis=1))
    else:
        shown = np.ma.masked_invalid(stack)
        cmap = matplotlib.colormaps["inferno"].copy()
        cmap.set_bad(NON_FINITE)
    for g in range(gates):
        axes = grid.cell(*divmod(g, columns))
        axes.imshow(shown[g], cmap=cmap, norm=norm, interpolation="nearest")
        label_cell(axes, labels.gate(g, gates), stack[g])
    grid.title(labels.title(path.stem, gates))
    extend = "max" if np.nanmax(np.nan_to_num(stack), initial=0) > scale else "neither"
    grid.colorbar(ScalarMappable(norm, cmap), labels.quantity, extend)
    save(grid.figure, path.with_suffix(".png"))


def plot_derivatives(path, stacks, labels):
    """Derivative images: red above zero, blue below. A row per component, more where there are many gates."""
    order = [c for c in COMPONENTS if c in stacks] + sorted(c for c in stacks if c not in COMPONENTS)
    gates = max(len(s) for s in stacks.values())
    height, width = next(iter(stacks.values())).shape[1:3]
    columns = min(gates, 10)
    rows = -(-gates // columns)
    grid = Grid(rows * len(order), columns, width / height, 0.45)
    scale = scale_of(*stacks.values())
    norm = colors.Normalize(-scale, scale)
    cmap = matplotlib.colormaps["RdBu_r"].copy()
    cmap.set_bad(NON_FINITE)
    beyond = False
    for block, component in enumerate(order):
        stack = stacks[component]
        stack = stack.mean(-1) if stack.ndim == 4 else stack
        beyond |= bool(np.abs(np.nan_to_num(stack)).max() > scale)
        for g, image in enumerate(stack):
            row, column = divmod(g, columns)
            axes = grid.cell(block * rows + row, column)
            axes.imshow(np.ma.masked_invalid(image), cmap=cmap, norm=norm, interpolation="nearest")
            label_cell(axes, labels.gate(g, gates), image)
            if column == 0:
                axes.set_ylabel(component or "derivative", fontsize=8)
    grid.title(labels.title(f"derivative by {path.stem}", gates))
    label = f"d({labels.quantity}) / d({path.stem})"
    grid.colorbar(ScalarMappable(norm, cmap), label, "both" if beyond else "neither")
    save(grid.figure, path.with_suffix(".png"))


def read_log(path):
    """Column name -> array; empty and unreadable entries are NaN. A last line cut short is left out."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    if not rows or "iteration" not in rows[0]:
        raise PlotError(f"{path}: no column 'iteration'")

    def number(text):
        try:
            return float(text)
        except ValueError:
            return np.nan

    table = np.array([[number(x) for x in r] for r in rows[1:] if len(r) == len(rows[0])])
    table = table.reshape(-1, len(rows[0]))
    return {name: table[:, i] for i, name in enumerate(rows[0])}


def plot_log(path, labels):
    """Image and parameter RMSE against iteration."""
    log = read_log(path)
    image_unit = f"RMSE ({labels.quantity})"
    panels = [
        ("image_rmse", "Image RMSE", image_unit, "against the target images", "tab:blue"),
        ("param_rmse", "Parameter RMSE", "RMSE (unit of the parameter)", "against the targets", "tab:red"),
    ]
    panels = [p for p in panels if np.any(np.nan_to_num(log.get(p[0], np.zeros(1))) > 0)]
    if not panels:
        return
    size = (5 * len(panels), 3.8)
    figure, axes = plt.subplots(1, len(panels), figsize=size, squeeze=False, layout="constrained")
    for ax, (column, title, unit, label, color) in zip(axes[0], panels):
        shown = log[column] > 0
        x, y = log["iteration"][shown], log[column][shown]
        ax.semilogy(x, y, color=color, marker="." if len(x) <= 100 else None, lw=1.2, label=label)
        ax.set(title=title, xlabel="iteration")
        ax.set_ylabel(unit, fontsize=9)
        ax.xaxis.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True))
        ax.grid(True, which="both", lw=0.4, alpha=0.4)
        ax.legend(fontsize=8)
    figure.suptitle(labels.experiment, fontsize=10)
    save(figure, path.with_name("rmse.png"))


def plot_directory(directory):
    """Draws everything there is; returns what went wrong, a line each."""
    paths = sorted(directory.glob("*.exr"))
    log = directory / "log.csv"
    if not directory.is_dir():
        return [f"{directory}: no such folder"]
    if not paths and not log.exists():
        return [f"{directory}: neither *.exr nor log.csv"]
    failures, stacks = [], {}

    def attempt(action, path, *arguments):
        try:
            return action(*arguments)
        except PlotError as error:
            failures.append(str(error))
        except (exr.ExrError, OSError, UnicodeDecodeError, csv.Error) as error:
            failures.append(f"{path}: {error}")
        return None

    labels = attempt(Labels, directory / "experiment.yaml", directory)
    if labels is None:
        return failures
    for path in paths:
        stack = attempt(read_stack, path, path)
        if stack is not None:
            stacks[path] = stack
    together = [s[""] for p, s in stacks.items() if p.stem in RUN_IMAGES and set(s) == {""}]
    for path, stack in stacks.items():
        if set(stack) == {""}:
            scale = scale_of(*together) if path.stem in RUN_IMAGES else scale_of(stack[""])
            attempt(plot_images, path, path, stack[""], scale, labels)
        else:
            attempt(plot_derivatives, path, path, stack, labels)
    if log.exists():
        attempt(plot_log, log, log, labels)
    return failures


def main(arguments):
    if arguments in (["-h"], ["--help"]):
        print(__doc__.strip())
        return 0
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print("usage: plot.py DIR", file=sys.stderr)
        return 2
    failures = plot_directory(pathlib.Path(arguments[0]))
    if failures:
        more = f" (and {len(failures) - 1} more)" if len(failures) > 1 else ""
        print(f"plot.py: {failures[0]}{more}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
