"""A run's folder as it is at this moment: finished, going on, broken off or damaged. `notes` say what cannot be read."""

import csv
import pathlib
import time

import numpy as np

from isochron.errors import InputError
from isochron.pictures.reading import Folder, read_log, read_stack, read_yaml

ENDED = {"converged": "converged after {} iterations", "iterations_reached": "all {} iterations done",
         "diverged": "diverged after {} iterations"}


class NoRun(Exception):
    """The folder holds no run, in one line."""


class Parameter:
    """One entry of the experiment's parameters: its numbers, where they are known."""

    def __init__(self, spec, found, errors):
        self.spec, self.name, self.kind = spec, str(spec.get("name", "?")), str(spec.get("type", "?"))
        self.found = as_numbers(found)
        self.count = len(self.found) if self.found is not None else max(
            len(as_numbers(spec.get(key)) if as_numbers(spec.get(key)) is not None else []) for key in ("initial", "target"))
        self.initial, self.target = (self._of_all(spec.get(key)) for key in ("initial", "target"))
        self.errors = as_numbers(errors)
        if self.errors is not None and len(self.errors) != self.count:
            self.errors = None

    def _of_all(self, values):
        values = as_numbers(values)
        if values is not None and len(values) == 1 and self.count > 1:
            return np.full(self.count, values[0])
        return values if values is not None and len(values) == self.count else None

    def component(self, i):
        return self.name if self.count == 1 else f"{self.name}[{i}]"

    @property
    def subject(self):
        """What it changes, in words."""
        of = next((str(self.spec[key]) for key in ("shape", "material", "light") if self.spec.get(key)), "")
        return " ".join(word for word in (self.kind.replace("_", " "), f"of {of}" if of else "") if word)


def last_level(directory):
    """Of a run in levels, the folder of the last that there is, which is a run by itself; else the folder."""
    levels = [path.parent for path in (directory / "levels").glob("*/experiment.yaml") if path.parent.name.isdigit()]
    return max(levels, key=lambda path: int(path.name), default=directory)


def as_numbers(values):
    """An array of floats, or None. YAML takes 1e-05 for text."""
    if values is None:
        return None
    try:
        return np.array([np.nan if v is None else float(v) for v in (values if isinstance(values, list) else [values])])
    except (TypeError, ValueError):
        return None


def whole(value):
    """A number of iterations; 0 where it is none."""
    return value if isinstance(value, int) and not isinstance(value, bool) and value > 0 else 0


