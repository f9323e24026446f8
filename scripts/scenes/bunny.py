"""A diffuse rabbit in a box with a lamp below its ceiling (after the paper's Figure 8). The rabbit is a smooth union of
blobs; to use a scanned one, put its mesh (closed, facing outwards, feet at y = 0.06) in the place of bunny.obj.

It hovers a little above the floor, so that it can move up and down without touching anything.
"""

from . import implicit, mesh

GAP = 0.06  # between the paws and the floor
TURN = 23  # degrees; no face that the camera sees is nearly edge-on, where derivatives have a large variance
HEIGHT = 1.4
PLACE = (-0.05, GAP, -0.15)
LAMP_EDGE = 0.7
LAMP_HEIGHT = 1.96  # the ceiling is at 2
CELL = 0.042

SCENE = """\
# Written by scripts/make_scenes.py; lengths in scene units, y is up.
camera:
  position: [0, 1, 4.2]
  look_at:  [0, 1, 0]
  up:       [0, 1, 0]
  fov: 34                 # degrees, across the image's width
  resolution: [32, 32]    # width, height
materials:
  white: {type: diffuse, albedo: 0.6}
  dark:  {type: diffuse, albedo: 0.25}
  fur:   {type: diffuse, albedo: 0.75}
shapes:
  - {name: room, file: room.obj, material: white}                  # floor, ceiling, back and right wall
  - {name: left_wall, file: left_wall.obj, material: dark}
  - {name: bunny, file: bunny.obj, material: fur}
  - {name: lamp, file: lamp.obj, material: white, emission: 10}    # shines downwards
"""


def rabbit():
    """Looking along x, feet at y = 0."""
    blobs = implicit.Blobs()
    blobs.add((-0.06, 0.32, 0), (0.31, 0.26, 0.22), tilt=12)  # body
    blobs.add((0.12, 0.24, 0), (0.20, 0.20, 0.17))  # chest
    blobs.add((0.28, 0.60, 0), (0.18, 0.15, 0.15), tilt=-15)  # head
    blobs.add((0.42, 0.56, 0), (0.08, 0.08, 0.09))  # muzzle
    blobs.add((-0.40, 0.28, 0), (0.10, 0.10, 0.10))  # tail
    for side in (-1, 1):
        blobs.add((-0.15, 0.20, 0.15 * side), (0.19, 0.18, 0.10))  # haunch
        blobs.add((-0.02, 0.08, 0.17 * side), (0.21, 0.08, 0.09))  # hind paw
        blobs.add((0.26, 0.10, 0.09 * side), (0.13, 0.09, 0.08), tilt=-15)  # front paw
        blobs.add((0.17, 0.86, 0.13 * side), (0.085, 0.26, 0.065), tilt=20)  # ear
    vertices, triangles = implicit.polygonise(blobs, (-0.7, -0.2, -0.5), (0.7, 1.4, 0.5), CELL)
    low, high = vertices[:, 1].min(), vertices[:, 1].max()
    return (vertices - (0, low, 0)) * (HEIGHT / (high - low)), triangles


def write(directory):
    floor = mesh.quad([(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)])
    ceiling = mesh.quad([(-1, 2, -1), (1, 2, -1), (1, 2, 1), (-1, 2, 1)])
    back = mesh.quad([(-1, 0, -1), (1, 0, -1), (1, 2, -1), (-1, 2, -1)])
    left = mesh.quad([(-1, 0, 1), (-1, 0, -1), (-1, 2, -1), (-1, 2, 1)])
    right = mesh.quad([(1, 0, -1), (1, 0, 1), (1, 2, 1), (1, 2, -1)])
    h = 0.5 * LAMP_EDGE
    lamp = mesh.quad([(-h, LAMP_HEIGHT, -h), (h, LAMP_HEIGHT, -h), (h, LAMP_HEIGHT, h), (-h, LAMP_HEIGHT, h)])
    bunny = mesh.rounded(mesh.translate(mesh.rotate_y(rabbit(), -TURN), PLACE))
    mesh.write_obj(directory / "room.obj", mesh.join(floor, ceiling, back, right), "Walls of the box, facing inwards")
    mesh.write_obj(directory / "left_wall.obj", left, "Left wall of the box, facing inwards")
    mesh.write_obj(directory / "bunny.obj", bunny, "Rabbit, facing outwards")
    mesh.write_obj(directory / "lamp.obj", lamp, "Area light, facing down")
