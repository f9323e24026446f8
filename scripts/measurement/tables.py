"""Tables of MEASURED.md, in Markdown, from those of experiments/measured. Each function takes that folder."""

import math
import statistics

import numpy as np

import capture_cost
import cube_cost
import error_coverage
import interval_coverage
import public_scene
from reproduction.tables import markdown, read_rows

from .steps import CHARTED

STEEP = -0.65  # as app/python/isochron/plot_chart.py: slopes of fewer samples than the law of -1/2 needs
SHORT = {"ellipsoidal_uncoupled": "ellipsoidal, uncoupled", "ellipsoidal_coupled": "coupled pairs", "3_bounces": "3 bounces"}


def number(value):
    """Two digits, and no exponent that a reader would have to count by."""
    value = float(value)
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    if abs(value) >= 1e6 or abs(value) < 1e-4:
        mantissa, _, exponent = f"{value:.1e}".partition("e")
        return f"{mantissa} x 10^{int(exponent)}"
    value = float(f"{value:.2g}")
    return f"{value:.{max(0, 1 - math.floor(math.log10(abs(value))))}f}"


def figure8(folder):
    rows = {(r["gate"], r["figure"]): float(r["value"]) for r in read_rows(folder / "figure8.csv")}
    gates = list(dict.fromkeys(gate for gate, _ in rows))
    step = "step {}: {}"
    lines = {
        "spread of z where the derivative exceeds 1 % of its peak": "standard deviation of z where the derivative exceeds 1 % of the peak",
        "spread of z, all pixels": "standard deviation of z over all pixels",
        "largest standard error over the peak, ours": "largest standard error over peak: ours",
        "the same, finite differences": "largest standard error over peak: finite differences",
        "cost over that of finite differences with common numbers, median pixel": step.format(0.001, "cost of ours over common; median pixel"),
        "the same with a step four times as large": step.format(0.004, "cost of ours over common; median pixel"),
        "bias of that step, of the peak": step.format(0.004, "root mean square bias over peak"),
        "cost over that of finite differences with independent numbers": step.format(0.001, "cost of ours over independent; median pixel"),
    }

    def entry(gate, figure):
        value = rows[gate, figure]
        if figure.endswith("bias over peak") and value <= 0:  # the square root of an estimate that noise made negative, with its sign
            return "not resolved"
        return f"{value:.2f}" if "of z" in figure else number(value)

    return markdown(["", *(gate.replace("_", " ") for gate in gates)],
                    [[title, *(entry(gate, figure) for gate in gates)] for title, figure in lines.items()])


def figure9(folder):
    rows = [[r["term"].replace("_", " "), r["method"],
             *(number(r[key]) for key in ("gain", "gain_blocks_4", "gain_blocks_16", "gain_mean"))]
            for r in read_rows(folder / "figure9.csv") if r["method"] != "standard"]
    return markdown(["term", "method", "per pixel", "4 x 4 pixels", "16 x 16 pixels", "whole image"], rows)


def _chart_cell(row):
    if row is None:
        return ""
    seconds, slope = float(row["core_seconds"]), float(row["slope"])
    if math.isinf(seconds):
        return f"never: bias {number(100 * math.sqrt(float(row['bias2'])))} %"
    return ("≤ " if slope < STEEP else "") + number(seconds)


def charts(folder):
    kinds = ["standard", "ellipsoidal_uncoupled", "ellipsoidal_coupled", "auto", "finite differences", "3_bounces", "paper"]
    lines = []
    for name in CHARTED:
        rows = {r["method"]: r for r in read_rows(folder / f"chart_{name}_table.csv")}
        differences = [r for method, r in rows.items() if method.startswith("finite_difference")]
        rows["finite differences"] = min(differences, key=lambda r: float(r["core_seconds"]))
        lines.append([f"`{name}`", *(_chart_cell(rows.get(kind)) for kind in kinds)])
    header = ["", *(SHORT.get(kind, kind) for kind in kinds)]
    header[5] = "finite differences, best step"
    return markdown(header, lines)


def stability(folder, name):
    rows = read_rows(folder / f"stability_{name}.csv")
    methods = list(dict.fromkeys(r["method"] for r in rows))
    by = {(r["width"], r["method"]): r for r in rows}
    lines = []
    for width in dict.fromkeys(r["width"] for r in rows):
        cells = (by[width, method] for method in methods)
        lines.append([f"{100 * float(width):g} %" if float(width) else "Dirac", *(
            f"{100 * float(r['positive']):.0f} %, {number(100 * float(r['error_ratio']))} %" + f" ({r['failure']})" * bool(r["failure"])
            for r in cells)])
    shorten = lambda method: SHORT.get(method, method.replace("finite_difference_", "step ").replace("_", ", "))
    return markdown(["width of the gates", *map(shorten, methods)], lines)


