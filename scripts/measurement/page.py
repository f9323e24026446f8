"""experiments/MEASURED.md: the text of MEASURED.md.in beside this file, with a table in the place of every {{NAME}} (tables.py), and the
versions of all steps."""

import os
import pathlib

from reproduction import results
from reproduction.measure import ROOT

from . import record
from .steps import STEPS
from .tables import TABLES, markdown

TEMPLATE = pathlib.Path(__file__).with_name("MEASURED.md.in")


def versions(records):
    """One sentence where all steps are of one version and machine, else a table."""
    entries = list(records.values())
    missing = [name for name in STEPS if name not in records]
    minutes = sum(float(entry.minutes) for entry in entries)
    text = ""
    if len({(entry.version, entry.processor) for entry in entries}) == 1 and not missing:
        first = entries[0]
        dates = sorted({entry.date for entry in entries})
        text = (f"All of version `{first.version}`, {' to '.join(dict.fromkeys((dates[0], dates[-1])))}, on {first.processor}, "
                f"in {minutes:.0f} minutes.")
    else:
        rows = [[f"`{e.step}`", f"`{e.version}`", e.date, e.minutes, e.processor] for e in entries]
        text = markdown(["step", "version", "date", "minutes", "processor"], rows)
        if missing:
            text += "\n\nOf older versions: " + ", ".join(f"`{name}`" for name in missing) + "."
    return text


def _filled(table, folder):
    try:
        return table(folder)
    except FileNotFoundError as missing:
        return f"Not measured: there is no `{pathlib.Path(missing.filename).name}`."


def write():
    """Both pages, from what experiments/measured and experiments/figures hold."""
    experiments = ROOT / "experiments"
    text = TEMPLATE.read_text(encoding="utf-8")
    for name, table in TABLES.items():
        mark = "{{" + name + "}}"
        if mark in text:
            text = text.replace(mark, _filled(table, experiments / "measured"))
    text = text.replace("{{versions}}", versions(record.load()))
    if "{{" in text:
        raise ValueError(f"{TEMPLATE.name}: no table {text.partition('{{')[2].partition('}}')[0]}")
    temporary = experiments / "MEASURED.md.tmp"
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, experiments / "MEASURED.md")
    results.write(experiments)
