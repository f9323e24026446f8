"""A sofa behind an occluder, lit by a large area light; the camera looks over the sofa's back at the wall that the sofa
faces, and sees nothing else (after the paper's Figure 16).

The sofa's cover is a grid of 10 x 9 vertices: a front, a seat, a back and two armrests. Its rim is nailed to the frame;
the 8 x 7 vertices within move along the grid's normal. moving.txt lists them, initial.txt holds how far each is off at the
start: overstuffed and askew.
"""

import numpy as np

from . import mesh

CENTRE = np.array([0.75, 0.7, 0])
LENGTH, WIDTH = 1.8, 1.6
SLOPE = 50  # degrees, of the grid's plane
# Height over that plane along the profile, from the front's lower edge to the top of the back.
SEAT = np.array([0, 0.06, 0.07, 0.03, -0.04, -0.06, -0.03, 0.03, 0.05, 0])
ARMREST = np.array([0.02, 0.09, 0.12, 0.13, 0.13, 0.1, 0.08, 0.08, 0.06, 0])
ARM = np.array([1, 1, 0.3, 0, 0, 0, 0.3, 1, 1])  # across the width
LIGHT_EDGE = 0.6
LIGHT_CENTRE = (-0.35, 1.75, 0)
WALL = -0.35  # x
OCCLUDER = 1.5  # x

SCENE = """\
# Written by scripts/make_scenes.py; lengths in scene units, y is up.
camera:
  position: [2.2, 2.6, 0]
  look_at:  [-0.35, 0.83, 0]
  up:       [0, 1, 0]
  fov: 34                 # degrees, across the image's width
  resolution: [14, 8]     # width, height
materials:
  white: {type: diffuse, albedo: 0.8}
  black: {type: diffuse, albedo: 0}
  cover: {type: diffuse, albedo: [0.7, 0.35, 0.2]}
shapes:
  - {name: wall, file: wall.obj, material: white}
  - {name: occluder, file: occluder.obj, material: black}          # between camera and sofa
  - {name: sofa, file: sofa.obj, material: cover}                  # 10 x 9 vertices
  - {name: lamp, file: lamp.obj, material: black, emission: 100}   # shines at the sofa
"""


def write(directory):
    slope = np.radians(SLOPE)
    up_slope, normal = np.array([np.cos(slope), np.sin(slope), 0]), np.array([-np.sin(slope), np.cos(slope), 0])
    across = np.array([0, 0, -1])
    rows, columns = len(SEAT), len(ARM)
    u, v = np.linspace(-0.5, 0.5, rows)[:, None], np.linspace(-0.5, 0.5, columns)
    heights = SEAT[:, None] * (1 - ARM) + ARMREST[:, None] * ARM
    offsets = 0.05 + 0.12 * np.cos(np.pi * u) * np.cos(np.pi * v) + 0.07 * (u + v)
    vertices = CENTRE + (LENGTH * u * up_slope)[:, None] + (WIDTH * v)[:, None] * across + heights[..., None] * normal
    sofa = mesh.rounded((vertices.reshape(-1, 3), mesh.grid(rows, columns)))
    lamp = mesh.face_towards(mesh.square(LIGHT_EDGE), LIGHT_CENTRE, CENTRE)
    wall = mesh.quad([(WALL, -0.2, 1.3), (WALL, -0.2, -1.3), (WALL, 1.4, -1.3), (WALL, 1.4, 1.3)])
    occluder = mesh.quad([(OCCLUDER, 0, 1), (OCCLUDER, 0, -1), (OCCLUDER, 1.8, -1), (OCCLUDER, 1.8, 1)][::-1])
    mesh.write_obj(directory / "sofa.obj", sofa, "10 x 9 vertices, rows from the front's lower edge to the top")
    mesh.write_obj(directory / "wall.obj", wall, "Wall that the sofa faces")
    mesh.write_obj(directory / "occluder.obj", occluder, "Panel, facing the camera")
    mesh.write_obj(directory / "lamp.obj", lamp, "Area light, facing the sofa")
    lines = [f"{h:.6f}" for h in offsets[1:-1, 1:-1].ravel()]
    (directory / "initial.txt").write_text("\n".join(lines) + "\n", encoding="ascii")
