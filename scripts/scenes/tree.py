"""A glossy tree with few faces on a ground, under a small area light (after the paper's Figures 1 and 17): a bent trunk
and clusters of foliage, rough lumps that overlap. The trunk ends a hair above the ground, so that no face lies in it.
"""

import random

import numpy as np

from . import mesh

SEED = 5
ROUGHNESS = 0.22  # of the lumps, relative to their radius
LAMP_EDGE = 0.9
TRUNK = [(0.01, 0.16, 0, 0), (0.12, 0.10, 0.01, 0), (0.55, 0.075, 0.05, 0.02), (1.0, 0.06, 0, 0)]
BRANCH = [(0.0, 0.045, 0, 0), (0.42, 0.02, 0.34, 0.1)]
CLUSTERS = [  # centre, radius
    ((0.0, 1.55, 0.0), 0.36), ((0.30, 1.22, 0.12), 0.32), ((-0.33, 1.18, 0.05), 0.33), ((0.02, 1.12, 0.36), 0.29),
    ((0.05, 1.16, -0.36), 0.31), ((0.46, 0.92, 0.17), 0.19)]

SCENE = """\
# Written by scripts/make_scenes.py; lengths in scene units, y is up.
camera:
  position: [0.6, 2.1, 4.2]
  look_at:  [0, 0.8, 0]
  up:       [0, 1, 0]
  fov: 37                 # degrees, across the image's width
  resolution: [128, 128]    # width, height
materials:
  ground: {type: diffuse, albedo: 0.6}
  gloss:  {type: rough_conductor, roughness: 0.4, reflectance: 0.8}
shapes:
  - {name: ground, file: ground.obj, material: ground}
  - {name: tree, file: tree.obj, material: gloss}
  - {name: lamp, file: lamp.obj, material: ground, emission: 20}    # shines downwards, at the tree
"""


def lump(centre, radius, generator):
    vertices, triangles = mesh.icosphere()
    lengths = np.array([1 + ROUGHNESS * (2 * generator.random() - 1) for _ in vertices])
    return mesh.translate((vertices * (radius * lengths)[:, None], triangles), centre)


def write(directory):
    generator = random.Random(SEED)
    parts = [mesh.prism(7, TRUNK), mesh.translate(mesh.prism(5, BRANCH), (0.05, 0.5, 0.02))]
    parts += [lump(centre, radius, generator) for centre, radius in CLUSTERS]
    ground = mesh.quad([(-4, 0, 4), (4, 0, 4), (4, 0, -4), (-4, 0, -4)])
    h = 0.5 * LAMP_EDGE
    lamp = mesh.quad([(-h, 0, -h), (h, 0, -h), (h, 0, h), (-h, 0, h)])
    lamp = mesh.rounded(mesh.translate(mesh.rotate_z(lamp, 25), (-1.5, 3.3, 1.4)))
    mesh.write_obj(directory / "ground.obj", ground, "Ground, facing up")
    mesh.write_obj(directory / "tree.obj", mesh.rounded(mesh.join(*parts)), "Trunk and foliage, closed, facing outwards")
    mesh.write_obj(directory / "lamp.obj", lamp, "Area light, facing the tree")
