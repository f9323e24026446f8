"""Curves and slices: log.csv over iterations, one pixel over the gates, one row of pixels over the gates."""

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

from isochron.pictures.reading import PlotError, read_log
from isochron.pictures.scales import scale_of
from isochron.pictures.sheets import plain_ticks, save

MOST_CURVES = 10  # parameters in the plot of errors: those that were furthest off at the start


def set_scale(axes, values):
    """Logarithmic where values differ by more than three times, linear, and then from zero, where they do not."""
    values = values[np.isfinite(values) & (values > 0)]
    if values.size and values.max() > 3 * values.min():
        axes.set_yscale("log")
        if values.max() < 100 * values.min():
            axes.yaxis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    else:
        axes.set_ylim(bottom=0, top=1.08 * values.max() if values.size else 1)
    plain_ticks(axes.yaxis)


def parameter_curves(log):
    """(label, error over its first value) of each parameter; the last iteration's error goes into the label."""
    curves = []
    for column, errors in log.items():
        if column.endswith(".rmse") and len(errors) and errors[0] > 0:
            curves.append((f"{column.removesuffix('.rmse')}: {errors[0]:.3g} to {errors[-1]:.3g}", errors / errors[0]))
    if not curves and len(log.get("param_rmse", [])) and log["param_rmse"][0] > 0:
        errors = log["param_rmse"]
        curves.append((f"all: {errors[0]:.3g} to {errors[-1]:.3g}", errors / errors[0]))
    return curves


def gap_note(image_rmse):
    """Why a curve of image_rmse has gaps, in one line; empty where it has none."""
    gaps = int(np.sum(image_rmse == 0))
    if not gaps:
        return ""
    return f"gaps ({gaps} of {len(image_rmse)} rows): squared error, unbiased, estimated below 0"


def plot_log(path, experiment, quantity):
    """The images' error, and that of each parameter relative to where it began, over iterations."""
    log = read_log(path)
    image = log.get("image_rmse", np.zeros(1))
    curves = parameter_curves(log)
    panels = []
    if np.any(np.nan_to_num(image) > 0):
        panels.append(("Images against the target", f"RMSE ({quantity})", [("", image)], gap_note(image)))
    if curves:
        left_out = f" ({MOST_CURVES} of {len(curves)})" if len(curves) > MOST_CURVES else ""
        panels.append((f"Parameters against their targets{left_out}", "RMSE / RMSE at the start", curves[:MOST_CURVES],
                       ""))
    if not panels:
        return
    figure, axes = plt.subplots(1, len(panels), figsize=(5 * len(panels), 3.8), squeeze=False, layout="constrained")
    for ax, (title, unit, lines, note) in zip(axes[0], panels):
        for label, values in lines:
            shown = values > 0  # zero cannot be drawn on a logarithmic axis; gap_note tells of those of the images
            few = np.sum(shown) <= 100 or note  # points between two gaps would not show without a marker
            ax.plot(log["iteration"], np.where(shown, values, np.nan), marker="." if few else None,
                    markersize=6 if np.sum(shown) <= 100 else 2, lw=1.2, label=label)
        set_scale(ax, np.concatenate([values for _, values in lines]))
        ax.set_title(title, fontsize=10)
        ax.set_xlabel(f"iteration\n{note}" if note else "iteration", fontsize=9)
        ax.set_ylabel(unit, fontsize=9)
        ax.xaxis.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True))
        ax.grid(True, which="both", lw=0.4, alpha=0.4)
        if any(label for label, _ in lines):
            ax.legend(fontsize=8, title="first to last, unit of the parameter", title_fontsize=7)
    figure.suptitle(experiment, fontsize=10)
    save(figure, path.with_name("rmse.png"))


def check_inside(path, what, value, size):
    if not 0 <= value < size:
        raise PlotError(f"{path}: there is no {what} {value} (0 to {size - 1})")


def plot_pixel(path, output, experiment, stacks, gates, pixel):
    """What one pixel (column, row; row 0 at the top) sees through each gate."""
    height, width = next(iter(stacks.values())).shape[1:3]
    column, row = pixel
    check_inside(path, "column", column, width)
    check_inside(path, "row", row, height)
    figure, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
    for component, stack in stacks.items():
        values = stack[:, row, column]
        series = [("", None, values)] if values.ndim == 1 else [(c, f"tab:{n}", values[:, i]) for i, (c, n) in enumerate(
            (("R", "red"), ("G", "green"), ("B", "blue")))]
        for channel, color, y in series:
            label = " ".join(part for part in (component, channel) if part)
            axes.plot(gates.positions, y, drawstyle="steps-mid" if len(y) > 1 else "default", lw=1.1,
                      marker="." if len(y) <= 40 else None, color=color, label=label or None)
    axes.axhline(0, color="black", lw=0.5)
    axes.set_xlabel(f"gate's centre: {gates.axis}" if gates.centers is not None else gates.axis)
    axes.set_ylabel(gates.quantity if set(stacks) == {""} else f"d({gates.quantity}) / d({path.stem})", fontsize=8)
    dark = "" if any(np.any(stack[:, row, column] != 0) for stack in stacks.values()) else " (zero through every gate)"
    axes.set_title(f"{experiment}: {path.stem}, pixel in column {column}, row {row}{dark}", fontsize=10)
    plain_ticks(axes.yaxis)
    axes.grid(True, lw=0.4, alpha=0.4)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(fontsize=8)
    save(figure, output)


def edges_of(centers):
    """Borders of the cells around centres that rise."""
    if len(centers) == 1:
        return np.array([centers[0] - 0.5, centers[0] + 0.5])
    middle = (centers[1:] + centers[:-1]) / 2
    return np.concatenate([[2 * centers[0] - middle[0]], middle, [2 * centers[-1] - middle[-1]]])


def plot_row(path, output, experiment, stacks, gates, row):
    """One row of pixels over the gates: the image's columns to the right, gates upwards."""
    stack = stacks.get("", stacks.get("total"))
    if stack is None:
        raise PlotError(f"{path}: no images and no total derivative to slice")
    check_inside(path, "row", row, stack.shape[1])
    signed = "" not in stacks
    values = stack[:, row].mean(-1) if stack.ndim == 4 else stack[:, row]
    order = np.argsort(gates.positions, kind="stable")
    positions = gates.positions[order].astype(float)
    if len(positions) > 1 and np.any(np.diff(positions) <= 0):
        raise PlotError(f"{path}: gates with the same centre cannot be sliced")
    scale = scale_of(values)
    figure, axes = plt.subplots(figsize=(6.4, 5), layout="constrained")
    cmap = matplotlib.colormaps["RdBu_r" if signed else "inferno"].with_extremes(bad="magenta")
    columns = np.arange(values.shape[1] + 1) - 0.5
    mesh = axes.pcolormesh(columns, edges_of(positions), np.ma.masked_invalid(values[order]), cmap=cmap,
                           vmin=-scale if signed else 0, vmax=scale)
    beyond = np.abs(np.nan_to_num(values)).max() > scale
    bar = figure.colorbar(mesh, ax=axes, extend=("both" if signed else "max") if beyond else "neither")
    bar.set_label(f"d({gates.quantity}) / d({path.stem})" if signed else gates.quantity, fontsize=8)
    plain_ticks(bar.ax.yaxis)
    axes.set_xlabel("column (pixels)")
    axes.set_ylabel(f"gate's centre: {gates.axis}" if gates.centers is not None else gates.axis)
    colour = " (mean of the colours)" if stack.ndim == 4 else ""
    axes.set_title(f"{experiment}: {path.stem}, row {row}{colour}", fontsize=10)
    save(figure, output)
