"""Experiments: rendered, differentiated and run by the program's own code."""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import pathlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from isochron.dictionary import DictionaryFiles
from isochron.errors import InputError
from isochron.image import Coordinates, Image
from isochron.own_loss import Loss, name_of, own_loss
from isochron.progress import Progress, showing
from isochron.records import Callback, Evaluation, Gradient, Parameter, row_callback
from isochron.runs import Run, read_run

Path = str | os.PathLike[str]
Theta = np.ndarray | Sequence[float] | Mapping[str, Any] | None
Overrides = Mapping[str, Any] | Sequence[str]


def extension() -> Any:
    """The compiled part of this package, loaded when first needed. Raises ImportError where it was not built."""
    try:
        return importlib.import_module("isochron._core")
    except ModuleNotFoundError as error:
        if error.name != "isochron._core":
            raise
        raise ImportError("isochron: Experiment, resume and threads need the package's extension, which is not beside it: scripts/build "
                          "makes it, for PYTHONPATH=build/python; without it there are only the readers") from None


def _overrides(overrides: Overrides) -> list[str]:
    if not isinstance(overrides, Mapping):
        return [str(text) for text in overrides]

    def text(key: str, value: Any) -> str:
        if value is None:
            return ""
        try:
            return json.dumps(value, default=lambda other: other.tolist(), allow_nan=False)
        except (AttributeError, TypeError, ValueError):
            raise InputError(f"overrides: {key}: {value!r} has no YAML (allowed: numbers, texts, booleans, None, lists, "
                             "dictionaries, arrays)") from None

    return [f"{key}={text(key, value)}" for key, value in overrides.items()]


class Scaled:
    """An experiment for other optimisers: the unknowns x are theta in units of the parameters' scales, and the loss is divided by
    the loss at the start; all with one iteration's random numbers."""

    def __init__(self, experiment: Experiment, start: Theta = None, iteration: int = 0) -> None:
        self._experiment, self._iteration = experiment, iteration
        self._scale = np.concatenate([np.full(p.initial.size, p.scale) for p in experiment.parameters.values()] or [np.empty(0)])
        self.initial = experiment.theta(start) / self._scale
        """[unknown]: x at the start."""
        self.bounds = list(zip(experiment.lower / self._scale, experiment.upper / self._scale))
        """The least and the most of each x, infinite where there is no bound."""
        self.loss_at_start = experiment.evaluate(start, iteration).loss
        if not self.loss_at_start > 0:
            raise InputError(f"scaled: the loss at the start is {self.loss_at_start:g}: nothing to be made smaller")

    def theta(self, x: Any) -> np.ndarray:
        """[unknown]"""
        return np.asarray(x, dtype=float) * self._scale

    def loss_and_gradient(self, x: Any) -> tuple[float, np.ndarray]:
        """As scipy.optimize.minimize(..., jac=True) expects."""
        loss, gradient = self._experiment.loss_and_gradient(self.theta(x), self._iteration)
        return loss / self.loss_at_start, gradient * self._scale / self.loss_at_start


