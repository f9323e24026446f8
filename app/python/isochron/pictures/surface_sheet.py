"""surface.png of a reconstruction: depth, albedo and standard error of the surface, and what back-projection has of them, as who
stands at the wall sees them. What the data do not determine is pale."""

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from isochron.pictures.capture_sheet import STYLE
from isochron.pictures.raster import Seen
from isochron.pictures.reading import numbers
from isochron.pictures.scene_views import Views, extent_of, scale_of_albedo, write_box
from isochron.pictures.sheets import save

PIXELS = 400  # along the longer side
MARGIN = 0.06  # of the surfaces' extent
PALE = 0.75  # of white in what is not determined
OUTLIERS = 0.5  # percent of the depths that are seen may be beyond either end of their colours
WIDTH, PANEL, LINES = 13, 2.7, 0.9  # inches: of the figure, of a picture, and the height of what is written about it
DEPTH, ALBEDO, ERROR = "viridis_r", "inferno", "plasma"


def shades(values, colours, low, high, undetermined=None):
    """RGBA; without colour where values are missing, unless they are undetermined."""
    rgba = matplotlib.colormaps[colours](Normalize(low, high)(np.nan_to_num(values, nan=high)))
    rgba[np.isnan(values), 3] = 0
    if undetermined is not None:
        rgba[undetermined, :3] += PALE * (1 - rgba[undetermined, :3])
        rgba[undetermined, 3] = 1
    return rgba


class Sight:
    """One of the surfaces on the pictures' pixels [up, across]; errors are in millimetres."""

    def __init__(self, found, surface, across, up):
        seen = Seen(surface.points, surface.triangles, across, up)
        self.depth = seen.depth
        self.albedo = None if surface.albedo is None else seen.of(surface.albedo)
        self.lit = np.isfinite(self.depth) if self.albedo is None else self.albedo >= found.least_lit(surface)
        self.errors = self.undetermined = self.known = None
        if surface.errors is not None:
            errors = seen.of(surface.errors)
            self.errors = 1000 * errors
            self.undetermined = np.isfinite(self.depth) & found.undetermined(errors)
            self.known = self.errors[np.isfinite(self.depth) & ~self.undetermined]


def pixels_of(found):
    """Corners of the pictures, which hold all that is not dark of the surfaces, and the places of their pixels."""
    low, high = extent_of(found)
    places = np.concatenate([surface.points[found.lit(surface), :2] for surface in found.surfaces])
    margin = MARGIN * np.ptp(places, axis=0).max()
    low, high = np.maximum(low, places.min(axis=0) - margin), np.minimum(high, places.max(axis=0) + margin)
    step = (high - low).max() / PIXELS
    return low, high, *(np.arange(a + step / 2, b, step) for a, b in zip(low, high))


class Row:
    """Pictures of one surface."""

    def __init__(self, figure, found, surface, sight, corners):
        self.surface, self.sight, self.corners = surface, sight, corners
        self.views = Views(figure, found, *corners, [], 3, with_box=False)

    def add(self, what, values, colours, scale, label, extend):
        picture = shades(values, colours, *scale, self.sight.undetermined)
        title = f"{self.surface.name.capitalize()}: {what}"
        self.views.add(title, lambda axes: draw_picture(axes, picture, colours, scale, self.corners), label, extend)

    def draw(self, found, depths):
        """Returns axes that are left empty."""
        sight = self.sight
        self.add("depth", sight.depth, DEPTH, depths, "distance from the wall (m)", "both")
        if sight.albedo is not None:
            first, last, beyond = scale_of_albedo([self.surface.albedo])
            self.add("albedo", sight.albedo, ALBEDO, (first, last), "albedo, relative", "max" if beyond else "neither")
        if sight.errors is not None:
            self.add("standard error", sight.errors, ERROR, (0, end_of_errors(found, sight.known)), "along the normal (mm)", "max")
        for axes in self.views.free:
            axes.axis("off")
        return self.views.free


def surface_figure(found):
    """To be saved or closed by who calls."""
    low, high, across, up = pixels_of(found)
    sights = [Sight(found, surface, across, up) for surface in found.surfaces]
    depths = np.concatenate([sight.depth[sight.lit] for sight in sights])
    ends = np.percentile(depths, [OUTLIERS, 100 - OUTLIERS]) if depths.size else (0, 1)
    with matplotlib.rc_context(STYLE):
        height = PANEL * float(np.clip((high - low)[1] / (high - low)[0], 0.3, 2)) + LINES
        figure = plt.figure(figsize=(WIDTH, 0.4 + height * len(sights)), layout="constrained")
        figure.suptitle(f"{found.name}: seen from the wall", weight="bold")
        parts = figure.subfigures(len(sights), 1, squeeze=False)[:, 0]
        for part, surface, sight in zip(parts, found.surfaces, sights):
            free = Row(part, found, surface, sight, (low, high)).draw(found, ends)
        if free:
            write_box(free[-1], lines_about(found, sights))
    return figure


def draw_surface_sheet(found, output):
    save(surface_figure(found), output)


def draw_picture(axes, picture, colours, scale, corners):
    low, high = corners
    axes.imshow(picture, origin="lower", interpolation="nearest", extent=(low[0], high[0], low[1], high[1]))
    return ScalarMappable(Normalize(*scale), colours)


def end_of_errors(found, known):
    """Of the colours of errors in millimetres, of which those that the data determine are given: nearly all lie below it."""
    return float(np.percentile(known, 99)) if known.size else 1000 * found.resolution


def lines_about(found, sights):
    """Names and values, a heading being a name without a value."""
    lines, fit = [("The fit", None)], found.summary.get("fit")
    if isinstance(fit, dict):
        lines.append(("the data are", str(fit.get("verdict")).replace("_", " ")))
    if found.fit:
        lines += about_fit(found, sights[0])
    start = found.summary.get("start")
    lines += [("Back-projection", None), ("vertices", f"{len(found.back_projection.points)}")]
    if found.fit:
        lines += off_the_fit(*sights)
    if isinstance(start, dict) and start.get("significance") is not None:
        lines.append(("significance", f"{numbers(start['significance'])[0]:.3g} standard deviations"))
    return lines


def about_fit(found, sight):
    yield "vertices", f"{len(found.fit.points)}"
    dark = np.count_nonzero(~found.lit(found.fit))
    if dark:
        yield "of them dark", f"{dark}, which may be out of view"
    if sight.errors is not None:
        seen = np.count_nonzero(np.isfinite(sight.depth))
        yield "standard error", f"{np.median(sight.known):.2g} mm in the median" if sight.known.size else "unknown"
        yield "not determined", f"{100 * sight.undetermined.sum() / max(1, seen):.2g} % of what is seen (pale)"


def off_the_fit(fit, back_projection):
    off = np.abs(fit.depth - back_projection.depth)
    if np.isfinite(off).any():
        yield "off the fit's depth", f"{1000 * np.nanmedian(off):.2g} mm in the median"
