#!/usr/bin/python3
"""Measures what RESULTS.md and MEASURED.md of experiments/ show, and writes them; scripts/measure builds the programs first.

A step is done again only where the program has changed since (experiments/measured/versions.csv): an interrupted call goes on where
it was. The pages are written after every step, from all tables of experiments/measured."""

import argparse
import fnmatch
import os
import subprocess
import sys
import time

from measurement import page, record
from measurement.steps import STEPS, egg
from reproduction.measure import ROOT


def parse(arguments):
    parser = argparse.ArgumentParser(prog="scripts/measure", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("steps", nargs="*", metavar="STEP", help="names or patterns, measured again whatever their version")
    parser.add_argument("--all", action="store_true", help="every step that is not of the present version")
    parser.add_argument("--egg", metavar="FOLDER", help="where the public egg scene is; without it its step is left out")
    parser.add_argument("--list", action="store_true", help="the steps, with the version that each was measured with")
    parser.add_argument("--page", action="store_true", help="writes the pages alone, from the tables as they are")
    options = parser.parse_args(arguments)
    options.known = STEPS | (egg(options.egg) if options.egg else {})
    for pattern in options.steps:
        if not fnmatch.filter(options.known, pattern):
            parser.error(f"there is no step {pattern} (scripts/measure --list)")
    if not (options.steps or options.all or options.list or options.page):
        parser.error("name steps, or --all")
    return options


def chosen(options):
    if options.all:
        measured = record.load()
        return [name for name, step in options.known.items()
                if name not in measured or measured[name].version != record.version(step.programs)]
    return [name for name in options.known if any(fnmatch.fnmatch(name, pattern) for pattern in options.steps)]


def measure(step):
    """Whether all its commands ended well."""
    for file in step.removed:
        (ROOT / file).unlink(missing_ok=True)
    for command in step.commands:
        words = [str(ROOT / command[0]), *command[1:]]
        if subprocess.run(words, cwd=ROOT, env=os.environ | dict(step.environment), check=False).returncode != 0:
            print(f"scripts/measure: failed: {' '.join(command)}", file=sys.stderr)
            return False
    return True


def main(arguments):
    options = parse(arguments)
    if options.list:
        measured = record.load()
        for name in options.known:
            entry = measured.get(name)
            print(f"{name:34}", f"{entry.version:10} {entry.date} {entry.minutes:>6} min" if entry else "not measured")
        return 0
    failures = 0
    for name in [] if options.page else chosen(options):
        print(f"== {name}", flush=True)
        start = time.monotonic()
        if measure(options.known[name]):
            record.keep(name, options.known[name].programs, time.monotonic() - start)
            page.write()
        else:
            failures += 1
    page.write()
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
