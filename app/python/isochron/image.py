"""Gated images as arrays that know what their axes are."""

from __future__ import annotations

import dataclasses
import io
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

    def __reduce__(self) -> Any:
        make, arguments, state = super().__reduce__()
        return make, arguments, (state, self.coordinates)

    def __setstate__(self, state: Any) -> None:
        values, self.coordinates = state
        super().__setstate__(values)

    def _repr_png_(self) -> bytes | None:
        """How notebooks show it: a cell per gate, as the program's pictures; of what has values below zero red above, blue below it."""
        if self.coordinates is None or not self.size:
            return None
        # Takes long to load.
        from matplotlib import pyplot
        from isochron.pictures import sheets
        from isochron.pictures.reading import Gates
        from isochron.pictures.scales import scale_of

        stack = np.asarray(self)[..., 0] if self.shape[3] == 1 else np.asarray(self)
        where = self.coordinates
        gates = Gates(len(stack), where.centers.tolist(), where.unit, where.quantity or "pixel value")
        title = f"{gates.count} gates of {self.shape[2]} x {self.shape[1]} pixels"
        if (stack < 0).any():
            figure = sheets.draw_signed(title, {"": stack}, gates.quantity, gates)
        else:
            figure = sheets.draw_images(title, stack, scale_of(stack), gates)
        png = io.BytesIO()
        figure.savefig(png, format="png", dpi=110)
        pyplot.close(figure)
        return png.getvalue()
