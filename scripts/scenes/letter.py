"""A letter R on a board around the corner, which a confocal scan of a wall is to find.

The mesh is flat and parallel to the wall; albedo.txt and relief.txt hold the truth, one value per vertex in the mesh's order,
and the experiment's pose does the rest. response.csv is the instrument's response in picoseconds.
"""

import numpy as np

from . import mesh

SIDE = 11  # vertices
EDGE = 0.6
INK, PAPER = 0.9, 0.05
STROKE = 0.06  # half of a stroke's width
BULGE = 0.025  # of the bent board, towards the wall
DECAY_PS, STEP_PS, LAST_PS = 200, 2, 1000

SCENE = """\
# Written by scripts/make_scenes.py; lengths in metres. The wall is the plane z = 0, what is hidden lies at z > 0.
capture:
  sensor: {corner: [-0.35, 0.35, 0], across: [0.7, 0, 0], down: [0, -0.7, 0], size: [32, 32]}
  normal: [0, 0, 1]
  laser: confocal         # the sensor looks where the laser points
materials:
  paint: {type: diffuse, albedo: 0.5}
shapes:
  - {name: board, file: board.obj, material: paint, transform: {translate: [0, 0, 0.5]}}   # flat
"""


def strokes():
    """The middle lines of an R, as points close to each other."""
    line = lambda a, b: np.linspace(a, b, 200)
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 200)
    bow = np.stack([0.03 + 0.11 * np.cos(angles), 0.1 + 0.1 * np.sin(angles)], 1)
    return np.concatenate([line((-0.14, -0.2), (-0.14, 0.2)), line((-0.14, 0.2), (0.03, 0.2)), bow,
                           line((0.03, 0), (-0.14, 0)), line((0, 0), (0.16, -0.2))])


def coverage(x, y, edge):
    """1 on the strokes and 0 off them, with a linear transition `edge` wide."""
    points = strokes()
    distance = np.min(np.hypot(x[..., None] - points[:, 0], y[..., None] - points[:, 1]), axis=-1)
    return np.clip((STROKE - distance) / edge + 0.5, 0, 1)


def relief(x, y):
    """Offsets along z: the board is bent, and bulges towards the wall."""
    return -BULGE * np.exp(-0.5 * (((x + 0.03) / 0.14) ** 2 + ((y - 0.04) / 0.18) ** 2))


def write_values(path, values):
    path.write_text("".join(f"{v:.6f}\n" for v in values.ravel() + 0.0), encoding="ascii")


def write(directory):
    along = np.linspace(-0.5 * EDGE, 0.5 * EDGE, SIDE)
    # Rows from the top, each from the left to the right in x: the normals point to -z, at the wall.
    y, x = np.meshgrid(-along, along, indexing="ij")
    triangles = mesh.grid(SIDE, SIDE)[:, ::-1]
    vertices = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    mesh.write_obj(directory / "board.obj", (vertices, triangles), f"{SIDE} x {SIDE} vertices, rows from the top, facing -z")
    write_values(directory / "albedo.txt", PAPER + (INK - PAPER) * coverage(x, y, EDGE / (SIDE - 1)))
    write_values(directory / "relief.txt", relief(x, y))
    offsets = np.arange(0, LAST_PS + STEP_PS, STEP_PS)
    rows = "".join(f"{t},{np.exp(-t / DECAY_PS):.6f}\n" for t in offsets)
    (directory / "response.csv").write_text("offset,value\n" + rows, encoding="ascii")
