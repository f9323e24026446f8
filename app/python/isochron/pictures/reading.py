"""What the program wrote, as arrays and words: gated images, the gates' centres and units, log.csv."""

import csv
import re

import numpy as np
import yaml

from isochron import exr
from isochron.errors import InputError

LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # in Python alone, a number per sensor point takes seconds
PEAKS = "isochron.peaks"
CHANNEL = re.compile(r"(?:(?P<component>.+)\.)?gate(?P<gate>\d+)\.(?P<channel>[RGBY])")


class PlotError(InputError):
    """Something that keeps a picture from being drawn, in one line."""


def read_yaml(path):
    try:
        data = yaml.load(path.read_text(encoding="utf-8"), LOADER)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise PlotError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    if not isinstance(data, dict):
        raise PlotError(f"{path}: no keys")
    return data


def numbers(values):
    """A value or a list of them; YAML takes 1e-05 for text."""
    return np.array([float(v) for v in (values if isinstance(values, list) else [values])])


class Gates:
    """Centres of an image's gates (None where unknown), their unit, and what a pixel's value is. `read`: those whose images were
    read, where that are not all."""

    def __init__(self, count, centers=None, unit="", quantity="pixel value"):
        self.read = None
        self.count, self.unit, self.quantity = count, unit, quantity
        self.centers = centers if centers is not None and len(centers) == count else None

    @property
    def axis(self):
        """Label of an axis along which gates are laid out."""
        if self.centers is None:
            return "number of the gate"
        return f"{'path length' if self.unit == 'scene units' else 'travel time'} ({self.unit})"

    @property
    def positions(self):
        return np.arange(self.count) if self.centers is None else np.asarray(self.centers)

    def known(self, stack):
        """Of a stack the images that were read."""
        return stack if self.read is None else stack[self.read]

    def label(self, gate):
        """Enough digits to tell neighbours apart."""
        if self.centers is None:
            return f"gate {gate}"
        steps = np.diff(np.unique(self.centers))
        digits = 5 if not len(steps) else max(3, int(np.ceil(np.log10(max(self.centers) / steps.min()))) + 1)
        return f"{self.centers[gate]:.{digits}g}"


class Folder:
    """Names and units that the folder's experiment.yaml gives; EXR files that name their own go first."""

    def __init__(self, directory):
        self.experiment, self.centers, self.unit, self.quantity = directory.name, None, "", "pixel value"
        path = directory / "experiment.yaml"
        if not path.exists():
            return
        try:
            data = yaml.load(path.read_text(encoding="utf-8"), LOADER) or {}
            gates = data.get("gates") or {}
            self.experiment = str(data.get("name", self.experiment))
            centers = gates.get("centers")
            if isinstance(centers, dict):
                centers = np.linspace(centers["start"], centers["stop"], int(centers["count"]))
            if centers is not None:
                self.centers = [float(c) for c in np.atleast_1d(centers)]
            unit = gates.get("unit", "scene")
            self.unit = "scene units" if unit == "scene" else str(unit)
        except (yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError) as error:
            raise PlotError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
        not_per_length = gates.get("kind") in ("steady", "modulated")
        self.quantity = "radiance" if not_per_length else "radiance per scene unit of path length"

    def gates(self, path, count):
        """Gates of one EXR file."""
        header = exr.attributes(path)
        try:
            notes = {k: v.decode("utf-8") for k, v in header.items() if k.startswith("isochron.")}
            if "isochron.gateUnit" in notes:
                centers = [float(c) for c in notes.get("isochron.gateCenters", "").split()]
                return Gates(count, centers or None, notes["isochron.gateUnit"], notes["isochron.quantity"])
        except (KeyError, ValueError) as error:
            raise PlotError(f"{path}: attributes of the gates cannot be read: {error}") from error
        return Gates(count, self.centers, self.unit, self.quantity)


def peaks(path):
    """component ('' for images) -> largest magnitude of each gate, as far as the file's header names them. Of files that cannot
    be read it names none: reading them tells why."""
    try:
        notes = {k: v.decode("utf-8") for k, v in exr.attributes(path).items() if k.startswith(PEAKS)}
        return {name[len(PEAKS) :].lstrip("."): np.array([float(p) for p in text.split()]) for name, text in notes.items()}
    except (OSError, ValueError):
        return {}


def read_stack(path, chosen=None):
    """component ('' for images) -> array of gates x height x width (grey) or gates x height x width x 3. Of the gates that were
    not `chosen`, where some were, it holds zeros."""
    found = {}
    for name in exr.channel_names(path):
        match = CHANNEL.fullmatch(name)
        if match:
            gates = found.setdefault(match["component"] or "", {})
            gates.setdefault(int(match["gate"]), {})[match["channel"]] = name
    if not found:
        raise PlotError(f"{path}: no channels named gateNNN.R/G/B, gateNNN.Y or COMPONENT.gateNNN.Y")
    for gates in found.values():
        if sorted(gates) != list(range(len(gates))) or any(set(l) not in ({"Y"}, set("RGB")) for l in gates.values()):
            raise PlotError(f"{path}: incomplete gates or channels")
        if len({len(l) for l in gates.values()}) != 1:
            raise PlotError(f"{path}: grey and colour gates in one file")
    wanted = lambda gates: range(len(gates)) if chosen is None else chosen
    names = [name for gates in found.values() for g in wanted(gates) for name in gates[g].values()]
    images = exr.read(path, None if chosen is None else set(names))
    height, width = next(iter(images.values())).shape
    out = {}
    for component, gates in found.items():
        grey = "Y" in gates[0]
        # The system gives memory only to what is not zero.
        stack = out[component] = np.zeros((len(gates), height, width) if grey else (len(gates), height, width, 3))
        for g in wanted(gates):
            stack[g] = images[gates[g]["Y"]] if grey else np.stack([images[gates[g][c]] for c in "RGB"], -1)
    return out


def read_log(path):
    """Column name -> array; empty and unreadable entries are NaN. A last line cut short is left out."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    if not rows or "iteration" not in rows[0]:
        raise PlotError(f"{path}: no column 'iteration'")

    def number(text):
        try:
            return float(text)
        except ValueError:
            return np.nan

    table = np.array([[number(x) for x in r] for r in rows[1:] if len(r) == len(rows[0])])
    table = table.reshape(-1, len(rows[0]))
    return {name: table[:, i] for i, name in enumerate(rows[0])}
