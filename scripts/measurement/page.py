"""experiments/MEASURED.md: the text of MEASURED.md.in beside this file, with a table in the place of every {{NAME}} (tables.py), and the
versions of all steps."""

import dataclasses
import os
import pathlib

from reproduction import results
from reproduction.measure import ROOT

from . import record
from .steps import STEPS, egg
from .tables import TABLES

TEMPLATE = pathlib.Path(__file__).with_name("MEASURED.md.in")


def _of_one_version(entries):
    dates = sorted({entry.date for entry in entries})
    minutes = sum(float(entry.minutes) for entry in entries)
    return (f"version `{entries[0].version}`, {' to '.join(dict.fromkeys((dates[0], dates[-1])))}, on {entries[0].processor}, "
            f"in {minutes:.0f} minutes")


def versions(records):
    """One sentence where all steps are of one version and machine, else one of each. What has not changed since it was measured is of the
    present version."""
    steps = STEPS | egg(".")
    newest = record.version(tuple(program for step in steps.values() for program in step.programs))
    groups = {}
    for entry in records.values():
        step = steps.get(entry.step)
        if step and entry.version == record.version(step.programs):
            entry = dataclasses.replace(entry, version=newest)
        groups.setdefault((entry.version, entry.processor), []).append(entry)
    missing = [name for name in STEPS if name not in records]
    if len(groups) == 1 and not missing:
        return f"All of {_of_one_version(*groups.values())}."
    names = lambda steps: ", ".join(f"`{name}`" for name in steps)
    lines = [f"- Of {_of_one_version(entries)}: {names(entry.step for entry in entries)}." for entries in groups.values()]
    return "\n".join([*lines, *([f"- Of older versions: {names(missing)}."] if missing else [])])


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
