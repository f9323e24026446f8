"""Draws what `isochron chart` and `isochron stability` wrote into a folder, as far as it is there: chart.png from
chart.csv and chart_table.csv, chart_solvers.png and stability.png from files of the same name.

usage: plot_chart.py DIR
"""

import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from isochron.pictures.reading import PlotError
from isochron.pictures.sheets import save

# Colour says what kind of method it is, marker and dashes which one.
STYLES = {
    "standard": ("tab:red", "o"),
    "ellipsoidal_uncoupled": ("tab:orange", "s"),
    "ellipsoidal_coupled": ("tab:blue", "D"),
    "auto": ("black", "*"),
    "3_bounces": ("tab:purple", "P"),
    "paper": ("tab:brown", "X"),
}
STEEP = -0.65  # slopes of fewer samples than the law of -1/2 needs
MARKERS = "osDv^<>Pp"  # of other methods, one after the other
DIFFERENCES = [("#1b7837", "v"), ("#5aae61", "^"), ("#a6dba0", ">")]


def read_rows(path):
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise PlotError(f"{path}: no rows")
    return rows


def percent(relative):
    """Two digits, but no powers of ten."""
    return f"{100 * relative:.2g} %" if relative < 1 else f"{100 * relative:.0f} %"


def number(text):
    return float(text) if text else np.nan


def styles(methods):
    """Method -> colour and marker; finite differences in the order of the file."""
    differences = [m for m in methods if m.startswith("finite_difference")]
    others = {m: DIFFERENCES[i % len(DIFFERENCES)] for i, m in enumerate(differences)}
    rest = [m for m in methods if m not in STYLES and m not in others]
    others |= {m: (f"C{i % 10}", MARKERS[i % len(MARKERS)]) for i, m in enumerate(rest)}
    return {m: STYLES.get(m) or others[m] for m in methods}


def plain(method):
    """A method's name for people."""
    method = method.replace("finite_difference_", "finite differences, step ")
    return method.replace("_independent", ", independent images").replace("_", " ")



def draw_chart(folder):
    """Relative error over core-seconds of a gradient: measured points, and the fitted law with its bias beyond."""
    rows, table = read_rows(folder / "chart.csv"), read_rows(folder / "chart_table.csv")
    reference = float(rows[0]["error"])
    methods = [row["method"] for row in table]
    style = styles(methods)
    points = {m: [(float(r["core_seconds"]), float(r["error"])) for r in rows if r["method"] == m] for m in methods}
    all_times = [t for p in points.values() for t, _ in p]
    all_errors = [e for p in points.values() for _, e in p if e > 0]
    finite = [float(r["core_seconds"]) for r in table if np.isfinite(float(r["core_seconds"]))]
    low_error = min(0.005, 0.7 * min(all_errors))
    left, right = 0.6 * min(all_times), 4 * max(all_times + finite)
    top = 2 * max(all_errors)

    figure, axis = plt.subplots(figsize=(10, 6), layout="constrained")
    times = np.geomspace(left, right, 200)
    for level in np.arange(np.log10(low_error * np.sqrt(left)) - 1, np.log10(top * np.sqrt(right)) + 1, 0.5):
        axis.plot(times, 10**level / np.sqrt(times), color="0.9", lw=0.7, zorder=0)
    axis.axhline(0.01, color="0.3", lw=1, ls=":", zorder=1)
    axis.text(right, 0.0102, "1 % ", ha="right", va="bottom", fontsize=8, color="0.3")
    if reference > low_error:
        axis.axhspan(low_error, reference, color="0.5", alpha=0.08, zorder=0)
        axis.text(right, reference * 0.97, f"error of the reference, {percent(reference)} ", ha="right", va="top",
                  fontsize=7, color="0.45")
    for row in table:
        method, (color, marker) = row["method"], style[row["method"]]
        x, y = zip(*points[method])
        seconds = float(row["core_seconds"])
        biased = row["bias_significant"] == "true"
        bias2 = float(row["bias2"]) if biased else 0.0
        bound = "at most " if number(row["slope"]) < STEEP else ""
        what = f"{bound}{seconds:.3g} s" if np.isfinite(seconds) else f"never, bias {percent(np.sqrt(bias2))}"
        axis.plot(x, y, marker, color=color, ms=9 if marker == "*" else 6, label=f"{plain(method)}: {what}", zorder=3)
        beyond = times[times >= x[max(0, len(x) - 3)]]
        law = float(row["rate"]) / beyond + bias2
        axis.plot(beyond, np.sqrt(law), color=color, lw=1.3, ls="-" if not biased else "--", zorder=2)
        if biased:
            axis.plot([x[0], right], [np.sqrt(bias2)] * 2, color=color, lw=0.8, ls=":", zorder=1)
    axis.set(xscale="log", yscale="log", xlim=(left, right), ylim=(low_error, top))
    axis.set_xlabel("core-seconds for one gradient")
    axis.set_ylabel("error of the gradient, relative to its norm")
    axis.set_title(f"{folder.resolve().name}: error against time (points measured, lines fitted; grey: slope -1/2)", fontsize=10)
    axis.legend(title="core-seconds to 1 % error", fontsize=8, title_fontsize=8, loc="center left",
                bbox_to_anchor=(1.01, 0.5), frameon=False)
    save(figure, folder / "chart.png")


