"""Losses that Python computes from images, in place of the experiment's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from isochron.errors import InputError
from isochron.image import Coordinates, Image

Loss = Callable[[Image], tuple[float, Any]]
"""Of an image [gate, row, column, channel]: its loss, and the derivative of that by the image."""


def name_of(loss: Loss | None) -> str:
    """For messages."""
    if loss is None:
        return ""
    kind = loss if hasattr(loss, "__qualname__") else type(loss)
    return f"{kind.__module__}.{kind.__qualname__}"


def own_loss(loss: Loss | None, coordinates: Coordinates | None) -> Callable[[np.ndarray], tuple[float, np.ndarray]] | None:
    """As the extension takes it, checked: the derivative is [row, column, gate, channel]."""
    if loss is None:
        return None

    def checked(values: np.ndarray) -> tuple[float, np.ndarray]:
        result = loss(Image(values, coordinates))
        try:
            value, derivative = result
            value, derivative = float(value), np.asarray(derivative, dtype=float)
        except (TypeError, ValueError):
            raise InputError("loss: expected two values, the loss (a number) and its derivative by the image (an array), "
                             f"got {type(result).__name__}") from None
        try:
            full = np.broadcast_to(derivative, values.shape)
        except ValueError:
            raise InputError(f"loss: the derivative's shape {derivative.shape} is not the image's (allowed: {values.shape}, or what "
                             "broadcasts to it)") from None
        if not np.isfinite(derivative).all():
            raise InputError("loss: the derivative by the image is not finite")
        return value, np.moveaxis(full, 0, 2)

    return checked
