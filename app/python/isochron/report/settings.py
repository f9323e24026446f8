"""The experiment in a table and as text, and its cost: times, rays, memory, versions."""

import datetime
import platform

import numpy as np

from isochron.report.markup import Markup, element, number, section, seconds, table

SETTINGS = ("scene", "resolution", "max_bounces", "gates", "target", "samples", "estimator", "gradient", "loss", "optimizer",
            "seed")
MOST_TEXT = 60000  # characters of a file that are shown


def short(value, most=70):
    """A value of the experiment in one line; of long lists the length."""
    if isinstance(value, dict):
        return ", ".join(f"{k}: {short(v, 30)}" for k, v in value.items())
    if isinstance(value, list):
        if len(value) > 6:
            return f"{len(value)} numbers" if all(isinstance(v, (int, float)) for v in value) else f"{len(value)} entries"
        return "[" + ", ".join(short(v, 30) for v in value) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= most else text[:most] + "…"


def in_short(run):
    """The experiment in one line."""
    words = []
    unknowns = sum(p.count for p in run.parameters)
    if run.parameters:
        names = ", ".join(p.name for p in run.parameters[:8]) + (", …" if len(run.parameters) > 8 else "")
        words.append(f"{unknowns} unknown{'s' if unknowns != 1 else ''} ({names})")
    if run.shape is not None:
        height, width = run.shape[1:3]
        kind = str(run.map("gates").get("kind", ""))
        words.append(f"{width} x {height} {'sensor points' if run.is_capture else 'pixels'}, {run.shape[0]} gates"
                     f"{f' ({kind})' if kind else ''}")
    method, loss = run.map("optimizer").get("method"), run.map("loss").get("kind")
    if method:
        words.append(f"{str(method).replace('_', ' ')}{f', {loss} loss' if loss else ''}")
    return "; ".join(words)


def asked_section(run):
    e = run.experiment
    rows = [(key, short(e[key], 200)) for key in SETTINGS if e.get(key) not in (None, {}, [])]
    for p in run.parameters:
        rest = {k: v for k, v in p.spec.items() if k not in ("name", "type")}
        rows.append((f"parameter {p.name}", f"{p.kind}: {short(rest)}"))
    original = run.read(lambda path: path.read_text(encoding="utf-8"), "inputs/experiment.yaml")
    return section("asked", "The experiment", table(["key", "value"], rows, "The experiment", "asked") if rows else None,
                   text_of("The experiment, resolved: experiment.yaml", run.text),
                   text_of("The original file: inputs/experiment.yaml", original))


def text_of(title, text):
    if not text:
        return Markup("")
    left_out = f"\n… {len(text) - MOST_TEXT} more characters" if len(text) > MOST_TEXT else ""
    return element("details", element("summary", title), element("pre", text[:MOST_TEXT] + left_out, tabindex="0"))


PASSES = {"target": "target images", "scene": "scene made ready", "primal": "images", "interior": "interior term",
          "edges": "visibility: edges found and learned about", "visibility": "visibility term",
          "path_length": "path length term"}


def passes_of(run):
    """Seconds of the last call by what they were for; empty where summary.yaml does not say."""
    last = run.summary.get("last_call")
    passes = last.get("passes") if isinstance(last, dict) else None
    if not isinstance(passes, dict) or not isinstance(last.get("seconds"), (int, float)):
        return {}
    known = {PASSES.get(str(key), str(key)): float(value) for key, value in passes.items() if isinstance(value, (int, float))}
    known["all else (optimiser, files ...)"] = max(0.0, last["seconds"] - sum(known.values()))
    return known


def passes_table(run):
    """Where the time went, with bars."""
    passes = {name: time for name, time in passes_of(run).items() if time > 0}
    if not passes:
        return None
    total, longest = sum(passes.values()), max(passes.values())
    rows = [[name, seconds(time), f"{100 * time / total:.1f} %",
             element("span", class_="length", style=f"width: {100 * time / longest:.1f}%", aria_hidden="true")]
            for name, time in passes.items()]
    return table(["what", "time", "share", ""], rows, "Where the time of the last call went", "numbers passes")


def cost_section(run):
    last = run.summary.get("last_call")
    last = last if isinstance(last, dict) else {}
    elapsed = run.log.get("seconds", np.empty(0))
    rows = []
    if len(elapsed):
        each = elapsed[-1] / max(1, run.done)
        rows.append(("time in iterations", f"{seconds(float(elapsed[-1]))}, {seconds(float(each))} each"))
    if isinstance(last.get("seconds"), (int, float)):
        since = f" (from iteration {last['first_iteration']} on)" if last.get("first_iteration") else ""
        rows.append((f"last call{since}", f"{seconds(last['seconds'])}, target and closing images included"))
    if last.get("rays"):
        made = max(1, run.done - int(last.get("first_iteration") or 0))
        rows.append(("rays of its iterations", f"{number(float(last['rays']), 3)}, {number(last['rays'] / made, 3)} each"))
    if last.get("peak_memory_bytes"):
        rows.append(("most memory", f"{last['peak_memory_bytes'] / 1e6:.0f} MB"))
    samples = run.map("samples")
    if samples:
        rows.append(("samples per pixel and iteration", short(samples)))
    if run.shape is not None:
        height, width = run.shape[1:3]
        rows.append(("images", f"{width} x {height} pixels, {run.shape[0]} gates"
                               f"{', 3 colours' if len(run.shape) == 4 else ''}"))
    rows += [("version of the run", str(run.experiment.get("version", "not known"))),
             ("this page", f"written {datetime.datetime.now().astimezone():%Y-%m-%d %H:%M %Z} on {platform.system()} "
                           f"{platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}")]
    return section("cost", "Cost and versions", table(["what", "value"], rows, "Cost and versions", "asked"),
                   passes_table(run))
