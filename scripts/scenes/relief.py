"""A face-like relief around the corner: a sheet of 0.3 m whose middle stands out by 7 cm, 0.42 m from the wall.

The mesh is flat; depths.txt holds what is added to the depth of each vertex, in the mesh's order. The instrument's response is
that of the rabbit.
"""

import numpy as np

from . import mesh

SIDE = 41  # vertices
EDGE = 0.3
DEPTH = 0.42

SCENE = """\
# Written by scripts/make_scenes.py; lengths in metres. The wall is the plane z = 0, what is hidden lies at z > 0.
capture:
  sensor: {corner: [-0.25, 0.25, 0], across: [0.5, 0, 0], down: [0, -0.5, 0], size: [32, 32]}
  normal: [0, 0, 1]
  laser: confocal         # the sensor looks where the laser points
materials:
  plaster: {type: diffuse, albedo: 0.5}
shapes:
  - {name: relief, file: relief.obj, material: plaster}   # flat
"""


def depths(x, y):
    """In metres; towards the wall is below 0."""
    def bump(x0, y0, width, height):
        return np.exp(-((x - x0) / width) ** 2 - ((y - y0) / height) ** 2)

    head = -0.05 * bump(0, 0, 0.078, 0.092)
    brows = -0.018 * (bump(0.03, 0.03, 0.02, 0.02) + bump(-0.03, 0.03, 0.02, 0.02))
    return head + brows + 0.012 * bump(0, -0.05, 0.03, 0.012)


def write(directory):
    along = np.linspace(-0.5 * EDGE, 0.5 * EDGE, SIDE)
    y, x = np.meshgrid(along, along, indexing="ij")
    vertices = np.stack([x, y, np.full_like(x, DEPTH)], axis=-1).reshape(-1, 3)
    mesh.write_obj(directory / "relief.obj", (vertices, mesh.grid(SIDE, SIDE)), f"{SIDE} x {SIDE} vertices, facing the wall")
    text = "\n".join(f"{d:.6f}" for d in depths(x, y).ravel())
    (directory / "depths.txt").write_text(text + "\n", encoding="ascii")
