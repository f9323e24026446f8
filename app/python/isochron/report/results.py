"""How a run ended: the parameters with targets and uncertainties, and curves over its iterations."""

import numpy as np

from isochron.report.charts import Chart, Series, grid
from isochron.report.markup import element, join, number, section, seconds, table
from isochron.report.run import as_numbers

MOST_ROWS = 4  # components of a parameter that are listed one by one
MOST_WORST = 3
MOST_CHARTS, MOST_LINES = 12, 8
TAIL = (5, 100)  # rows over which the scatter is taken: a quarter of all, within these bounds

MEANING = {
    "gauss_newton_matrix":
        "± in the table: standard error by the loss's Gauss–Newton matrix at the end, smoothing included (for counts: by photon "
        "noise), all parameters unknown together.",
    "gauss_newton_products":
        "± in the table: standard error by the loss's Gauss–Newton matrix at the end, smoothing included (for counts: by photon "
        "noise). Of parameters of up to three numbers all others are unknown, too; of longer ones it is a lower bound, as if "
        "all else were known.",
    "scatter":
        "± in the table: scatter of the parameter over the last quarter of the iterations (5 to 100 rows), that is by how "
        "much the optimiser's noise, and what drift there is, moves it; how far it is from the truth it does not say.",
}


class Uncertainty:
    """Half a standard error's bar for each component of a parameter, and how it was found (a key of MEANING)."""

    def __init__(self, run, parameter):
        self.values, self.kind = None, None
        if parameter.errors is not None and not np.isnan(parameter.errors).all():
            self.values, self.kind = parameter.errors, run.errors_from
            return
        rows = len(run.log.get("iteration", ()))
        tail = int(np.clip(rows // 4, *TAIL))
        columns = [run.log.get(parameter.component(i)) for i in range(min(parameter.count, 17))]
        if rows >= 2 * TAIL[0] and parameter.count <= 16 and all(c is not None for c in columns):
            self.values, self.kind = np.array([np.std(c[-tail:], ddof=1) for c in columns]), "scatter"


def unit_of(run, parameter):
    if parameter.kind in ("rotation", "camera_rotation"):
        return "°"
    if parameter.kind == "time_offset":
        unit = str(run.map("gates").get("unit", "scene"))
        return "scene units" if unit == "scene" else unit
    return "scene units" if parameter.kind in ("translation", "vertices", "camera_translation") else ""


def root_mean_square(values):
    return None if values is None else float(np.sqrt(np.mean(np.square(values))))


def plus_minus(error, digits=4):
    return "undetermined" if np.isposinf(error) else f"± {number(error, digits)}" if np.isfinite(error) else "–"


def typical_error(errors):
    """Root mean square of those that are determined."""
    finite = errors[np.isfinite(errors)]
    return root_mean_square(finite) if finite.size else np.inf


def rows_of(run, parameter, uncertainty):
    unit = unit_of(run, parameter)
    initial, found, target, errors = parameter.initial, parameter.found, parameter.target, uncertainty.values
    off = found - target if found is not None and target is not None else None
    if parameter.count > MOST_ROWS:
        yield [f"{parameter.name}, RMS of {parameter.count}", parameter.subject, unit,
               *(number(root_mean_square(v), 5) for v in (initial, found, target)), number(root_mean_square(off)),
               plus_minus(typical_error(errors)) if errors is not None else "–"]
        if off is not None and np.isfinite(off).any():
            for i in np.argsort(-np.nan_to_num(np.abs(off)), kind="stable")[:MOST_WORST]:
                yield one_row(parameter, unit, int(i), errors, "furthest off: ")
        return
    for i in range(parameter.count):
        yield one_row(parameter, unit, i, errors)


def one_row(parameter, unit, i, errors, prefix=""):
    def at(values):
        return values[i] if values is not None else None

    found, target = at(parameter.found), at(parameter.target)
    off = found - target if found is not None and target is not None else None
    return [prefix + parameter.component(i), "" if prefix else parameter.subject, unit, number(at(parameter.initial), 5),
            number(found, 5), number(target, 5), number(off),
            plus_minus(errors[i], 3) if errors is not None else "–"]


def parameters_section(run):
    if not run.parameters:
        return ""
    uncertainties = {p.name: Uncertainty(run, p) for p in run.parameters}
    rows = [row for p in run.parameters for row in rows_of(run, p, uncertainties[p.name])]
    found = "found" if run.ended else "now"
    head = ["parameter", "what", "unit", "initial", found, "target", "off by", "±"]
    kinds = sorted({u.kind for u in uncertainties.values()}, key=str)
    notes = [element("p", MEANING[kind], class_="note") for kind in kinds if kind in MEANING]
    unknown = [name for name, u in uncertainties.items() if u.values is None]
    if unknown:
        notes.append(element("p", f"± of {', '.join(unknown)} is not known: this solver gives none, and log.csv has no "
                             "scatter of its numbers (too few rows, or their norm alone).", class_="note"))
    notes += joint_notes(run)
    if any(p.count > MOST_ROWS and p.found is not None for p in run.parameters):
        notes.append(spread(run))
    charts = [parameter_chart(run, p, uncertainties[p.name], i) for i, p in enumerate(run.parameters[:MOST_CHARTS])]
    left_out = len(run.parameters) - MOST_CHARTS
    if left_out > 0:
        notes.append(element("p", f"Curves of the first {MOST_CHARTS} of {len(run.parameters)} parameters.", class_="note"))
    return section("parameters", "Parameters", table(head, rows, "Values of the parameters", "numbers"), *notes,
                   grid([c for c in charts if c]))


def joint_notes(run):
    """What the readings determine together only, and what a Newton step would still move."""
    rows = [[name, number(mean, 5), plus_minus(error)] for name, mean, error in run.combinations]
    if rows:
        yield table(["determined together", "mean", "±"], rows, "Determined together", "numbers")
    if run.steps_left:
        yield element("p", "Not at the minimum: a Newton step would move " +
                      ", ".join(f"{name} by {number(step, 3)}" for name, step in run.steps_left) +
                      ", which is more than the standard errors.", class_="note")


def spread(run):
    """Quantiles of what long parameters hold, in place of thousands of lines."""
    rows = []
    for p in run.parameters:
        if p.count <= MOST_ROWS or p.found is None:
            continue
        sets = [("found" if run.ended else "now", p.found)]
        if p.target is not None:
            sets += [("target", p.target), ("off by", p.found - p.target)]
        for name, values in sets:
            finite = values[np.isfinite(values)]
            cells = [number(v) for v in np.percentile(finite, (0, 5, 50, 95, 100))] if finite.size else ["–"] * 5
            rows.append([f"{p.name}: {name}", *cells])
    return table(["parameter", "least", "5 %", "median", "95 %", "largest"], rows, "Spread of parameters of many numbers",
                 "numbers")


def parameter_chart(run, parameter, uncertainty, place):
    log, unit = run.log, unit_of(run, parameter)
    x = log.get("iteration")
    if x is None or not len(x):
        return None
    key, label = f"p{place}", f"{parameter.name}{f' ({unit})' if unit else ''}"
    names = [parameter.component(i) for i in range(parameter.count)] if parameter.count <= 16 else []
    if names and all(n in log for n in names):
        shown = names
        note = None
        if len(names) > MOST_LINES:
            off = [abs(log[n][0] - log[n][-1]) for n in names]
            shown = [names[i] for i in sorted(np.argsort(off)[::-1][:MOST_LINES])]
            note = f"The {MOST_LINES} of {len(names)} components that moved most."
        series = []
        for name in shown:
            i = names.index(name)
            series.append(Series(name if len(shown) > 1 else "", x, log[name],
                                 target=parameter.target[i] if parameter.target is not None else None,
                                 error=uncertainty.values[i] if uncertainty.values is not None else None,
                                 final=parameter.found[i] if parameter.found is not None and run.ended else None))
        words = [] if parameter.target is None else ["dashed: target"]
        if uncertainty.values is not None and run.ended:
            words.append("bar at the end: ±")
        note = note or (", ".join(words) or None)
        return Chart(key, parameter.name, series, "iteration", label, times=log.get("seconds"), note=note)
    errors = log.get(f"{parameter.name}.rmse")
    if errors is not None and np.isfinite(errors).any():
        return Chart(key, f"{parameter.name}: distance to its target", [Series("", x, errors)], "iteration",
                     f"RMS error{f' ({unit})' if unit else ''}", log=True, times=log.get("seconds"),
                     note=f"Root mean square over {parameter.count} numbers.")
    norm = log.get(f"{parameter.name}.norm")
    if norm is not None:
        return Chart(key, f"{parameter.name}: norm", [Series("", x, norm)], "iteration", "Euclidean norm",
                     times=log.get("seconds"), note=f"Of {parameter.count} numbers, whose target is not known.")
    return None


def convergence_section(run):
    log = run.log
    x = log.get("iteration")
    if x is None or not len(x):
        return ""
    charts, noise = [], log.get("loss_noise")
    if "loss" in log:
        charts.append(Chart("loss", "Loss", [Series("", x, log["loss"], band=noise)], "iteration", "loss", log=True,
                            times=log.get("seconds"), note="Strip: ± its standard error. An unbiased estimate, which "
                            "can come out negative; a logarithmic axis has gaps there."))
    if "image_rmse" in log:
        values = np.where(log["image_rmse"] > 0, log["image_rmse"], np.nan)
        charts.append(Chart("image", "Images against the target", [Series("", x, values)], "iteration", "RMSE", log=True,
                            times=log.get("seconds"), note=f"In {run.quantity}; gaps where images agree within the noise."))
    errors = log.get("param_rmse")
    if errors is not None and np.isfinite(errors).any():
        charts.append(Chart("param", "All parameters against their targets", [Series("", x, errors)], "iteration",
                            "RMSE (units of scale)", log=True, times=log.get("seconds"),
                            note="For evaluation only: the optimiser does not see targets of parameters."))
    if "gradient_norm" in log:
        charts.append(Chart("gradient", "Gradient of the loss", [Series("", x, log["gradient_norm"])], "iteration",
                            "norm", log=True, times=log.get("seconds")))
    return section("convergence", "Convergence", grid(charts))


def headline(run):
    """The run in a few numbers."""
    log, tiles = run.log, []

    def tile(name, text, small=""):
        small = element("span", small, class_="quiet") if small else None
        tiles.append(element("div", element("dt", name), element("dd", text, small)))

    def change(column, summary):
        values = log.get(column)
        first, last = run.summary.get(f"{summary}_initial"), run.summary.get(f"{summary}_final") if run.ended else None
        if values is not None and len(values):
            first = values[0] if first is None else first
            last = values[-1] if last is None else last
        if first is None or last is None:
            return None
        try:
            return float(first), float(last)
        except (TypeError, ValueError):
            return None

    for name, column in (("image RMSE", "image_rmse"), ("loss", "loss"), ("error of parameters", "param_rmse")):
        pair = change(column, column)
        if pair is None or not np.isfinite(pair).any():
            continue
        last = "below noise" if column == "image_rmse" and pair[1] == 0 else number(pair[1], 3)
        tile(name, last, f" from {number(pair[0], 3)}")
    tile("iterations", f"{run.done}", f" of {run.iterations}" if run.iterations != run.done else "")
    elapsed = log.get("seconds", [np.nan])
    tile("time", seconds(elapsed[-1] if len(elapsed) else None))
    return element("dl", *tiles, class_="tiles")


def ending(run):
    """How it ended, in sentences."""
    words = [run.state_words[:1].upper() + run.state_words[1:] + "."]
    chosen = {"last": "those of the last iteration", "average": "the mean over the last iterations",
              "best": "those of the lowest loss"}.get(str(run.summary.get("final")))
    if run.ended and chosen:
        words.append(f"The final parameters are {chosen}.")
    rejected = run.summary.get("rejected_steps")
    if rejected:
        words.append(f"{rejected} steps were rejected.")
    share = run.summary.get("noise_share")
    if run.ended and isinstance(share, float):
        words.append(f"Noise makes {100 * share:.0f} % of the loss's variance over the last rows.")
    badge = element("span", run.state, class_=f"badge {run.state}")
    return join([element("p", badge, " ", " ".join(words), class_="ending"), start(run), levels(run), fit(run), bounds(run),
                 notes(run)])


def start(run):
    """Of a reconstruction: where its surface comes from."""
    found = run.whole.get("start")
    if not isinstance(found, dict):
        return ""
    method = str(found.get("method", "unknown")).replace("_", " ")
    spent, significance = (as_numbers(found.get(key)) for key in ("seconds", "significance"))
    words = [f"Started from {method}"]
    if significance is not None:
        words.append(f"significant by {number(significance[0], 3)} standard deviations of the counts' noise")
    if spent is not None:
        words.append(f"which took {seconds(spent[0])}")
    return element("p", f"{', '.join(words)}.", class_="start")


def levels(run):
    """The results of a run's levels; the page shows the last one."""
    if not run.levels:
        return ""
    keys = ("edge_length", "vertices", "iterations", "loss", "seconds", "status")

    def shown(value):
        return number(value) if isinstance(value, float) else "–" if value is None else str(value).replace("_", " ")

    rows = [[str(i + 1), *(shown(level.get(key)) for key in keys)] for i, level in enumerate(run.levels)]
    return table(["level", *(key.replace("_", " ") for key in keys)], rows, "Levels; the page shows the last one",
                 "numbers")


FIT = {"explained": "The fit explains the data", "unexplained": "The fit does not explain the data",
       "no_signal": "There is no signal: background alone explains the data"}


def fit(run):
    """The verdict on the fit, with its numbers."""
    found = None if run.going else run.whole.get("fit") or run.summary.get("fit")
    if not isinstance(found, dict) or found.get("verdict") not in FIT:
        return ""
    # A fit is rejected at either end of p.
    too_near = found["verdict"] == "unexplained" and found["p_value"] > 0.5
    why = ": no Poisson numbers, or not at rest" if too_near else ""
    return element("p", f"{FIT[found['verdict']]}: deviance {number(found['deviance'], 6)}, expected "
                   f"{number(found['floor'], 6)}, p = {number(found['p_value'], 2)}{why}.", class_="fit")


def bounds(run):
    """Which unknowns ended at a bound, a line each."""
    found = run.summary.get("at_bounds") if run.ended else None
    lines = []
    for name, kinds in (found.items() if isinstance(found, dict) else ()):
        count = next((p.count for p in run.parameters if p.name == name), 1)
        for kind, at in kinds.items():
            if count == 1:
                lines.append(f"{name} ended at its {kind} bound {number(at['bound'], 5)}")
                continue
            shown = ", ".join(map(str, at["first"])) + (", …" if at["count"] > len(at["first"]) else "")
            lines.append(f"{name}: {at['count']} of {count} ended at their {kind} bound {number(at['bound'], 5)} ({shown})")
    return element("ul", *(element("li", line) for line in lines), class_="bounds") if lines else ""


def notes(run):
    if not run.notes:
        return ""
    lines = (element("li", note) for note in run.notes)
    return element("div", element("p", "Could not be read:"), element("ul", *lines), class_="warning", role="note")
