"""A bare tree that casts a soft shadow on the ground (after the paper's Figure 12).

The camera looks down at the shadow; the tree stands out of its view, between the light and the shadow. The branches
lie near one vertical plane, which the parameter turns about the trunk.
"""

import numpy as np

from . import mesh

# Foot, tip, thickness at the foot (the tip has half of it).
LIMBS = [
    ((0, 0, 0), (0.02, 1.5, 0), 0.12),
    ((0.01, 0.5, 0), (0.1, 1.0, 0.62), 0.08),
    ((0.01, 0.75, 0), (-0.08, 1.2, -0.55), 0.08),
    ((0.015, 1.0, 0), (-0.05, 1.5, 0.45), 0.07),
    ((0.02, 1.2, 0), (0.06, 1.6, -0.32), 0.06),
    ((0.06, 0.78, 0.35), (-0.06, 1.2, 0.62), 0.05),
    ((-0.04, 1.0, -0.3), (0.1, 1.42, -0.5), 0.05),
]
LIGHT_EDGE = 0.3
LIGHT_CENTRE = (-2.2, 3.0, 0.3)
TARGET_GROUND = (1.0, 0, 0)

SCENE = """\
# Written by scripts/make_scenes.py; lengths in scene units, y is up.
camera:
  position: [1.2, 2.4, 0.9]
  look_at:  [0.95, 0, -0.1]
  up:       [0, 0, -1]
  fov: 38                 # degrees, across the image's width
  resolution: [32, 32]    # width, height
materials:
  ground: {type: diffuse, albedo: 0.7}
  bark:   {type: diffuse, albedo: 0.4}
  black:  {type: diffuse, albedo: 0}
shapes:
  - {name: ground, file: ground.obj, material: ground}
  - {name: branches, file: branches.obj, material: bark}           # turns about the trunk, the y axis
  - {name: lamp, file: lamp.obj, material: black, emission: 100}   # shines on tree and ground
"""


def limb(foot, tip, thickness):
    """A tapering bar of square cross-section between two points."""
    foot, tip = np.asarray(foot, dtype=float), np.asarray(tip, dtype=float)
    bar, triangles = mesh.box(1)
    along = (tip - foot) / np.linalg.norm(tip - foot)
    across = np.cross(along, (1, 0, 0))
    across /= np.linalg.norm(across)
    frame = np.stack([np.cross(along, across), along, across])
    share = bar[:, 1:2] + 0.5  # 0 at the foot, 1 at the tip
    width = thickness * (1 - 0.5 * share)
    centre = foot + share * (tip - foot)
    return centre + width * (bar[:, [0, 2]] @ frame[[0, 2]]), triangles


def write(directory):
    branches = mesh.rounded(mesh.join(*(limb(*l) for l in LIMBS)))
    ground = mesh.quad([(-1, 0, 2), (3, 0, 2), (3, 0, -2), (-1, 0, -2)])
    lamp = mesh.face_towards(mesh.square(LIGHT_EDGE), LIGHT_CENTRE, TARGET_GROUND)
    mesh.write_obj(directory / "branches.obj", branches, "Trunk and branches at the target angle, facing outwards")
    mesh.write_obj(directory / "ground.obj", ground, "Ground, facing up")
    mesh.write_obj(directory / "lamp.obj", lamp, "Area light, facing the ground")
