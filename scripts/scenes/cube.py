"""A glossy cube floating above a diffuse floor before a back wall, under a rectangular area light (after the
paper's Figures 9 and 11). Its height is what the experiments look for.

The cube is turned about the vertical so that none of its sides is parallel to the wall or to an edge of the
light. From the camera, the light's broad reflection shows on the cube's top and its shadow on the floor; the
two other visible sides get light from the floor and the wall alone.
"""

from . import mesh

CUBE_EDGE = 0.8
CUBE_CENTRE = (0, 0.5, 0)  # the bottom is 0.1 above the floor
CUBE_TURN = 15  # degrees
LIGHT_EDGE = 0.8
LIGHT_CENTRE = (0.1, 2.6, -0.4)

SCENE = """\
# Written by scripts/make_scenes.py; lengths in scene units, y is up.
camera:
  position: [-1.1, 2.3, 3.4]
  look_at:  [0, 0.45, 0.1]
  up:       [0, 1, 0]
  fov: 30                 # degrees, across the image's width
  resolution: [64, 64]    # width, height
materials:
  white: {type: diffuse, albedo: 0.6}
  metal: {type: rough_conductor, roughness: 0.2, reflectance: 0.9}
shapes:
  - {name: room, file: room.obj, material: white}                  # the floor and the back wall
  - {name: cube, file: cube.obj, material: metal}
  - {name: lamp, file: lamp.obj, material: white, emission: 10}    # shines downwards
"""


def write(directory):
    floor = mesh.quad([(-4, 0, 4), (4, 0, 4), (4, 0, -1.6), (-4, 0, -1.6)])
    wall = mesh.quad([(-4, 0, -1.6), (4, 0, -1.6), (4, 3, -1.6), (-4, 3, -1.6)])
    cube = mesh.translate(mesh.rotate_y(mesh.box(CUBE_EDGE), CUBE_TURN), CUBE_CENTRE)
    h = 0.5 * LIGHT_EDGE
    lamp = mesh.translate(mesh.quad([(-h, 0, -h), (h, 0, -h), (h, 0, h), (-h, 0, h)]), LIGHT_CENTRE)
    mesh.write_obj(directory / "room.obj", mesh.join(floor, wall), "Floor and back wall, facing inwards")
    mesh.write_obj(directory / "cube.obj", cube, "Cube at its target height, facing outwards")
    mesh.write_obj(directory / "lamp.obj", lamp, "Area light, facing down")
