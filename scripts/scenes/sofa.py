"""A sofa behind an occluder, lit by a large area light; the camera sees the wall that the sofa faces and nothing else
(after the paper's Figure 16).

The sofa's cover is a grid of 8 x 7 vertices over a ramp: a front, a seat, a back and two armrests. Its vertices move
along the ramp's normal; initial.txt holds how far each is off at the start, which is overstuffed and askew.
"""

import numpy as np

from . import mesh

CENTRE = np.array([0.75, 0.75, 0])
LENGTH, WIDTH = 1.5, 1.2
# Height over the ramp along the profile, from the front's lower edge to the top of the back.
SEAT = np.array([0.02, 0.1, 0.04, -0.05, -0.09, -0.02, 0.06, 0.06])
ARMREST = np.array([0.05, 0.14, 0.18, 0.18, 0.1, 0.06, 0.08, 0.08])
ARM = np.array([1, 0.25, 0, 0, 0, 0.25, 1])  # across the width
LIGHT_EDGE = 0.6
LIGHT_CENTRE = (-0.3, 1.9, 0)

SCENE = """\
# Written by scripts/make_scenes.py; lengths in scene units, y is up.
camera:
  position: [0.6, 0.8, 2.6]
  look_at:  [-1, 0.8, 0]
  up:       [0, 1, 0]
  fov: 30                 # degrees, across the image's width
  resolution: [12, 12]    # width, height
materials:
  white: {type: diffuse, albedo: 0.8}
  black: {type: diffuse, albedo: 0}
  cover: {type: diffuse, albedo: [0.7, 0.35, 0.2]}
shapes:
  - {name: wall, file: wall.obj, material: white}
  - {name: occluder, file: occluder.obj, material: black}          # between camera and sofa
  - {name: sofa, file: sofa.obj, material: cover}                  # 8 x 7 vertices
  - {name: lamp, file: lamp.obj, material: black, emission: 100}   # shines at the sofa
"""


def write(directory):
    up_ramp = np.array([1, 1, 0]) / np.sqrt(2)
    normal = np.array([-1, 1, 0]) / np.sqrt(2)
    across = np.array([0, 0, -1])
    u, v = np.linspace(-0.5, 0.5, len(SEAT))[:, None], np.linspace(-0.5, 0.5, len(ARM))
    heights = SEAT[:, None] * (1 - ARM) + ARMREST[:, None] * ARM
    initial = 0.04 + 0.05 * np.cos(np.pi * u) * np.cos(np.pi * v) + 0.03 * (u + v)
    vertices = CENTRE + (LENGTH * u * up_ramp)[:, None] + (WIDTH * v)[:, None] * across + heights[..., None] * normal
    sofa = mesh.rounded((vertices.reshape(-1, 3), mesh.grid(*heights.shape)))
    lamp = mesh.face_towards(mesh.square(LIGHT_EDGE), LIGHT_CENTRE, CENTRE)
    wall = mesh.quad([(-1, -0.4, 1.4), (-1, -0.4, -1.4), (-1, 2, -1.4), (-1, 2, 1.4)])
    occluder = mesh.quad([(0.05, -0.4, 1), (1.6, -0.4, 1), (1.6, 2.3, 1), (0.05, 2.3, 1)])
    mesh.write_obj(directory / "sofa.obj", sofa, "8 x 7 vertices, rows from the front's lower edge to the top")
    mesh.write_obj(directory / "wall.obj", wall, "Wall that the sofa faces")
    mesh.write_obj(directory / "occluder.obj", occluder, "Panel, facing the camera")
    mesh.write_obj(directory / "lamp.obj", lamp, "Area light, facing the sofa")
    lines = [f"{h:.6f}" for h in initial.ravel()]
    (directory / "initial.txt").write_text("\n".join(lines) + "\n", encoding="ascii")
    (directory / "scene.yaml").write_text(SCENE, encoding="ascii")
