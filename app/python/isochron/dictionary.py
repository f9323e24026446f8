"""Experiments of dictionaries and arrays, as the files that the program reads, in a folder that lives as long as they do."""

from __future__ import annotations

import os
import pathlib
import re
import shutil
import tempfile
import weakref
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import yaml

from isochron import exr
from isochron.errors import InputError
from isochron.files import replacing
from isochron.mesh_files import name_in_files, write_ply

DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


def write_table(path: pathlib.Path, response: Any) -> None:
    """A response of (offsets, values). Raises InputError."""
    try:
        offsets, values = (np.asarray(column, float) for column in response)
        np.save(path, np.stack([offsets, values], axis=1))
    except (TypeError, ValueError):
        raise InputError(f"{path}: expected a file, or a pair of arrays of one length: offsets, values") from None


def _is_path(value: Any) -> bool:
    return isinstance(value, (str, os.PathLike))


def _array(value: Any, key: str, expected: str, kinds: str) -> np.ndarray:
    """kinds: of NumPy's element types."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise InputError(f"{key}: expected {expected}, got rows of different lengths") from None
    if array.dtype.kind not in kinds:
        raise InputError(f"{key}: expected {expected}, got elements of type {array.dtype}")
    return array


def _rows_of_three(value: Any, key: str, expected: str, kinds: str) -> np.ndarray:
    array = _array(value, key, expected, kinds)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{key}: expected {expected}, got {array.shape}")
    return array


def _checked_mesh(vertices: Any, triangles: Any, key: str) -> tuple[np.ndarray, np.ndarray]:
    points = _rows_of_three(vertices, f"{key}.vertices", "[N, 3]", "iuf")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise InputError(f"{key}.vertices: vertex {bad[0]} is not finite")
    corners = _rows_of_three(triangles, f"{key}.triangles", "integers [M, 3]", "iu")
    bad = np.flatnonzero(((corners < 0) | (corners >= len(points))).any(axis=1))
    if len(bad):
        raise InputError(f"{key}.triangles: triangle {bad[0]}, {corners[bad[0]].tolist()}, has a vertex that is not there "
                         f"(allowed: 0 to {len(points) - 1})")
    return points, corners


def _remove(folder: str, owner: int) -> None:
    if os.getpid() == owner:  # not in a process that was forked
        shutil.rmtree(folder, ignore_errors=True)


class DictionaryFiles:
    """The files of one experiment. Within `with`, InputErrors name the dictionary's keys in place of files."""

    def __init__(self) -> None:
        folder = tempfile.mkdtemp(prefix="isochron-")
        self.folder = pathlib.Path(folder)
        self.remove = weakref.finalize(self, _remove, folder, os.getpid())
        """Also called when this is no longer referred to, and when Python ends."""
        self.experiment = self.folder / "experiment.yaml"
        self._scene = self.folder / "scene.yaml"
        self._keys: dict[pathlib.Path, str] = {}  # of the files of arrays
        self._captures: list[tuple[Any, str]] = []

    def __enter__(self) -> DictionaryFiles:
        return self

    def __exit__(self, kind: Any, error: Any, traceback: Any) -> None:
        if isinstance(error, InputError):
            raise InputError(self._in_keys(str(error))) from None

    def write(self, description: Mapping[str, Any]) -> None:
        """Raises InputError."""
        if not isinstance(description, Mapping):
            raise InputError(f"expected a dictionary of the keys of an experiment, got {type(description).__name__}")
        try:
            self._write_yaml(self.experiment, self._inner(description, ""))
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be written: {error.strerror or error}") from None

    def contents(self) -> tuple[dict[str, bytes], dict[str, str]]:
        """Name -> bytes of each file, and name -> key of those that hold arrays."""
        return {path.name: path.read_bytes() for path in self.folder.iterdir()}, {path.name: key for path, key in self._keys.items()}

    def restore(self, contents: Mapping[str, bytes], keys: Mapping[str, str]) -> None:
        """What contents() of others gave."""
        for name, data in contents.items():
            (self.folder / name).write_bytes(data)
        self._keys = {self.folder / name: key for name, key in keys.items()}

    def save(self, folder: Any) -> pathlib.Path:
        """Copies them, over files of the same names. Raises InputError."""
        folder = pathlib.Path(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for path in self.folder.iterdir():
                with replacing(folder / path.name) as temporary:
                    shutil.copyfile(path, temporary)
        except OSError as error:
            raise InputError(f"{folder}: cannot be written: {error.strerror or error}") from None
        return folder / self.experiment.name

    def _in_keys(self, line: str) -> str:
        for path, prefix in ((self.experiment, ""), (self._scene, "scene.")):
            line = re.sub(re.escape(str(path)) + r"(:\d+:\d+)?: ", prefix, line)
        for path, key in self._keys.items():
            line = line.replace(str(path), key)
            if key.endswith(".vertices"):
                line = line.replace(key.removesuffix("vertices") + "file: ", f"{key}: ")
            line = line.replace(f"{key}: {key}: ", f"{key}: ")
        return line

    def _new_file(self, stem: Any, suffix: str, key: str) -> pathlib.Path:
        name = name_in_files(str(stem))[:64]
        while (path := self.folder / f"{name}{suffix}").exists():
            name += "_"
        self._keys[path] = key
        return path

    def _write_yaml(self, path: pathlib.Path, value: Any) -> None:
        text = yaml.dump(value, Dumper=DUMPER, sort_keys=False, default_flow_style=None, allow_unicode=True, width=120)
        path.write_text(text, encoding="utf-8")

    def _plain(self, value: Any, key: str) -> Any:
        """What YAML has of a value; arrays that files hold go into such."""
        write = _WRITERS.get(re.sub(r"\[\d+\]", "[]", key), DictionaryFiles._inner)
        return write(self, value, key)

    def _inner(self, value: Any, key: str) -> Any:
        if isinstance(value, Mapping):
            return {str(name): self._plain(each, f"{key}.{name}" if key else str(name)) for name, each in value.items()}
        if isinstance(value, (np.ndarray, np.generic)):
            value = value.tolist()
        if isinstance(value, (list, tuple)):
            return [self._plain(each, f"{key}[{i}]") for i, each in enumerate(value)]
        if value is None or isinstance(value, (bool, int, float, str)):
            return value
        raise InputError(f"{key}: {type(value).__name__} has no YAML (allowed: numbers, texts, booleans, None, lists, dictionaries, "
                         "arrays)")

    def _scene_file(self, value: Any, key: str) -> Any:
        if not isinstance(value, Mapping):
            return self._file(value, key)
        self._write_yaml(self._scene, self._inner(value, key))
        return self._scene.name

    def _shape(self, value: Any, key: str) -> Any:
        mesh = {"vertices", "triangles"} & set(value if isinstance(value, Mapping) else ())
        if not mesh:
            return self._inner(value, key)
        for name, wrong in (("vertices", "vertices" not in mesh), ("triangles", "triangles" not in mesh), ("file", "file" in value)):
            if wrong:
                raise InputError(f"{key}.{name}: " + ("stands beside an array (allowed: one of them)" if name == "file" else "is missing"))
        plain = self._inner({name: each for name, each in value.items() if name not in mesh}, key)
        path = self._new_file(plain.get("name", "shape"), ".ply", f"{key}.vertices")
        write_ply(path, *_checked_mesh(value["vertices"], value["triangles"], key))
        return {**plain, "file": path.name}

    def _file(self, value: Any, key: str) -> Any:
        if not _is_path(value):
            return self._inner(value, key)
        path = os.path.abspath(value)
        if not os.path.isfile(path):
            raise InputError(f"{key}: there is no file '{os.fspath(value)}' (allowed: a path relative to the current folder, or arrays)")
        return path

    def _numbers(self, value: Any, key: str) -> Any:
        if not isinstance(value, np.ndarray) or value.ndim == 0:
            return self._file(value, key)
        values = _array(value, key, "numbers", "biuf").astype(float)
        if not np.isfinite(values).all():
            raise InputError(f"{key}: value {np.flatnonzero(~np.isfinite(values))[0]} is not finite")
        path = self._new_file(key.replace("parameters", "parameter"), ".npy", key)
        np.save(path, values)
        return path.name

    def _table(self, value: Any, key: str) -> Any:
        if _is_path(value) or isinstance(value, Mapping) or value is None:
            return self._file(value, key)
        path = self._new_file(key.rpartition(".")[2], ".npy", key)
        write_table(path, value)
        return path.name

    def _mask(self, value: Any, key: str) -> Any:
        if _is_path(value) or value is None:
            return self._file(value, key)
        path = self._new_file("mask", ".npy", key)
        np.save(path, _array(value, key, "[columns, rows]", "biuf"))
        return path.name

    def _images(self, value: Any, key: str) -> Any:
        if _is_path(value) or value is None:
            return self._file(value, key)
        expected = "[gate, row, column, channel], 1 or 3 channels"
        images = _array(value, key, expected, "biuf")
        if images.ndim != 4 or not images.size or images.shape[3] not in (1, 3):
            raise InputError(f"{key}: expected {expected}, got {images.shape}")
        path = self._new_file("target", ".exr", key)
        channels = "Y" if images.shape[3] == 1 else "RGB"
        exr.write(path, {f"gate{gate:03}.{channel}": image[..., i] for gate, image in enumerate(images)
                         for i, channel in enumerate(channels)})
        return path.name

    def _capture(self, value: Any, key: str) -> Any:
        if _is_path(value) or not hasattr(value, "write"):
            return self._file(value, key)
        for capture, name in self._captures:
            if capture is value:
                return name
        path = self._new_file("capture", ".h5", key)
        value.write(path)
        self._captures.append((value, path.name))
        return path.name


_WRITERS: dict[str, Callable[[DictionaryFiles, Any, str], Any]] = {
    "scene": DictionaryFiles._scene_file,
    "scene.capture.file": DictionaryFiles._capture,
    "scene.shapes[]": DictionaryFiles._shape,
    "scene.shapes[].file": DictionaryFiles._file,
    "gates.file": DictionaryFiles._table,
    "gates.response": DictionaryFiles._table,
    "target.capture": DictionaryFiles._capture,
    "target.images": DictionaryFiles._images,
    "target.mask": DictionaryFiles._mask,
    **{f"parameters[].{name}": DictionaryFiles._numbers for name in ("initial", "target", "lower", "upper")},
}
"""By keys, those of values that may be files."""
