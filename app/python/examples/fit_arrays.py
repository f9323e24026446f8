#!/usr/bin/python3
"""A scene of arrays: a dented sheet, rendered through time gates and found again. The lines of a notebook, where images show themselves.

usage: PYTHONPATH=build/python python3 app/python/examples/fit_arrays.py [FOLDER]     FOLDER: where the run is written
"""

import sys

import numpy as np

import isochron

# A sheet of 7 x 7 vertices that faces the camera.
count = 7
x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(-1, 1, count), np.linspace(-1, 1, count)))
vertices = np.stack([x, y, np.zeros_like(x)], axis=1)
corner = np.arange(count * count).reshape(count, count)
a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]))
triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
dent = 0.2 * np.exp(-4 * (x**2 + y**2))

experiment = isochron.Experiment.from_dict({
    "name": "sheet",
    "scene": {
        "camera": {"position": [0, 0, 3], "look_at": [0, 0, 0], "up": [0, 1, 0], "fov": 45, "resolution": [24, 24]},
        "materials": {"paper": {"type": "diffuse", "albedo": 0.6}},
        "shapes": [{"name": "sheet", "vertices": vertices, "triangles": triangles, "material": "paper"}],
        "lights": [{"name": "flash", "type": "point", "position": [0, 0.5, 3], "intensity": 10}]},
    "max_bounces": 1,
    "gates": {"kind": "gaussian", "centers": np.linspace(5.8, 6.8, 6), "sigma": 0.1},
    "parameters": [{"name": "depth", "type": "vertices", "shape": "sheet", "direction": [0, 0, -1],
                    "initial": np.zeros(len(x)), "target": dent}],
    "target": {"samples": 256},
    "samples": {"primal": 32, "interior": 32, "visibility": 8, "path_length": 0},
    "optimizer": {"method": "levenberg_marquardt", "iterations": 10}})

image = experiment.render({"depth": dent})  # in a notebook, a cell per gate
run = experiment.run(*sys.argv[1:2], callback=lambda row: print(f"iteration {row.iteration}: depth off by {row.param_rmse:.4f} rms"))
print(f"error: {np.abs(run.values['depth'] - dent).max():.4f} of {dent.max():.4f}")
