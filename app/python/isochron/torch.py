"""Images that PyTorch differentiates. Imported only where torch is."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from isochron.experiment import Experiment


class Render(torch.autograd.Function):
    """Render.apply(theta, experiment, iteration): images [gate, row, column, channel] of a tensor theta [unknown], as doubles.

    Image and derivative have independent random numbers, so that the gradient of a squared loss is unbiased.
    """

    @staticmethod
    def forward(ctx: Any, theta: torch.Tensor, experiment: Experiment, iteration: int = 0) -> torch.Tensor:
        ctx.save_for_backward(theta)
        ctx.experiment, ctx.iteration = experiment, iteration
        image = experiment.render(theta.detach().cpu().numpy(), iteration=iteration)
        return torch.from_numpy(np.ascontiguousarray(image)).to(theta.device)

    @staticmethod
    def backward(ctx: Any, adjoint: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        theta, = ctx.saved_tensors
        gradient = ctx.experiment.vjp(theta.detach().cpu().numpy(), adjoint.cpu().numpy(), iteration=ctx.iteration)
        return torch.from_numpy(gradient).to(theta).reshape(theta.shape), None, None


def render(theta: torch.Tensor, experiment: Experiment, iteration: int = 0) -> torch.Tensor:
    """Images [gate, row, column, channel] that torch can differentiate by theta [unknown]."""
    return Render.apply(theta, experiment, iteration)
