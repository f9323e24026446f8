"""The rabbit around the corner: that of bunny.py, 0.25 m high, which stands 0.36 to 0.55 m from the wall and looks towards it.

response.csv is the instrument's response in picoseconds: a gaussian peak and an exponential tail, 60 ps wide at half its
height. scripts/rabbit_capture.py makes the photon counts, capture.h5, which are not part of this repository.
"""

import numpy as np

from . import bunny, mesh

HEIGHT = 0.25
NEAREST = 0.36
TURN = 52  # degrees: it is 0.19 m deep
SIDE = 0.5  # of the scanned wall
PEAK_PS, SIGMA_PS = 80, 24.8
TAIL, DECAY_PS = 0.12, 150  # of the peak's height, after it
STEP_PS, LAST_PS = 4, 800

SCENE = """\
# Written by scripts/make_scenes.py; lengths in metres. The wall is the plane z = 0, what is hidden lies at z > 0.
capture:
  sensor: {corner: [-0.25, 0.25, 0], across: [0.5, 0, 0], down: [0, -0.5, 0], size: [64, 64]}
  normal: [0, 0, 1]
  laser: confocal         # the sensor looks where the laser points
materials:
  fur: {type: diffuse, albedo: 0.75}
shapes:
  - {name: rabbit, file: rabbit.obj, material: fur}
"""


def rabbit():
    """In metres, its middle before that of the wall."""
    vertices, triangles = mesh.rotate_y(bunny.rabbit(), TURN)
    vertices = vertices * (HEIGHT / np.ptp(vertices[:, 1]))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle = 0.5 * (low + high)
    return mesh.rounded((vertices - (middle[0], middle[1], low[2] - NEAREST), triangles))


def response():
    """Offsets in picoseconds and values."""
    offsets = np.arange(0, LAST_PS + STEP_PS, STEP_PS)
    late = offsets - PEAK_PS
    peak = np.exp(-0.5 * (late / SIGMA_PS) ** 2)
    tail = np.where(late > 0, np.exp(-late / DECAY_PS), peak)
    return offsets, (1 - TAIL) * peak + TAIL * tail


def write(directory):
    mesh.write_obj(directory / "rabbit.obj", rabbit(), "Rabbit, facing outwards")
    rows = "".join(f"{t},{v:.6f}\n" for t, v in zip(*response()))
    (directory / "response.csv").write_text("offset,value\n" + rows, encoding="ascii")
