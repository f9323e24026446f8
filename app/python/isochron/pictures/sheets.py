"""Sheets of gated images: a cell per image, of bounded size however many gates there are."""

import textwrap

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib import colors
from matplotlib.cm import ScalarMappable

from isochron.files import replacing
from isochron.pictures.scales import NON_FINITE, pick_gates, scale_of, srgb

COMPONENTS = ["total", "interior", "visibility", "path_length"]
MOST_IMAGES, MOST_COLUMNS = 40, 10  # cells of a sheet of images, columns of a sheet with a row per component
MOST_CHOSEN = 12  # cells of a sheet of images of more gates, each of which takes time


def save(figure, path):
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", dpi=110)
    plt.close(figure)


def plain_ticks(axis):
    """1.25, 0.003 and 2e-7 rather than multiples of a common power of ten."""
    axis.set_major_formatter(matplotlib.ticker.FuncFormatter(lambda x, _: f"{x:.4g}"))


class Sheet:
    """A figure of equal cells below a title, with row names at the left and a colour bar at the right.

    All lengths are in inches. Columns have a label at the top (`column_labels`), or each cell its own.
    """

    BOTTOM, RIGHT, LABEL, GAP, LINE = 0.15, 1.15, 0.22, 0.08, 0.19

    def __init__(self, rows, columns, aspect, title, left=0.15):
        self.cell_width = float(np.clip(11 / columns, 1.0, 2.6))
        self.cell_height = self.cell_width / aspect
        # Tall images must not make an endless sheet.
        shrink = min(1.0, 16 / (rows * (self.cell_height + self.LABEL)))
        self.cell_width, self.cell_height = shrink * self.cell_width, shrink * self.cell_height
        self.left, self.rows, self.columns = left, rows, columns
        self.top = 0.2 + self.LINE * len(title)
        longest = max(len(line) for line in title)
        self.width = max(left + columns * (self.cell_width + self.GAP) + self.RIGHT, 0.085 * longest + 0.4, 4.6)
        self.height = max(self.top + rows * (self.cell_height + self.LABEL) + self.BOTTOM, self.top + 2.6)
        self.figure = plt.figure(figsize=(self.width, self.height))
        for i, line in enumerate(title):
            y = 1 - (0.12 + i * self.LINE) / self.height
            self.figure.text(0.15 / self.width, y, line, ha="left", va="top", fontsize=10 if i == 0 else 8.5)

    def _axes(self, x, y, w, h):
        return self.figure.add_axes([x / self.width, y / self.height, w / self.width, h / self.height])

    def cell(self, row, column, text, image):
        """Axes for one image, labelled; red where some of it is not finite."""
        x = self.left + column * (self.cell_width + self.GAP)
        y = self.height - self.top - (row + 1) * (self.cell_height + self.LABEL)
        axes = self._axes(x, y, self.cell_width, self.cell_height)
        axes.set_xticks([])
        axes.set_yticks([])
        bad = np.count_nonzero(~np.isfinite(image))
        if bad:
            text += f" ({bad} not finite)"
        axes.set_title(text, fontsize=8, pad=3, color="red" if bad else "black")
        return axes

    def colorbar(self, mappable, label, extend):
        x = self.left + self.columns * (self.cell_width + self.GAP) + 0.05
        height = float(np.clip(self.rows * (self.cell_height + self.LABEL) - self.LABEL, 2.2, 5.0))
        axes = self._axes(x, self.height - self.top - self.LABEL - height, 0.14, height)
        bar = self.figure.colorbar(mappable, cax=axes, extend=extend)
        bar.set_label(textwrap.fill(label, 34), fontsize=8)
        bar.ax.tick_params(labelsize=8)
        plain_ticks(bar.ax.yaxis)


def about_gates(gates, shown):
    """What the labels of cells are, and which gates were left out."""
    what = "" if gates.centers is None else f"above each image: its gate's centre, {gates.axis}"
    left_out = "" if len(shown) == gates.count else f"{len(shown)} of {gates.count} gates, evenly spread from gate {shown[0]} to {shown[-1]}"
    return [line for line in (what, left_out) if line]


def brightening(image, scale):
    """1, 10 or 100: by how much an image may be brighter without leaving the scale, where it would else use a tenth of it."""
    own = scale_of(image) if np.any(np.nan_to_num(image)) else scale
    return 10 ** int(np.clip(np.floor(np.log10(scale / own)), 0, 2)) if own > 0 and scale > 0 else 1


