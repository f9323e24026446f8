"""A cove lamp: a lamp in a case under the ceiling of a room, which shines upwards, so that its light leaves by a slit in the
case's bottom once the case has reflected it. Below stand a table and a block on it.

Paths that start at the camera rarely find the slit, paths that start at the lamp often do. The lamp's height in its case is
what the experiment looks for.
"""

from . import mesh

ROOM = 1.0  # half of its width
CASE = ((-0.5, 0.5, -0.4), (0.5, 0.95, 0.2))  # two corners
SLIT = (-0.16, -0.1)  # in z, across the whole case
LAMP = ((-0.3, 0.65, 0.0), (0.3, 0.65, 0.1))

SCENE = """\
# Written by scripts/make_scenes.py; lengths in scene units, y is up.
camera: {position: [0.3, 0.1, 3.6], look_at: [0, -0.1, 0], up: [0, 1, 0], fov: 34, resolution: [64, 64]}
materials:
  white: {type: diffuse, albedo: 0.7}
  enamel: {type: diffuse, albedo: 0.85, two_sided: true}
  block: {type: diffuse, albedo: 0.5}
  black: {type: diffuse, albedo: 0}
shapes:
  - {name: room, file: room.obj, material: white}                 # floor, ceiling, back, left and right
  - {name: case, file: case.obj, material: enamel}                # six thin walls, with a slit in the lowest
  - {name: lamp, file: lamp.obj, material: black, emission: 40}   # in the case, shines upwards
  - {name: block, file: block.obj, material: block}
"""


def horizontal(x0, z0, x1, z1, y, upwards):
    corners = [(x0, y, z1), (x1, y, z1), (x1, y, z0), (x0, y, z0)]
    return mesh.quad(corners if upwards else corners[::-1])


def write(directory):
    r = ROOM
    room = mesh.join(
        horizontal(-r, -r, r, r, -r, True),
        horizontal(-r, -r, r, r, r, False),
        mesh.quad([(-r, -r, -r), (r, -r, -r), (r, r, -r), (-r, r, -r)]),
        mesh.quad([(-r, -r, r), (-r, -r, -r), (-r, r, -r), (-r, r, r)]),
        mesh.quad([(r, -r, -r), (r, -r, r), (r, r, r), (r, r, -r)]),
    )
    (x0, y0, z0), (x1, y1, z1) = CASE
    case = mesh.join(
        horizontal(x0, z0, x1, z1, y1, False),
        horizontal(x0, z0, x1, SLIT[0], y0, True),
        horizontal(x0, SLIT[1], x1, z1, y0, True),
        mesh.quad([(x0, y0, z0), (x1, y0, z0), (x1, y1, z0), (x0, y1, z0)]),
        mesh.quad([(x1, y0, z1), (x0, y0, z1), (x0, y1, z1), (x1, y1, z1)]),
        mesh.quad([(x0, y0, z1), (x0, y0, z0), (x0, y1, z0), (x0, y1, z1)]),
        mesh.quad([(x1, y0, z0), (x1, y0, z1), (x1, y1, z1), (x1, y1, z0)]),
    )
    block = mesh.translate(mesh.rotate_y(mesh.box((0.5, 0.6, 0.4)), 25), (0.1, -0.7, 0.1))
    (x0, y, z0), (x1, _, z1) = LAMP
    mesh.write_obj(directory / "room.obj", room, "Floor, ceiling and three walls, facing inwards")
    mesh.write_obj(directory / "case.obj", case, "Thin walls, facing inwards")
    mesh.write_obj(directory / "lamp.obj", horizontal(x0, z0, x1, z1, y, True), "Area light, facing up")
    mesh.write_obj(directory / "block.obj", block, "Block on the floor, facing outwards")