def draw_stability(folder):
    """Two maps over width and method: estimates that point the right way, and the error that a reconstruction leaves."""
    rows = read_rows(folder / "stability.csv")
    widths = sorted({float(r["width"]) for r in rows}, reverse=True)
    methods = list(dict.fromkeys(r["method"] for r in rows))
    cells = {(float(r["width"]), r["method"]): r for r in rows}

    def grid(column):
        return np.array([[number(cells[w, m][column]) for m in methods] for w in widths])

    size = (2 * (1.0 * len(methods) + 1.6), 0.55 * len(widths) + 2.3)
    figure, axes = plt.subplots(1, 2, figsize=size, sharey=True, layout="constrained")
    panels = [
        ("positive", "gradient estimates that point the right way", "RdYlGn", matplotlib.colors.Normalize(0.5, 1)),
        ("error_ratio", "error after a short reconstruction / before", "RdYlGn_r", matplotlib.colors.LogNorm(0.01, 1.5)),
    ]
    for axis, (column, title, cmap, norm) in zip(axes, panels):
        values = grid(column)
        colormap = matplotlib.colormaps[cmap].with_extremes(bad="0.85")
        image = axis.imshow(np.ma.masked_invalid(values), cmap=colormap, norm=norm, aspect="auto")
        for i, width in enumerate(widths):
            for j, method in enumerate(methods):
                value = values[i, j]
                text = "-" if np.isnan(value) else f"{100 * value:.0f} %" if column == "positive" else f"{value:.2g}"
                if reason := cells[width, method]["failure"]:
                    text += f"\n{reason}"
                shade = float(np.ma.filled(norm(value), np.nan))
                color = "white" if shade < 0.12 or shade > 0.9 else "black"  # the ends of the scale are dark
                axis.text(j, i, text, ha="center", va="center", fontsize=7, color=color)
        axis.set_title(title, fontsize=10)
        axis.set_xticks(range(len(methods)), [plain(m).replace(", ", ",\n").replace(" un", "\nun").replace(" co", "\nco")
                                              for m in methods], fontsize=7, rotation=30, ha="right")
        axis.set_yticks(range(len(widths)), [f"{w:.2g}" if w else "Dirac" for w in widths], fontsize=8)
        figure.colorbar(image, ax=axis, shrink=0.8, extend="both").ax.tick_params(labelsize=7)
    axes[0].set_ylabel("gate width, standard deviation / path length")
    figure.suptitle(f"{folder.resolve().name}: all methods at the same CPU time per gradient; words: why a cell fails",
                    fontsize=10)
    save(figure, folder / "stability.png")


def draw_solvers(folder):
    """Error of the parameters over core-seconds, a line per run."""
    rows = read_rows(folder / "chart_solvers.csv")
    colors = {"adam": "tab:blue", "lbfgs": "tab:orange", "levenberg_marquardt": "tab:green", "quasi_newton": "tab:red"}
    figure, axis = plt.subplots(figsize=(8, 5), layout="constrained")
    first = min(float(r["core_seconds"]) for r in rows if float(r["core_seconds"]) > 0)
    for method, seed in dict.fromkeys((r["method"], r["seed"]) for r in rows):
        run = [r for r in rows if (r["method"], r["seed"]) == (method, seed)]
        # The start, at no time at all, stands at the left edge.
        times = [max(float(r["core_seconds"]), 0.7 * first) for r in run]
        label = plain(method) if seed == run[0]["seed"] == rows[0]["seed"] else None
        axis.loglog(times, [100 * float(r["error"]) for r in run], color=colors.get(method, "grey"), lw=1.1, marker=".",
                    ms=3, alpha=0.8, label=label)
    axis.axhline(1, color="0.3", lw=1, ls=":")
    axis.set(xlabel="core-seconds (the target is not counted)", ylabel="error of the parameters, % of the initial one")
    axis.set_title(f"{folder.resolve().name}: reconstructions, a line per seed", fontsize=10)
    axis.grid(True, which="both", lw=0.3, alpha=0.4)
    axis.legend(fontsize=8)
    save(figure, folder / "chart_solvers.png")


def main(arguments):
    if arguments in (["-h"], ["--help"]):
        print(__doc__.strip())
        return 0
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print("usage: plot_chart.py DIR", file=sys.stderr)
        return 2
    folder = pathlib.Path(arguments[0])
    drawings = {"chart.csv": draw_chart, "chart_solvers.csv": draw_solvers, "stability.csv": draw_stability}
    found = [name for name in drawings if (folder / name).exists()]
    try:
        if not found:
            raise PlotError(f"{folder}: none of {', '.join(drawings)}")
        for name in found:
            drawings[name](folder)
    except (PlotError, OSError, KeyError, ValueError, csv.Error) as error:
        print(f"plot_chart.py: {folder}: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