class Experiment:
    """An experiment, loaded: scene, gates, parameters, samples.

    overrides: values in place of the file's, {"samples.primal": 16, "parameters[0].initial": 0.2} (None removes a key), or
    a list of "KEY.PATH=VALUE", like the option --set of the commands.

    Wherever `theta` is asked for: an array [unknown] in the order of `parameters`, a dictionary from names to values (those
    that are not named have their initial values), or None: the initial values. Random numbers depend only on `seed` and
    `iteration`, not on the number of threads. Give each iteration of an optimisation another `iteration`;
    with another `seed`, automatic sampling repeats its trials, which takes time.

    `progress` of calls: True shows it on stderr or below a notebook's cell, False does not; None, the default, shows it in
    notebooks and on terminals, of calls that take more than half a second. A callable is told of it:
    progress(done, total, loss), of runs the iterations done and in all and the loss, else the part done of what is under way (the
    choice of how to sample may come before the rendering), 1 and NaN.

    Calls render without Python's lock. Ctrl-C ends them. Raises InputError.

    Pickled, an experiment is the path of its file, which has to be there where it is unpickled, or, of from_dict, what it
    was made of.
    """

    def __init__(self, path: Path, overrides: Overrides = ()) -> None:
        self._files: DictionaryFiles | None = None
        self._source = (os.path.abspath(path), _overrides(overrides))
        self._read(path, overrides)

    def __reduce__(self) -> tuple[Any, ...]:
        if self._files is None:
            return Experiment, self._source
        return _unpickled, self._files.contents()

    @classmethod
    def from_dict(cls, description: Mapping[str, Any]) -> Experiment:
        """From the keys of an experiment's file. `scene` may be the keys of a scene's file, and its shapes may have `vertices` [N, 3]
        and `triangles` [M, 3] in place of `file`. Arrays may also be initial, target, lower and upper of parameters, the target's
        `images` [gate, row, column, channel] and `mask` [column, row], and `response` and `file` of gates: (offsets, values). A Capture
        may be the target's `capture` and `file` of the scene's `capture`. Paths are relative to the current folder.

        Arrays are copied now. Images and counts have 32 bits, all else keeps its own. Raises InputError, which names
        keys, such as scene.shapes[0].vertices.
        """
        files = DictionaryFiles()
        return cls._of_files(files, lambda: files.write(description))

    @classmethod
    def _of_files(cls, files: DictionaryFiles, write: Callable[[], None]) -> Experiment:
        experiment = cls.__new__(cls)
        experiment._files = files
        try:
            with files:
                write()
                experiment._read(files.experiment)
        except BaseException:
            files.remove()
            raise
        return experiment

    def save(self, folder: Path) -> pathlib.Path:
        """Writes the arguments of from_dict as files, over those of the same names, and returns the path of folder/experiment.yaml.
        Raises InputError."""
        if self._files is None:
            raise InputError(f"save: the experiment {self.name} has its files already (allowed: one of from_dict)")
        return self._files.save(folder)

    def _read(self, path: Path, overrides: Overrides = ()) -> None:
        self._session = extension().Session(os.fspath(path), _overrides(overrides))
        self._parameters = {}
        for item in self._session.parameters():
            begin, count = item.pop("begin"), item.pop("count")
            for key in ("initial", "target", "lower", "upper"):
                item[key] = item[key].reshape(item["shape"])
            self._parameters[item["name"]] = Parameter(slice=slice(begin, begin + count), **item)
        self._coordinates = Coordinates(**self._session.coordinates())
        self._shape = tuple(self._session.shape())

    def __repr__(self) -> str:
        return f"<isochron.Experiment {self.name}: {', '.join(self._parameters) or 'no parameters'}>"

    @property
    def name(self) -> str:
        return str(self._session.name())

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Name -> Parameter, in the order of theta."""
        return dict(self._parameters)

    @property
    def coordinates(self) -> Coordinates:
        """Of all images of the experiment."""
        return self._coordinates

    @property
    def initial(self) -> np.ndarray:
        """[unknown]: theta where optimisations start."""
        return self._flat("initial")

    @property
    def lower(self) -> np.ndarray:
        """[unknown]: lower bounds of theta; -inf where there is none."""
        return self._flat("lower")

    @property
    def upper(self) -> np.ndarray:
        """[unknown]: upper bounds of theta; inf where there is none."""
        return self._flat("upper")

    @property
    def target(self) -> Image:
        """[gate, row, column, channel]: the target of optimisations, rendered at the target values or read from a file; as runs
        use it, rounded to 32 bits. Computed when first asked for."""
        with self._naming(), self._showing(None):
            return Image(self._session.target(), self._coordinates)

    def theta(self, values: Theta = None) -> np.ndarray:
        """[unknown]: of a dictionary from names to values, of None the initial values, of an array itself."""
        if values is not None and not isinstance(values, Mapping):
            return np.asarray(values, dtype=float).reshape(-1)
        flat = self.initial
        for name, value in (values or {}).items():
            if name not in self._parameters:
                raise InputError(f"theta: there is no parameter '{name}' (allowed: {', '.join(self._parameters) or 'none'})")
            parameter = self._parameters[name]
            try:
                flat[parameter.slice] = np.broadcast_to(np.asarray(value, dtype=float), parameter.shape).reshape(-1)
            except ValueError:
                raise InputError(f"theta: {name}: shape {np.shape(value)} (allowed: {parameter.shape}, or one number)") from None
        return flat

    def values(self, theta: Theta) -> dict[str, np.ndarray]:
        """Name -> array of the parameter's shape."""
        flat = self.theta(theta)
        return {name: flat[p.slice].reshape(p.shape) for name, p in self._parameters.items()}

    def render(self, theta: Theta = None, samples: int | None = None, seed: int | None = None, iteration: int = 0,
               progress: Progress = None) -> Image:
        """Gated images [gate, row, column, channel] in the unit of `coordinates.quantity`, those that `isochron render` writes.

        samples: per pixel, at least 2; default: samples.primal of the experiment.
        """
        with self._naming(), self._showing(progress):
            return Image(self._session.render(self.theta(theta), samples, seed, iteration), self._coordinates)

    def jvp(self, theta: Theta, tangent: Theta, samples: int | None = None, seed: int | None = None,
            iteration: int = 0, progress: Progress = None) -> Image:
        """Derivative [gate, row, column, channel] of the images along `tangent`, the Jacobian times it; with one 1 and else
        zeros in it what `isochron derive --parameter NAME` writes as `total`.

        tangent: [unknown], or a dictionary from names to values, in which what is not named is 0.
        """
        if isinstance(tangent, Mapping):
            tangent = self.theta({**{name: 0.0 for name in self._parameters}, **tangent})
        along = np.asarray(tangent, dtype=float).reshape(-1)
        with self._naming(), self._showing(progress):
            return Image(self._session.jvp(self.theta(theta), along, samples, seed, iteration), self._coordinates)

    def vjp(self, theta: Theta, adjoint: Any, samples: int | None = None, seed: int | None = None,
            iteration: int = 0, progress: Progress = None) -> np.ndarray:
        """[unknown]: the transposed Jacobian of the images times `adjoint`, an array that broadcasts to
        [gate, row, column, channel]. With the derivative of a loss by the image it is the loss's gradient, whatever the number
        of unknowns for the price of about one image. Its samples go where the adjoint is large."""
        try:
            full = np.broadcast_to(np.asarray(adjoint, dtype=float), self._shape)
        except ValueError:
            raise InputError(f"adjoint: shape {np.shape(adjoint)} (allowed: {self._shape}, or what broadcasts to it)") from None
        with self._naming(), self._showing(progress):
            return np.asarray(self._session.vjp(self.theta(theta), np.moveaxis(full, 0, 2), samples, seed, iteration))

    def evaluate(self, theta: Theta = None, iteration: int = 0, progress: Progress = None) -> Evaluation:
        """Loss, its gradient and the image: exactly what the experiment's optimiser evaluates in an iteration at theta. The
        same iteration has the same random numbers, so that differences between its thetas are far less noisy than the loss."""
        with self._naming(), self._showing(progress):
            found = self._session.evaluate(self.theta(theta), iteration)
        found["image"] = Image(found["image"], self._coordinates)
        return Evaluation(**found)

    def loss_and_gradient(self, theta: Theta = None, iteration: int = 0) -> tuple[float, np.ndarray]:
        """Loss and gradient [unknown] of `evaluate`, as scipy.optimize.minimize(..., jac=True) wants them."""
        found = self.evaluate(theta, iteration)
        return found.loss, found.gradient

    def scaled(self, start: Theta = None, iteration: int = 0) -> Scaled:
        """For optimisers of others, which know neither scales of unknowns nor that of the loss."""
        return Scaled(self, start, iteration)

    def gradient(self, theta: Theta = None, samples: int | None = None, seed: int | None = None,
                 progress: Progress = None) -> Gradient:
        """The loss's gradient with standard errors, what `isochron gradient` writes."""
        with self._naming(), self._showing(progress):
            return Gradient(**self._session.gradient(self.theta(theta), samples, seed))

    def run(self, folder: Path | None = None, *, start: Theta = None, callback: Callback | None = None,
            force: bool = False, loss: Loss | None = None, progress: Progress = None) -> Run:
        """Optimises, as `isochron run` does, into a folder (default: runs/NAME), and reads it.

        loss: what is minimised in place of the experiment's loss: loss(image) returns its value and its derivative by the image
        [gate, row, column, channel], or what broadcasts to it. The optimiser must be adam or lbfgs; no target is needed. It is
        called three times per iteration, with the image and with two of half of its samples each, which together cancel the
        bias that noise of the image gives a curved loss. So it should not call what is random.
        start: theta to begin at, in place of the initial values.
        callback: called with an Iteration after every row of the log; the run stops, and can be resumed, where it returns
        something true or raises.
        force: an earlier run in the folder is deleted, not moved aside.
        """
        first = None if start is None else self.theta(start)
        with self._naming(), self._showing(progress, of_run=True) as shown:
            return read_run(self._session.run("" if folder is None else os.fspath(folder), first, row_callback(callback, shown), force,
                                              own_loss(loss, self._coordinates), name_of(loss)))

    def _showing(self, progress: Progress, of_run: bool = False) -> contextlib.AbstractContextManager[Any]:
        return showing(progress, extension(), of_run)

    def _naming(self) -> contextlib.AbstractContextManager[Any]:
        """Within it, errors name what the user gave."""
        return self._files or contextlib.nullcontext()

    def _flat(self, key: str) -> np.ndarray:
        parts = [getattr(p, key).reshape(-1) for p in self._parameters.values()]
        return np.concatenate(parts) if parts else np.empty(0)


def _unpickled(contents: dict[str, bytes], keys: dict[str, str]) -> Experiment:
    files = DictionaryFiles()
    return Experiment._of_files(files, lambda: files.restore(contents, keys))


def resume(folder: Path, callback: Callback | None = None, *, loss: Loss | None = None, progress: Progress = None) -> Run:
    """Goes on from the last checkpoint of a run, to the same result bit for bit, and reads it. callback, loss, progress: as of
    Experiment.run; loss is to be the one that the run began with."""
    file = pathlib.Path(folder) / "experiment.yaml"
    coordinates = Experiment(file).coordinates if loss is not None and file.exists() else None
    with showing(progress, extension(), of_run=True) as shown:
        extension().resume(os.fspath(folder), row_callback(callback, shown), own_loss(loss, coordinates), name_of(loss))
    return read_run(folder)
