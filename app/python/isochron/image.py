"""Gated images as arrays that know what their axes are."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np


@dataclasses.dataclass(frozen=True, eq=False)
class Coordinates:
    """What the axes [gate, row, column, channel] of an image are. Row 0 is at the top; channels are grey, or red, green, blue."""

    centers: np.ndarray
    """[gate]: centres of gates, middles of bins, phases; empty where the sensor is steady."""
    unit: str
    """Of the centres: 'scene units' (of path length), 'ns', 'ps' or 'degrees'."""
    quantity: str = ""
    """What a value is, such as 'radiance per scene unit of path length'."""
    points: np.ndarray | None = None
    """[row, column, xyz] in scene units: where on the wall a capture's pixel looks. None for cameras."""
    spots: np.ndarray | None = None
    """[row, column, xyz] in scene units: where the laser lights the wall meanwhile. None for cameras."""


class Image(np.ndarray):
    """An array [gate, row, column, channel] with `coordinates`. Arithmetic keeps them; what has another shape has None."""

    coordinates: Coordinates | None

    def __new__(cls, values: Any, coordinates: Coordinates | None = None) -> Image:
        image = np.asarray(values).view(cls)
        image.coordinates = coordinates
        return image

    def __array_finalize__(self, source: Any) -> None:
        same = getattr(source, "shape", None) == self.shape
        self.coordinates = getattr(source, "coordinates", None) if same else None

    def __array_wrap__(self, values: np.ndarray, context: Any = None) -> Any:
        return values[()] if values.ndim == 0 else super().__array_wrap__(values, context)