def plot_images(path, *what):
    """See draw_images."""
    save(draw_images(*what), path)


def draw_images(title, stack, scale, gates):
    """A figure of gated images: grey scenes in false colour, RGB scenes in their own, equally exposed. Gates that would be nearly
    black are brighter by a power of ten, which their labels give."""
    shown = pick_gates(MOST_IMAGES, stack, among=gates.read)
    height, width = stack.shape[1:3]
    columns = len(shown) if len(shown) <= 6 else int(np.ceil(np.sqrt(1.4 * len(shown))))
    sheet = Sheet(-(-len(shown) // columns), columns, width / height, [title, *about_gates(gates, shown)])
    norm = colors.Normalize(0, scale)
    factors = [brightening(stack[g], scale) for g in shown]
    bright = stack[shown] * np.reshape(factors, (-1,) + (1,) * (stack.ndim - 1))
    if stack.ndim == 4:
        picture = srgb(np.nan_to_num(bright / scale, nan=0, posinf=1, neginf=0))
        picture[~np.isfinite(stack[shown]).all(-1)] = colors.to_rgb(NON_FINITE)
        cmap = colors.ListedColormap(np.repeat(srgb(np.linspace(0, 1, 256))[:, None], 3, axis=1))
    else:
        picture = np.ma.masked_invalid(bright)
        cmap = matplotlib.colormaps["inferno"].with_extremes(bad=NON_FINITE)
    for i, g in enumerate(shown):
        label = gates.label(g) + (f", × {factors[i]}" if factors[i] > 1 else "")
        axes = sheet.cell(*divmod(i, columns), label, stack[g])
        axes.imshow(picture[i], cmap=cmap, norm=norm, interpolation="nearest")
    extend = "max" if np.nanmax(np.nan_to_num(stack[shown]), initial=0) > scale else "neither"
    sheet.colorbar(ScalarMappable(norm, cmap), gates.quantity, extend)
    return sheet.figure


def plot_signed(path, *what):
    """See draw_signed."""
    save(draw_signed(*what), path)


def draw_signed(title, rows, quantity, gates):
    """A figure of images of either sign, red above zero, blue below: a row for each of `rows` (name -> stack), a column per gate.

    Rows that are zero everywhere are named instead of drawn.
    """
    zero = [name for name, stack in rows.items() if not np.any(np.nan_to_num(gates.known(stack), nan=1))]
    drawn = {name: stack for name, stack in rows.items() if name not in zero} or dict(list(rows.items())[:1])
    shown = pick_gates(MOST_COLUMNS, *drawn.values(), among=gates.read)
    height, width = next(iter(drawn.values())).shape[1:3]
    lines = [title, *about_gates(gates, shown)]
    if zero:
        where = "everywhere" if gates.read is None else "in these gates"
        lines.append(f"zero {where}: {', '.join(name or 'all' for name in zero)}")
    sheet = Sheet(len(drawn), len(shown), width / height, lines, left=0.4)
    drawn = {name: stack[shown].mean(-1) if stack.ndim == 4 else stack[shown] for name, stack in drawn.items()}
    scale = scale_of(*drawn.values())
    norm = colors.Normalize(-scale, scale)
    cmap = matplotlib.colormaps["RdBu_r"].with_extremes(bad=NON_FINITE)
    beyond = False
    for row, (name, stack) in enumerate(drawn.items()):
        beyond |= bool(np.abs(np.nan_to_num(stack)).max() > scale)
        for column, g in enumerate(shown):
            axes = sheet.cell(row, column, gates.label(g) if row == 0 else "", stack[column])
            axes.imshow(np.ma.masked_invalid(stack[column]), cmap=cmap, norm=norm, interpolation="nearest")
            if column == 0 and name:
                axes.set_ylabel(name, fontsize=9)
    sheet.colorbar(ScalarMappable(norm, cmap), quantity, "both" if beyond else "neither")
    return sheet.figure


def plot_derivatives(path, title, stacks, parameter, gates):
    """Derivative images by one parameter: a row per term."""
    order = [c for c in COMPONENTS if c in stacks] + sorted(c for c in stacks if c not in COMPONENTS)
    plot_signed(path, title, {c: stacks[c] for c in order}, f"d({gates.quantity}) / d({parameter})", gates)
