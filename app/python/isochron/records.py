"""What experiments tell of themselves and of their runs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from isochron.image import Image


@dataclasses.dataclass(frozen=True, eq=False)
class Parameter:
    """One named parameter of an experiment. Values are in its unit; arrays have its shape."""

    name: str
    type: str
    """As in the experiment's file: translation, rotation, vertices, albedo, emission, time_offset, ..."""
    unit: str
    """'scene units' (of the offset along a direction of length one), 'degrees', the gates' unit; '' for what has none."""
    scale: float
    """The unit in which optimisers see the parameter, in units of `unit`."""
    shape: tuple[int, ...]
    """() for one value, (3,) for a colour, (n,) or (n, 3) for vertices."""
    slice: slice
    """The indices of its values in theta."""
    initial: np.ndarray
    target: np.ndarray
    """NaN where unknown."""
    lower: np.ndarray
    """-inf where there is no bound."""
    upper: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class Evaluation:
    """Estimates of one iteration. All are unbiased, so that `loss` can lie below 0 where the least possible is 0."""

    loss: float
    loss_noise: float
    """Standard error of the loss."""
    mean_squared_error: float
    """Of the image against the target."""
    gradient: np.ndarray
    """[unknown]: of the loss, per unit of each parameter."""
    image: Image
    """[gate, row, column, channel]"""


@dataclasses.dataclass(frozen=True, eq=False)
class Gradient:
    """Of the loss, with errors; arrays are [unknown], per unit of each parameter."""

    gradient: np.ndarray
    standard_error: np.ndarray
    degrees_of_freedom: np.ndarray
    """Of the standard errors, for Student's law."""


@dataclasses.dataclass(frozen=True, eq=False)
class Iteration:
    """The argument of callbacks, after each row of a run's log."""

    iteration: int
    closing: bool
    """Whether the row is of final parameters that no iteration had, such as an average."""
    iterations: int
    """Those that the run may have, of a run in levels the level."""
    level: int
    """From 1; 0 where the run is not one in levels."""
    levels: int
    seconds: float
    """Spent in iterations so far."""
    loss: float
    loss_noise: float
    """Standard error of the loss."""
    image_rmse: float
    """Root mean square error of the image against the target; 0 where its square is estimated below 0, NaN without a target."""
    param_rmse: float
    """Distance to the parameters' target values, in units of their scales; NaN where these are unknown."""
    gradient_norm: float
    """Of the gradient by parameters in units of their scales."""
    theta: np.ndarray
    """[unknown]"""
    gradient: np.ndarray
    """[unknown]"""
    image: np.ndarray
    """[gate, row, column, channel]"""


Callback = Callable[[Iteration], Any]


def row_callback(callback: Callback | None, shown: Any = None) -> Callable[[dict[str, Any]], bool] | None:
    """shown: what isochron.progress.showing gives."""
    if callback is None and shown is None:
        return None

    def row(values: dict[str, Any]) -> bool:
        if shown:
            shown.row(values)
        return bool(callback and callback(Iteration(**values)))

    return row
