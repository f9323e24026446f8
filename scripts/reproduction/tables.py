"""Tables of measurements, and the command line of scripts that measure and draw them."""

import csv
import inspect
import pathlib
import sys


class Usage(Exception):
    """The arguments of an action do not fit."""


def read_rows(file):
    """Rows as dictionaries of text."""
    with open(file, encoding="ascii", newline="") as lines:
        return list(csv.DictReader(lines))


def write_rows(file, columns, rows):
    """By temporary name: long measurements write after every part of them."""
    file = pathlib.Path(file)
    partial = file.with_name(file.name + ".partial")
    with open(partial, "w", encoding="ascii", newline="") as out:
        csv.writer(out, lineterminator="\n").writerows([columns, *rows])
    partial.replace(file)


def markdown(header, rows):
    """A table of cells of any type."""
    lines = ["| " + " | ".join(map(str, cells)) + " |" for cells in (header, *rows)]
    return "\n".join([lines[0], "|---" * len(header) + "|", *lines[1:]])


def run_action(doc, arguments, *actions):
    """Calls the action of the name arguments[0] with the others. Prints `doc` and returns 2 where they do not fit."""
    by_name = {action.__name__: action for action in actions}
    try:
        action = by_name.get(arguments[0]) if arguments else None
        inspect.signature(action).bind(*arguments[1:])
    except TypeError:
        action = None
    try:
        if action is None:
            raise Usage
        action(*arguments[1:])
    except Usage:
        print(doc.strip(), file=sys.stderr)
        return 2
    return 0