def _race(rows):
    """Core-seconds after which the error stays below 1 %, or None, and the last error."""
    reached = None
    for row in rows:
        below = float(row["error"]) < 0.01
        reached = None if not below else reached if reached is not None else float(row["core_seconds"])
    return reached, float(rows[-1]["error"])


def solvers(folder):
    races = {name: read_rows(folder / f"chart_solvers_{name}.csv") for name in ("cube", "corridor", "height_field")}
    methods, lines = list(dict.fromkeys(r["method"] for rows in races.values() for r in rows)), []
    for name, rows in races.items():
        cells = []
        for method in methods:
            own = [r for r in rows if r["method"] == method]
            if not own:
                cells.append("")
                continue
            runs = [_race([r for r in own if r["seed"] == seed]) for seed in dict.fromkeys(r["seed"] for r in own)]
            arrived = [seconds for seconds, _ in runs if seconds is not None]
            ends = sorted(100 * error for _, error in runs)
            cells.append(f"{len(arrived)} of {len(runs)}" + (f": {number(statistics.median(arrived))} s" if arrived else "") +
                         f"; {number(ends[0])} to {number(ends[-1])} %")
        lines.append([f"`{name}`", *cells])
    return markdown(["", *(f"`{method}`" for method in methods)], lines)


def gate_width(folder):
    rows = {(r["scene"], float(r["relative_width"]), r["method"], r["quantity"]): float(r["variance_seconds"])
            for r in read_rows(folder / "gate_width.csv")}
    lines = []
    for width in sorted({key[1] for key in rows}, reverse=True):
        cells = []
        for scene, quantity in (("cube", "image"), ("cube", "derivative"), ("box", "image"), ("box", "derivative")):
            cost = {method: rows[scene, width, method, quantity]
                    for method in ("standard", "ellipsoidal, uncoupled", "ellipsoidal, coupled pairs", "ellipsoidal, kept lengths",
                                   "automatic")}
            best = min(cost[method] for method in cost if method.startswith("ellipsoidal"))
            cells += [number(cost["standard"] / best), number(cost["automatic"] / min(best, cost["standard"]))]
        lines.append([f"{100 * width:g} %", *cells])
    return markdown(["width", "cube, image", "auto", "cube, derivative", "auto", "box, image", "auto", "box, derivative", "auto"], lines)


def growth(folder):
    """Exponents of the variance over the width, below 1 % of the path."""
    rows = read_rows(folder / "width_growth.csv")
    methods = list(dict.fromkeys(r["method"] for r in rows))
    lines = []
    for scene, title in (("open", "without shadow edges"), ("shadow", "with shadow edges")):
        cells = []
        for method in methods:
            own = [(float(r["relative_width"]), float(r["variance"])) for r in rows
                   if (r["scene"], r["method"]) == (scene, method) and float(r["relative_width"]) < 0.011 and float(r["variance"]) > 0]
            cells.append(f"{np.polyfit(*np.log(np.array(own)).T, 1)[0]:.1f}")
        lines.append([title, *cells])
    return markdown(["", *methods], lines)


def boundary(folder):
    rows = {(r["scene"], r["techniques"]): float(r["variance_seconds_of_pixels"]) for r in read_rows(folder / "boundary.csv")}
    scenes = list(dict.fromkeys(scene for scene, _ in rows))
    kinds = [kind for kind in dict.fromkeys(kind for _, kind in rows) if kind != "all"]
    ratio = lambda scene, kind: number(rows[scene, kind] / rows[scene, "all"]) if rows[scene, kind] else "finds nothing"
    return markdown(["", *scenes], [[kind, *(ratio(scene, kind) for scene in scenes)] for kind in kinds])


def contact(folder):
    rows = [r for r in read_rows(folder / "contact.csv") if r["kind"] == "cost"]
    columns = list(dict.fromkeys((r["samples"], r["follow"]) for r in rows))
    lines = []
    for case in dict.fromkeys((r["case"], r["gate"]) for r in rows):
        by = {(r["samples"], r["follow"]): r for r in rows if (r["case"], r["gate"]) == case}
        lines.append([", ".join(case), *(number(by[column]["value"]) for column in columns)])
    return markdown(["", *(samples + (", `follow: 0`" if follow == "0" else "") for samples, follow in columns)], lines)


def tails(folder):
    rows = [r for r in read_rows(folder / "contact.csv") if r["kind"] == "hill"]
    parts = list(dict.fromkeys(r["gate"] for r in rows))
    lines = []
    for case in dict.fromkeys((r["case"], r["follow"]) for r in rows):
        by = {r["gate"]: r for r in rows if (r["case"], r["follow"]) == case}
        lines.append([case[0] + (", `follow: 0`" if case[1] == "0" else ""),
                      *(f"{float(by[p]['value']):.2f} +- {(float(by[p]['high']) - float(by[p]['low'])) / 2:.2f}" for p in parts)])
    return markdown(["largest samples, a share of", *parts], lines)


