"""Three white walls that meet at right angles, seen and lit from one point, into the corner.

All of the walls is in view, so that every vertex has data. They are one mesh: vertices on the edges where two walls meet
belong to both. The outline of the corner is a hexagon; its borders lie in the image.
"""

import numpy as np

from . import mesh

SIDE = 9  # vertices along an edge of a wall
EDGE = 1.8  # metres

SCENE = """\
# Written by scripts/make_scenes.py; lengths in metres, y is up.
camera:
  position: [2.2, 2.4, 3]
  look_at:  [0.5, 0.5, 0.5]
  up:       [0, 1, 0]
  fov: 64                 # degrees, across the image's width
  resolution: [48, 48]    # width, height
materials:
  white: {type: diffuse, albedo: 0.8}
shapes:
  - {name: walls, file: walls.obj, material: white}
lights:
  - {name: flash, type: point, position: [2.2, 2.4, 3], intensity: 10}   # where the camera is
"""


def walls():
    """x = 0, y = 0 and z = 0, facing the camera; 3 x 9 x 9 vertices less those that two or three of them share."""
    along = np.linspace(0, EDGE, SIDE)
    u, v = (a.ravel() for a in np.meshgrid(along, along, indexing="ij"))
    one = np.stack([u, v, np.zeros_like(u)], 1)
    triangles = mesh.grid(SIDE, SIDE)
    # grid() faces (down a column) x (along a row), here x cross y; the others follow by turning the axes.
    return mesh.join(*[(np.roll(one, k, axis=1), triangles) for k in range(3)])


def write(directory):
    vertices, triangles = walls()
    mesh.write_obj(directory / "walls.obj", (vertices, triangles), f"{len(vertices)} vertices; three walls, facing inwards")
