"""A terrain of 11 x 11 vertices under an area light, seen from above (after the paper's Figure 13).

The mesh is flat; heights.txt holds the terrain's heights, one per vertex in the mesh's order.
"""

import numpy as np

from . import mesh

SIDE = 11  # vertices
EDGE = 2.0
LIGHT_EDGE = 0.5
LIGHT_CENTRE = (-0.9, 2.6, 0.5)

SCENE = """\
# Written by scripts/make_scenes.py; lengths in scene units, y is up.
camera:
  position: [0.3, 3, 0.9]
  look_at:  [0, 0, 0]
  up:       [0, 0, -1]
  fov: 44                 # degrees, across the image's width
  resolution: [32, 32]    # width, height
materials:
  soil:  {type: diffuse, albedo: 0.6}
  black: {type: diffuse, albedo: 0}
shapes:
  - {name: terrain, file: terrain.obj, material: soil}             # flat
  - {name: lamp, file: lamp.obj, material: black, emission: 100}
"""


def terrain_heights(x, z):
    """Hills and a valley, 0.2 up and down at most."""
    hill = 0.24 * np.exp(-((x - 0.35) ** 2 + (z + 0.3) ** 2) / 0.18)
    ridge = 0.16 * np.exp(-((x + 0.55 + 0.3 * z) ** 2) / 0.06)
    valley = -0.2 * np.exp(-((z - 0.55 + 0.4 * x) ** 2) / 0.08)
    return hill + ridge + valley + 0.03 * np.sin(4 * x + 5 * z)


def write(directory):
    along = np.linspace(-0.5 * EDGE, 0.5 * EDGE, SIDE)
    z, x = np.meshgrid(along, along, indexing="ij")
    vertices = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)
    lamp = mesh.face_towards(mesh.square(LIGHT_EDGE), LIGHT_CENTRE, (0, 0, 0))
    mesh.write_obj(directory / "terrain.obj", (vertices, mesh.grid(SIDE, SIDE)), "11 x 11 vertices, rows from back to front")
    mesh.write_obj(directory / "lamp.obj", lamp, "Area light, facing the terrain")
    heights = [f"{h:.6f}" for h in terrain_heights(x, z).ravel()]
    (directory / "heights.txt").write_text("\n".join(heights) + "\n", encoding="ascii")
