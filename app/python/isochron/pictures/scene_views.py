"""The result as seen from the wall: albedo, depth and the data's back-projection; and a box of numbers."""

import matplotlib
import matplotlib.patheffects
import numpy as np
from matplotlib.tri import Triangulation

from isochron.pictures.back_projection import BackProjection
from isochron.pictures.deviance import Fit
from isochron.pictures.wall import Plane

MOST_SCALARS = 8
VALUES = 92  # points from the left of the box of numbers: where values begin, wider than the longest name


def residuals(counts, means):
    """Standard deviations of Poisson numbers by which counts differ from their means; not a number where none is due."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(means > 0, (counts - means) / np.sqrt(means), np.nan)


def extent_of(run):
    """Corners of the pictures: the wall and the surfaces, of which at most what lies within a wall's size of it."""
    low, high = run.wall.low, run.wall.high
    size = max((high - low).max(), 1e-3)
    if run.surfaces:
        places = np.concatenate([s.points[:, :2] for s in run.surfaces])
        low, high = np.minimum(low, places.min(axis=0)), np.maximum(high, places.max(axis=0))
    low, high = np.maximum(low, run.wall.low - size), np.minimum(high, run.wall.high + size)
    # A wall that is a line still needs a picture.
    middle, half = (low + high) / 2, np.maximum((high - low) / 2, 0.25 * size)
    return middle - half, middle + half


def draw_surfaces(axes, run, values, colours, scale):
    """Values per vertex, interpolated over triangles, the farthest first: nearer ones hide them."""
    mesh = None
    for surface, shades in zip(run.surfaces, values):
        if shades is None:
            continue
        order = np.argsort(-surface.points[surface.triangles, 2].mean(axis=1), kind="stable")
        triangles = Triangulation(surface.points[:, 0], surface.points[:, 1], surface.triangles[order])
        mesh = axes.tripcolor(triangles, np.clip(shades, *scale), shading="gouraud", cmap=colours, vmin=scale[0],
                              vmax=scale[1])
    return mesh


