"""Several runs on one page: settings that differ, results, curves over time and iterations, final images side by side."""

import numpy as np

from isochron.pictures.scales import pick_gates, scale_of
from isochron.report.charts import Chart, Series, grid
from isochron.report.images import grey, root_mean_square, row_of, slice_of
from isochron.report.markup import element, join, number, section, seconds, table
from isochron.report.page import document
from isochron.report.png import ColourScale, Scale, shrunk
from isochron.report.results import notes, rows_of, Uncertainty
from isochron.report.settings import passes_of, short

MOST_GATES = 6
CURVES = (("loss", "Loss", "loss"), ("image_rmse", "Images against the target", "RMSE"),
          ("param_rmse", "All parameters against their targets", "RMSE (units of scale)"))


def labels_of(runs):
    """A name for each run: the experiment's where these differ, else the folder's."""
    names = [run.name for run in runs]
    if len(set(names)) < len(names):
        names = [run.directory.resolve().name for run in runs]
    if len(set(names)) < len(names):
        names = [str(run.directory) for run in runs]
    return [name if names.count(name) == 1 else f"{name} ({i})" for i, name in enumerate(names, start=1)]


def flattened(value, path=""):
    """Every setting by its path of keys; entries of `parameters` by their names."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flattened(inner, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
        for i, inner in enumerate(value):
            yield from flattened(inner, f"{path}.{inner.get('name', i)}")
    else:
        yield path, value


def differences(runs, labels):
    settings = [dict(flattened(run.experiment)) for run in runs]
    keys = list(dict.fromkeys(key for s in settings for key in s))
    rows = [[key, *(short(s[key]) if key in s else "–" for s in settings)] for key in keys
            if any(key not in s or s[key] != settings[0].get(key) for s in settings) and not key.endswith(".name")]
    if not rows:
        return section("differences", "Settings that differ", element("p", "None."))
    return section("differences", "Settings that differ", table(["key", *labels], rows, "Settings that differ", "asked"))


def last_of(run, column):
    values = run.log.get(column)
    return float(values[-1]) if values is not None and len(values) else None


def results(runs, labels):
    rows = [["state", *(run.state_words for run in runs)], ["iterations", *(run.done for run in runs)],
            ["time in iterations", *(seconds(last_of(run, "seconds")) for run in runs)]]
    for column, name in (("loss", "loss"), ("image_rmse", "image RMSE"),
                         ("param_rmse", "error of parameters (units of scale)")):
        rows.append([name, *(number(last_of(run, column)) for run in runs)])
    for key, name, unit in (("rays", "rays of the last call", 1.0), ("peak_memory_bytes", "most memory (MB)", 1e6)):
        last = [run.summary.get("last_call") for run in runs]
        values = [entry.get(key) if isinstance(entry, dict) else None for entry in last]
        if any(values):
            rows.append([name, *(number(v / unit if v else None, 3) for v in values)])
    passes = [passes_of(run) for run in runs]
    for name in dict.fromkeys(name for p in passes for name, time in p.items() if time > 0):
        rows.append([f"time: {name}", *(seconds(p.get(name)) for p in passes)])
    cells = [parameter_cells(run) for run in runs]
    for name in dict.fromkeys(name for c in cells for name in c):
        rows.append([name, *(c.get(name, "–") for c in cells)])
    return section("results", "Results", table(["", *labels], rows, "How the runs ended", "asked"),
                   *(notes(run) for run in runs))


def parameter_cells(run):
    """What was found, its target and its uncertainty, by the name of the row."""
    cells = {}
    for parameter in run.parameters:
        for name, _, unit, _, found, target, _, error in rows_of(run, parameter, Uncertainty(run, parameter)):
            if not name.startswith("furthest"):
                words = [found, error if error != "–" else None, f"(target {target})" if target != "–" else None]
                cells[f"{name}{f' ({unit})' if unit else ''}"] = " ".join(word for word in words if word)
    return cells


def curves(runs, labels):
    charts = []
    for column, title, unit in CURVES:
        for x, words in (("iteration", "iteration"), ("seconds", "time (s)")):
            series = [Series(label, run.log[x], np.where(run.log[column] > 0, run.log[column], np.nan))
                      for run, label in zip(runs, labels) if x in run.log and column in run.log and len(run.log[x])]
            if series:
                charts.append(Chart(f"{column}-{x}", f"{title}, over {words.split(' ')[0]}", series, words, unit, log=True))
    return section("curves", "Curves", grid(charts))


def picture(run):
    """Its latest image, or none."""
    if run.ended and "final" in run.images:
        return run.images["final"]
    frames = run.frames()
    return frames[-1][2] if frames else None


def images(runs, labels):
    """A row for each gate: the target and the runs' images, equally exposed."""
    first = next((run for run in runs if run.images), None)
    if first is None:
        return ""
    shown = [(label, run, picture(run)) for run, label in zip(runs, labels)]
    alike = [(label, run, image) for label, run, image in shown if image is not None and image.shape == first.shape]
    others = [label for label, _, _ in shown if label not in [a[0] for a in alike]]
    if not alike:
        return ""
    target = next((run.images["target"] for _, run, _ in alike if "target" in run.images), None)
    stacks = [image for _, _, image in alike] + ([target] if target is not None else [])
    columns = [("target", target)] if target is not None else []
    columns += [(label, image) for label, _, image in alike]
    high = scale_of(*stacks)
    scale = ColourScale(high) if stacks[0].ndim == 4 else Scale("inferno", 0.0, high)
    if first.is_capture:
        gates, style = [(row_of(first.shape)[1], slice_of)], "aspect-ratio:0.8"
    else:
        factor = max(1, -(-max(first.shape[1:3]) // 256))
        gates = [(first.gates.label(g) if first.gates is not None else str(g), lambda stack, g=g: shrunk(stack[g], factor))
                 for g in pick_gates(MOST_GATES, *stacks)]
        style = f"aspect-ratio:{first.shape[2]}/{first.shape[1]}"
    style_of_row = f"grid-template-columns:repeat({max(3, len(columns))},minmax(0,1fr))"
    rows = []
    for label, view in gates:
        cells = []
        for name, image in columns:
            rest = ""
            if target is not None and image is not target:
                rest = f", RMS difference {number(root_mean_square(grey(view(image) - view(target))), 3)}"
            cells.append(element("figure", element("img", src=scale.uri(view(image)), alt=f"{name}, {label}", style=style),
                                 element("figcaption", f"{name}{rest}")))
        rows.append(element("article", element("h3", f"Gate at {label}" if not first.is_capture else label),
                            element("div", *cells, class_="side", style=style_of_row), class_="card wide"))
    note = element("p", f"Of another shape, not shown: {', '.join(others)}.", class_="note") if others else None
    return section("images", "Images side by side", scale.bar(first.quantity), *rows, note)


def comparison_page(runs):
    labels = labels_of(runs)
    items = [element("li", element("strong", label), f": {run.directory}") for run, label in zip(runs, labels)]
    header = element("header", element("h1", "Comparison of runs"), element("ul", join(items), class_="quiet"))
    sections = {"results": results(runs, labels), "differences": differences(runs, labels), "curves": curves(runs, labels),
                "images": images(runs, labels)}
    return document("Comparison: " + ", ".join(labels), header, sections)
