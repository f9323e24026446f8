"""A diffuse corridor of two segments that meet at a right angle (after the paper's Figure 10).

Camera and a small light stand at the open end of the first segment and look at the wall of the bend. The second
segment and the wall at its end are out of sight: light reaches them over the bend, and comes back over it.
"""

import numpy as np

from . import mesh

WIDTH = 1.0  # of both segments, and their height
BEND = 1.75  # how far the bend's outer wall is from the opening
END = 1.75  # x of the hidden end
LIGHT_EDGE = 0.2
LIGHT_CENTRE = (0.1, 0.6, -0.05)

SCENE = """\
# Written by scripts/make_scenes.py; lengths in scene units, y is up.
camera:
  position: [0.35, 0.4, -0.05]
  look_at:  [-0.5, 0.5, -1.25]
  up:       [0, 1, 0]
  fov: 30                 # degrees, across the image's width
  resolution: [8, 8]      # width, height
materials:
  white: {type: diffuse, albedo: 0.8}
  black: {type: diffuse, albedo: 0}
shapes:
  - {name: corridor, file: corridor.obj, material: white}          # open at z = 0; the hidden end is at x = 1.75
  - {name: lamp, file: lamp.obj, material: black, emission: 100}   # shines into the first segment
"""


def write(directory):
    h = 0.5 * WIDTH
    # The plan, counter-clockwise seen from above, from the opening's one side to the other.
    plan = [(h, 0), (h, WIDTH - BEND), (END, WIDTH - BEND), (END, -BEND), (h, -BEND), (-h, -BEND),
            (-h, WIDTH - BEND), (-h, 0)]
    walls = [mesh.quad([(x0, 0, z0), (x0, WIDTH, z0), (x1, WIDTH, z1), (x1, 0, z1)])
             for (x0, z0), (x1, z1) in zip(plan, plan[1:])]
    cells = [(0, 1, 6, 7), (1, 4, 5, 6), (1, 2, 3, 4)]  # first segment, bend, second segment
    levels = []
    for cell in cells:
        corners = np.array([(plan[i][0], 0, plan[i][1]) for i in cell], dtype=float)
        levels += [mesh.quad(corners), mesh.quad((corners + (0, WIDTH, 0))[::-1])]
    corridor = mesh.join(*walls, *levels)
    lamp = mesh.face_towards(mesh.square(LIGHT_EDGE), LIGHT_CENTRE, (-0.5 * WIDTH, 0.5 * WIDTH, 0.5 * WIDTH - BEND))
    mesh.write_obj(directory / "corridor.obj", corridor, "Two segments, facing inwards")
    mesh.write_obj(directory / "lamp.obj", lamp, "Area light, facing the wall opposite the second segment")
