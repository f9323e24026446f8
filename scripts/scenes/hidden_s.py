"""A plane of albedos behind a wall, for the capture of a hidden letter S (see experiments/README.md).

The capture's own files, capture.h5 and response.csv, come from scripts/import_capture.py; they are not part of this repository.
"""

import numpy as np

from . import mesh

SIDE = 40  # vertices
EDGE = 0.7  # metres, that of the scanned wall

SCENE = """\
# Written by scripts/make_scenes.py; lengths in metres, the wall is at z = 0. See "Captures" in experiments/README.md for capture.h5.
capture: {file: capture.h5}
materials:
  paper: {type: diffuse, albedo: 0.5, two_sided: true}
shapes:
  - {name: plane, file: plane.obj, material: paper, transform: {translate: [0, 0, 0.45]}}   # 5 cm from where the letter is
"""


def write(directory):
    along = np.linspace(-0.5 * EDGE, 0.5 * EDGE, SIDE)
    y, x = np.meshgrid(-along, along, indexing="ij")
    vertices = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    mesh.write_obj(directory / "plane.obj", (vertices, mesh.grid(SIDE, SIDE)), "40 x 40 vertices, rows from top to bottom")
