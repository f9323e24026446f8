"""One sheet about the run of a capture: histograms, a slice through them, what was found, and how well it fits."""

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import MaxNLocator

from isochron.pictures.capture_run import METRES_PER_PS
from isochron.pictures.curves import edges_of
from isochron.pictures.scene_views import draw_views, residuals
from isochron.pictures.scales import scale_of
from isochron.pictures.sheets import save

COUNTS, FIT, REST = "#7f9fbf", "#c1272d", "#4d4d4d"
DEVIATIONS = 4.0  # end of the scale of residuals
STYLE = {"font.size": 9, "axes.titlesize": 10, "axes.labelsize": 9, "xtick.labelsize": 8.5, "ytick.labelsize": 8.5,
         "legend.fontsize": 8.5, "figure.titlesize": 13, "axes.grid": False}


def path_axis(axes, direction):
    """A second axis opposite to that of time, with path lengths."""
    ways = (lambda ps: np.asarray(ps) * METRES_PER_PS, lambda metres: np.asarray(metres) / METRES_PER_PS)
    second = axes.secondary_xaxis("top", functions=ways) if direction == "x" else axes.secondary_yaxis("right", functions=ways)
    (second.set_xlabel if direction == "x" else second.set_ylabel)("path length (m)")
    return second


def shade_unused(axes, run, shade):
    """Grey over the bins that the fit did not use: `shade` is axvspan or axhspan."""
    for g in np.flatnonzero(~run.used_bins):
        shade(run.times[g], run.times[g + 1], color="0.88", lw=0, zorder=0)


def draw_histogram(upper, lower, run, number, point, first):
    column, row = point
    counts, fit = run.counts[:, column, row], run.fit[:, column, row]
    upper.stairs(counts, run.times, fill=True, color=COUNTS, alpha=0.6, lw=0, label="counts")
    upper.plot((run.times[1:] + run.times[:-1]) / 2, fit, color=FIT, lw=1.4, label="fit")
    upper.set_ylim(0, 1.08 * max(counts.max(), fit.max(), 1e-12))
    upper.tick_params(labelbottom=False)
    across, up, _ = run.wall.points[column, row]
    upper.text(0.98, 0.95, f"{number}", transform=upper.transAxes, ha="right", va="top", fontsize=12, weight="bold")
    # Names of a wall that is at an angle to the world's axes are too long for a title.
    place = "".join(f"{axis.name} = {where:.3f} m, " for axis, where in ((run.wall.across, across), (run.wall.up, up))
                    if len(axis.name) == 1)
    upper.set_title(f"{place}column {column}, row {row}")
    path_axis(upper, "x")
    rest = residuals(counts, fit)
    lower.axhspan(-2, 2, color="0.92", lw=0, zorder=0)
    lower.axhline(0, color="black", lw=0.6)
    lower.stairs(rest, run.times, color=REST, lw=0.8, baseline=None)
    bound = max(DEVIATIONS, np.nanmax(np.abs(rest), initial=0)) * 1.1
    lower.set_ylim(-bound, bound)
    lower.yaxis.set_major_locator(MaxNLocator(4, integer=True, symmetric=True))
    lower.set_xlabel("time (ps)")
    for axes in (upper, lower):
        axes.set_xlim(run.times[0], run.times[-1])
        axes.xaxis.set_major_locator(MaxNLocator(5))
        shade_unused(axes, run, axes.axvspan)
    if first:
        width = (run.times[1] - run.times[0])
        upper.set_ylabel(f"counts per bin of {width:.4g} ps")
        lower.set_ylabel(r"$(N-\mu)/\sqrt{\mu}$")
        upper.legend(loc="upper left", frameon=False)


def slice_of(run):
    """Counts and fit [T, N] of the middle row (of the column, where there is only one), positions of its points along
    the wall, the axis along which these lie, and words for all that."""
    columns, rows = run.used_points.shape
    if columns == 1 and rows > 1:
        taken, places, axis, words = (slice(None), 0), run.wall.points[0, :, 1], run.wall.up, "column 0"
    else:
        row = rows // 2
        taken, places, axis = (slice(None), slice(None), row), run.wall.points[:, row, 0], run.wall.across
        words = f"row {row}, the middle one of {rows}" if rows > 1 else "the only row"
        if rows > 1 and np.ptp(run.wall.points[:, row, 1]) < 1e-6:
            words = f"row {row}, {run.wall.up.name} = {run.wall.points[0, row, 1]:.3f} m"
    order = np.argsort(places, kind="stable")
    counts, fit = run.counts[taken][:, order], run.fit[taken][:, order]
    if len(places) > 1 and np.any(np.diff(places[order]) <= 0):  # points in no order: their numbers instead
        return run.counts[taken], run.fit[taken], np.arange(len(places)), "number of the sensor point", False, words
    return counts, fit, places[order], axis.label, axis.inverted, words


def draw_slices(figure, run):
    counts, fit, places, label, inverted, words = slice_of(run)
    scale = scale_of(counts, fit)
    panels = figure.subplots(1, 3)
    rest = np.ma.masked_invalid(residuals(counts, fit))
    images = (("counts", counts, "inferno", (0, scale)), ("fit", fit, "inferno", (0, scale)),
              ("residual", rest, "RdBu_r", (-DEVIATIONS, DEVIATIONS)))
    for axes, (title, values, colours, (low, high)) in zip(panels, images):
        cmap = matplotlib.colormaps[colours].with_extremes(bad="0.7")
        mesh = axes.pcolormesh(edges_of(places), run.times, values, cmap=cmap, vmin=low, vmax=high, rasterized=True)
        axes.set_title(f"{title.capitalize()}, {words}")
        axes.set_xlabel(label)
        if inverted:
            axes.invert_xaxis()
        beyond = np.abs(np.nan_to_num(np.ma.filled(values, 0))).max() > high
        extend = ("both" if low < 0 else "max") if beyond else "neither"
        if axes is not panels[0]:
            axes.tick_params(labelleft=False)
        if axes is panels[-1]:
            path_axis(axes, "y")
        bar = figure.colorbar(mesh, ax=axes, extend=extend, pad=0.02, aspect=24)
        bar.set_label("standard deviations" if low < 0 else "counts per bin")
        for edge in np.flatnonzero(np.diff(run.used_bins.astype(int))):
            axes.axhline(run.times[edge + 1], color="white" if low == 0 else "black", lw=0.8, ls="--")
    panels[0].set_ylabel("time (ps)")


def draw_sheet(run, output):
    with matplotlib.rc_context(STYLE):
        figure = plt.figure(figsize=(16, 12.4), layout="constrained")
        spots = f", spot 1 of {run.spots} of the laser" if run.spots > 1 else ""
        figure.suptitle(f"{run.name}{spots}", weight="bold")
        top, middle, bottom = figure.subfigures(3, 1, height_ratios=[1.08, 0.88, 1.24], hspace=0.02)
        chosen = run.wall.spread_points(run.used_points)
        panels = top.subplots(2, len(chosen), squeeze=False, height_ratios=[2.6, 1], sharex="col")
        for number, (point, upper, lower) in enumerate(zip(chosen, *panels), start=1):
            draw_histogram(upper, lower, run, number, point, number == 1)
        draw_slices(middle, run)
        draw_views(bottom, run, chosen)
        save(figure, output)