class Run:
    def __init__(self, directory):
        self.directory, self.notes = pathlib.Path(directory), []
        if not self.directory.is_dir():
            raise NoRun(f"{directory}: no such folder")
        if not (self.directory / "experiment.yaml").exists():
            raise NoRun(f"{directory}: holds no run (there is no experiment.yaml)")
        self.top, self.whole = self.directory, self.read(read_yaml, "summary.yaml") or {}  # of all levels
        levels = self.whole.get("levels")
        self.levels = [level for level in levels if isinstance(level, dict)] if isinstance(levels, list) else []
        self.directory = last_level(self.directory)
        self.experiment = self.read(read_yaml, "experiment.yaml") or {}
        self.name = str(self.experiment.get("name", self.directory.resolve().name))
        self.text = self.read(lambda path: path.read_text(encoding="utf-8"), "experiment.yaml") or ""
        self.summary = self.read(read_yaml, "summary.yaml") or {}
        self.log = self.read(read_log, "log.csv") or {}
        self.folder = self.read(lambda path: Folder(self.directory), "experiment.yaml")
        self.scene = (self.read(read_yaml, self.experiment["scene"]) if self.scene_path.is_file() else None) or {}
        self._find_state()
        self._read_parameters()
        self._read_images()

    def read(self, action, name):
        """What `action` makes of a file; None where it is not there, or with a note where it cannot be read."""
        path = self.directory / name
        if not path.exists():
            return None
        try:
            return action(path)
        except (OSError, csv.Error, ValueError) as error:
            self.note(str(error) if isinstance(error, InputError) else f"{path}: {error}")
        return None

    def note(self, text):
        if text not in self.notes:
            self.notes.append(text)

    def map(self, *keys):
        """A map inside the experiment; empty where there is none."""
        value = self.experiment
        for key in keys:
            value = value.get(key) if isinstance(value, dict) else None
        return value if isinstance(value, dict) else {}

    def _find_state(self):
        status = str(self.summary.get("status", ""))
        rows = self.log.get("iteration", np.empty(0))
        self.iterations = whole(self.map("optimizer").get("iterations"))
        self.done = int(rows[-1]) if len(rows) and np.isfinite(rows[-1]) else 0
        if status in ENDED:  # the log may have a row more, of the final parameters
            self.done = whole(self.summary.get("iterations"))
        self.going = is_locked(self.directory / ".lock")
        self.ended = status in ENDED and not self.going
        if self.going:
            self.state, self.state_words = "going", f"still going: iteration {self.done} of {self.iterations}"
        elif status in ENDED:
            self.state = "diverged" if status == "diverged" else "finished"
            self.state_words = ENDED[status].format(self.done)
        elif status == "interrupted":
            self.state, self.state_words = "interrupted", f"interrupted after {self.done} of {self.iterations} iterations"
        else:
            self.state = "unfinished"
            self.state_words = (f"not ended: {self.done} of {self.iterations} iterations so far, and no process here works "
                                f"on it; it was killed, or runs on another machine{self._age()}")

    def _age(self):
        try:
            age = time.time() - (self.directory / "log.csv").stat().st_mtime
        except OSError:
            return ""
        return f" (last row {age:.0f} s ago)" if age < 3600 else f" (last row {age / 3600:.1f} h ago)"

    def _read_parameters(self):
        specs = self.experiment.get("parameters")
        specs = [s for s in specs if isinstance(s, dict)] if isinstance(specs, list) else []
        found = self.summary.get("parameters") if self.ended else None
        if not isinstance(found, dict):
            entries = (self.read(read_yaml, "checkpoint.yaml") or {}).get("parameters")
            entries = entries if isinstance(entries, list) else []
            found = {str(e.get("name")): e.get("value") for e in entries if isinstance(e, dict)}
        errors = self.summary.get("standard_errors") if self.ended else None
        errors = errors if isinstance(errors, dict) else {}
        self.errors_from = self.summary.get("standard_errors_from") if errors else None
        self._read_joint_errors()
        self.parameters = [Parameter(s, found.get(str(s.get("name"))), errors.get(str(s.get("name")))) for s in specs]

    def _read_joint_errors(self):
        """(name, mean, standard error) of combinations and (name, step) of what is not at the minimum."""
        def entries(key):
            found = self.summary.get(key) if self.ended else None
            return found.items() if isinstance(found, dict) else ()

        def first(value):
            values = as_numbers(value)
            return float(values[0]) if values is not None and len(values) else np.nan

        self.combinations = [(str(name), first(c.get("mean")), first(c.get("mean_standard_error")))
                             for name, c in entries("combinations") if isinstance(c, dict)]
        self.steps_left = [(str(name), first(step)) for name, step in entries("steps_left")]

    def _read_images(self):
        self.images = {}
        for name in ("target", "initial", "final"):
            stacks = self.read(read_stack, f"{name}.exr")
            if stacks and "" in stacks:
                self.images[name] = stacks[""]
        first = next(iter(self.images.values()), None)
        self.gates = None
        if first is not None and self.folder is not None:
            name = next(iter(self.images))
            self.gates = self.read(lambda path: self.folder.gates(path, len(first)), f"{name}.exr")
        self.shape = None if first is None else first.shape

    @property
    def quantity(self):
        """What a pixel's value is."""
        if str(self.map("loss").get("kind")) == "poisson":
            return "counts"
        return self.gates.quantity if self.gates is not None else "pixel value"

    @property
    def is_capture(self):
        return "capture" in self.scene

    @property
    def scene_path(self):
        return self.directory / str(self.experiment.get("scene", ""))

    def frames(self):
        """(label, iteration, image) from the first to the latest; of frames that are gone meanwhile, none."""
        frames = []
        for path in sorted((self.directory / "frames").glob("*.exr")):
            if path.stem.isdigit() and int(path.stem) <= max(self.done, 0):
                stack = self.read(read_stack, f"frames/{path.name}") if path.exists() else None
                if stack and "" in stack and stack[""].shape == self.shape:
                    frames.append((f"iteration {int(path.stem)}", int(path.stem), stack[""]))
        if not frames and "initial" in self.images:
            frames.append(("initial", 0, self.images["initial"]))
        if "final" in self.images and not self.going and self.state != "interrupted":
            frames = [f for f in frames if f[1] < self.done or f[1] == 0]
            frames.append((f"final, after iteration {self.done}", self.done, self.images["final"]))
        return frames


def is_locked(path):
    """Whether a process of this machine works in the folder: its lock, as the system lists it. Takes no lock itself, which
    could keep a run from starting."""
    try:
        inode = path.stat().st_ino
        lines = pathlib.Path("/proc/locks").read_text().splitlines()
    except OSError:
        return False
    return any(" FLOCK " in f" {line} " and "->" not in line and line.split()[5].split(":")[-1] == str(inode)
               for line in lines)
