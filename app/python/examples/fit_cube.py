#!/usr/bin/python3
"""Finds the height of experiments/cube.yaml by SciPy's L-BFGS-B in place of isochron's own optimisers.

usage: PYTHONPATH=build/python python3 app/python/examples/fit_cube.py [SEED]
"""

import pathlib
import sys

import numpy as np
from scipy.optimize import minimize

import isochron

CUBE = pathlib.Path(__file__).resolve().parents[3] / "experiments/cube.yaml"
OVERRIDES = {
    "resolution": [32, 32],
    "seed": int(sys.argv[1]) if len(sys.argv) > 1 else 1,
    # SciPy's first step is one scene unit long. From heights below -0.13 no light comes within the gates' lengths.
    "parameters[0].lower": -0.1,
    "parameters[0].upper": 0.7,
}

# Wide gates first, to which the loss falls from afar; then those of the experiment, which see thin bands of it.
theta = None
for sigma in (0.3, 0.00005):
    experiment = isochron.Experiment(CUBE, {**OVERRIDES, "gates.sigma": sigma})
    # Each stage keeps to the random numbers of one iteration: to SciPy the loss has no noise. The gradient has, as its samples
    # are others than the image's; near the minimum line searches fail for it, and short ones fail sooner.
    result = minimize(experiment.loss_and_gradient, experiment.theta(theta), args=(0,), jac=True, method="L-BFGS-B",
                      bounds=list(zip(experiment.lower, experiment.upper)), options={"maxls": 5})
    theta = result.x
    print(f"gates of width {sigma:g}: height {theta[0]:.5f}, loss {result.fun:.3g}, {result.nfev} evaluations")

height = experiment.parameters["height"]
error = np.abs(theta[0] - height.target) / np.abs(height.initial - height.target)
print(f"error: {100 * error:.3f} % of where it began")