def set_up(folder):
    rows = {(r["moves"], r["pixels"], r["scene"]): r for r in read_rows(folder / "set_up.csv")}
    lines = []
    for moves, pixels in dict.fromkeys(key[:2] for key in rows):
        fresh, kept = (rows[moves, pixels, scene] for scene in ("fresh", "kept"))
        work = sum(float(kept[key]) for key in ("image_ms", "interior_ms", "visibility_ms"))
        lines.append([moves, f"{pixels} x {pixels}", number(fresh["set_up_ms"]), number(kept["set_up_ms"]), number(work)])
    return markdown(["what moves", "pixels", "from scratch, ms", "kept, ms", "image and both terms, ms"], lines)


def _performance(folder):
    return {(r["figure"], r["case"]): float(r["value"]) for r in read_rows(folder / "performance.csv")}


def speed(folder):
    of = _performance(folder)
    lines = []
    for bounces in (3, 8):
        lines.append([f"rays per second over bare Embree's on the same rays, {bounces} bounces",
                      *(number(of["render / Embree alone", f"{size} {bounces} bounces"]) for size in ("small", "large"))])
    for kind, title in (("standard", "gradient over image, standard sampling"), ("ellipsoidal", "the same, ellipsoidal sampling"),
                        ("jumps", "the same, gates with jumps")):
        lines.append([title, *(number(of["whole gradient / render", f"{size} {kind} one translation"]) for size in ("small", "large"))])
    for what in ("Embree alone", "render", "interior gradient"):
        lines.append([f"one thread over two, {what}",
                      *(number(of["one thread / two (least times)", f"{size} {what}"]) for size in ("small", "large"))])
    return markdown(["", "24 triangles", "70 000 triangles"], lines)


def growth_of_cost(folder):
    of = _performance(folder)
    lines = [[what, *(number(of[what, f"{sampling} {kind}"]) for sampling in ("standard", "ellipsoidal")
                      for kind in ("render", "interior gradient"))]
             for what in ("105 000 unknowns / one", "256 gates / one", "998784 triangles / 864")]
    return markdown(["CPU time of more over less", "standard, image", "gradient", "ellipsoidal, image", "gradient"], lines)


def hidden_share(folder):
    shares = ("0", "0.25", "0.5", "0.75", "0.9")
    lines = [[f"{r['scene']}, {r['of']}", r["bounces"], *(number(1e6 * float(r[share])) for share in shares)]
             for r in read_rows(folder / "hidden_share.csv") if r["of"] in ("image", "derivative beside gain")]
    return markdown(["10^-6 x", "bounces", *shares], lines)


def light_share(folder):
    shares = ("0", "0.2", "0.35", "0.5", "0.65", "0.8", "default")
    lines = [[f"{r['scene']}, {r['of']}", r["share of connections"], r["measured share"], *(number(r[s]) if float(r[s]) > 0 else "noise" for s in shares)]
             for r in read_rows(folder / "light_share.csv")]
    return markdown(["", "connections", "light", *shares], lines)


def technique_trial(folder):
    mixes = [f"{technique}{light}" for technique in ("standard", "connections") for light in ("", " with light")]
    lines = []
    for r in read_rows(folder / "technique_trial.csv"):
        costs = [float(r[mix]) for mix in mixes]
        lines.append([f"{r['scene']}, {r['of']}", r["trials for connections"], r["trials for light"],
                      "noise" if min(costs) <= 0 else number(r["cost of trials"]), *("noise" if c <= 0 else number(c) for c in costs)])
    return markdown(["", "trials for connections", "for light subpaths", "times the best", *mixes], lines)


def checks(folder):
    columns = ("rows", "largest_z", "rms_z", "beyond_limit", "clearest")
    rows = read_rows(folder / "checks.csv")
    return markdown(["experiment", *(c.replace("_", " ") for c in columns)],
                    [[f"`{r['experiment']}`", *(r[c] for c in columns)] for r in rows])


def _of(name, table_of):
    return lambda folder: table_of(read_rows(folder / f"{name}.csv"))


TABLES = {
    **{f.__name__: f for f in (figure8, figure9, charts, solvers, gate_width, growth, boundary, contact, tails, set_up, speed,
                               growth_of_cost, hidden_share, light_share, technique_trial, checks)},
    "cubes": _of("cube_cost", cube_cost.table_of),
    "captures": _of("capture_cost", capture_cost.table_of),
    "stated_errors": _of("error_coverage", error_coverage.tables_of),
    "intervals": _of("interval_coverage", interval_coverage.table_of),
    "egg": _of("egg", public_scene.table_of),
    "stability cube": lambda folder: stability(folder, "cube"),
    "stability branches": lambda folder: stability(folder, "branches"),
    "stability corridor": lambda folder: stability(folder, "corridor"),
}