class Views:
    """Pictures side by side, equal in extent and orientation, and beside them room for a box of numbers where it is wanted."""

    def __init__(self, figure, run, low, high, chosen, count, with_box):
        self.figure, self.run, self.low, self.high, self.chosen = figure, run, low, high, chosen
        ratios = [1] * count + ([0.8 if count > 2 else 0.62] if with_box else [])
        self.free = list(figure.subplots(1, len(ratios), width_ratios=ratios, squeeze=False)[0])
        self.box = self.free.pop() if with_box else None

    def add(self, title, draw, label, extend="neither"):
        axes = self.free.pop(0)
        axes.set_facecolor("0.8")
        mesh = draw(axes)
        wall = self.run.wall
        for k, (point, ring) in enumerate((p, r) for p in self.chosen for r in ("black", "white")):
            place = wall.points[point]
            axes.plot(place[0], place[1], "o", ms=5.5 if ring == "black" else 4, mfc="none", mec=ring, mew=1)
            if ring == "white":
                words = axes.annotate(str(k // 2 + 1), place[:2], (4, 3), textcoords="offset points", fontsize=9,
                                      color="white", weight="bold")
                words.set_path_effects([matplotlib.patheffects.withStroke(linewidth=2, foreground="black")])
        horizontal, vertical = (self.low[0], self.high[0]), (self.low[1], self.high[1])
        axes.set_xlim(horizontal[::-1] if wall.across.inverted else horizontal)
        axes.set_ylim(vertical[::-1] if wall.up.inverted else vertical)
        axes.set_aspect("equal")
        axes.set_xlabel(wall.across.label)
        axes.set_ylabel(wall.up.label)
        axes.set_title(title)
        # Beside the picture itself, whose height depends on the wall's shape.
        self.figure.colorbar(mesh, cax=axes.inset_axes([1.025, 0, 0.04, 1]), extend=extend).set_label(label)


def scale_of_albedo(values):
    """0 to a high percentile: single vertices that hardly any light reaches can have any albedo."""
    values = np.concatenate(values)
    return 0.0, max(float(np.percentile(values, 99)), 1e-6), bool(values.max() > np.percentile(values, 99))


def draw_views(figure, run, chosen, with_box=True):
    """Returns what stands in the box: names and values, a heading being a name without a value."""
    low, high = extent_of(run)
    painted = [s.albedo for s in run.surfaces]
    planes = {s.name: Plane(s.points) for s in run.surfaces}
    bent = [s.points[:, 2] if not planes[s.name].flat or len(run.surfaces) > 1 else None for s in run.surfaces]
    has_paint, has_depth = (any(v is not None for v in values) for values in (painted, bent))
    views = Views(figure, run, low, high, chosen, 1 + has_paint + has_depth, with_box)
    if has_paint:
        first, last, beyond = scale_of_albedo([v for v in painted if v is not None])
        views.add("Recovered albedo, seen from the wall",
                  lambda axes: draw_surfaces(axes, run, painted, "inferno", (first, last)), "albedo",
                  "max" if beyond else "neither")
    depths = np.concatenate([s.points[:, 2] for s in run.surfaces]) if run.surfaces else None
    if has_depth:
        views.add("Recovered depth, seen from the wall",
                  lambda axes: draw_surfaces(axes, run, bent, "viridis_r", (depths.min(), depths.max())),
                  "distance from the wall (m)")
    projection = BackProjection(run, low, high, None if depths is None else (depths.min(), depths.max()))
    picture = np.maximum(projection.picture, 0)
    picture = picture / max(picture.max(), 1e-12)
    views.add("Filtered back-projection of the counts",
              lambda axes: axes.imshow(picture, cmap="inferno", vmin=0, vmax=1, origin="lower", aspect="equal",
                                       interpolation="nearest", extent=projection.extent),
              "relative to its maximum")
    lines = lines_about(run, planes, projection)
    if with_box:
        write_box(views.box, lines)
    return lines


def lines_about(run, planes, projection):
    lines = [("The data", None), *about_data(run), ("The fit", None), *about_fit(run)]
    for name, plane in planes.items():
        if plane.flat:
            lines += list(zip((f"{name}, flat", ""), plane.describe(run.wall)))
    lines += [("The back-projection", None), ("filter", "second derivative along time"),
              ("", f"of gaussians of {projection.sigma / run.ps:.3g} ps"),
              ("maximum over", f"depths {projection.depths[0]:.3f} to {projection.depths[-1]:.3f} m")]
    return lines


def write_box(axes, lines):
    axes.axis("off")
    step = min(0.056, 1.0 / len(lines))
    for i, (name, value) in enumerate(lines):
        y = 1.02 - i * step
        for text, place in ((name, 0), (value or "", VALUES)):
            axes.annotate(text, (0, y), (place, 0), xycoords="axes fraction", textcoords="offset points", va="top",
                          weight="bold" if value is None else "normal", annotation_clip=False)


def about_data(run):
    columns, rows = run.used_points.shape
    laser = "confocal" if run.confocal else "one spot of the laser" if run.spots == 1 else f"spot 1 of {run.spots}"
    used = run.counts[:, run.used_points].sum(axis=0, dtype=float)
    size = run.wall.high - run.wall.low
    yield "points", f"{columns} x {rows}, {laser}"
    if not run.used_points.all():
        yield "", f"{run.used_points.sum()} of them used"
    yield "wall", f"{size[0]:.3g} m x {size[1]:.3g} m"
    yield "bins", f"{len(run.fit)} of {run.delta / run.ps:.4g} ps, from {run.times[0]:.4g} ps"
    if not run.used_bins.all():
        yield "", f"{run.used_bins.sum()} of them used"
    yield "counts of a point", f"{used.mean():.4g} ({used.min():.4g} to {used.max():.4g})"


def about_fit(run):
    fit = Fit(run)
    if run.summary:
        status = str(run.summary.get("status")).replace("_", " ")
        end = "" if status == "iterations reached" else f", {status}"
        yield "run", f"{run.summary.get('iterations')} iterations{end}"
    yield "deviance per degree of freedom", ""
    yield "   fit", f"{fit.fitted:.4f}"
    yield "   drawn from it", f"{fit.drawn:.4f} (Poisson numbers)"
    yield "   ratio", f"{fit.ratio:.4f}"
    if fit.dark:
        yield "", f"without {fit.dark} readings of mean 0"
    scalars = [(name, value[0]) for name, value in run.values.items() if len(value) == 1]
    for name, value in scalars[:MOST_SCALARS]:
        yield name, f"{value:.5g}{run.unit_of(name)}"
    if any(str(s.get("type")).startswith("camera_") for s in run.specs.values()):
        yield "", "the wall is drawn where the scene has it"
