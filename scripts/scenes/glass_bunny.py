"""A rabbit of rough glass in a diffuse box; a square patch hides it and the lamp above it from the camera, which sees the
walls around the patch alone (after the paper's Figure 15). Box and rabbit are those of scenes/bunny.
"""

from . import mesh

PATCH_EDGE = 1.2
PATCH_CENTRE = (0, 1, 0.8)
LAMP_EDGE = 0.4
LAMP_CENTRE = (0, 1.6, -0.1)

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
  black: {type: diffuse, albedo: 0}
  glass: {type: rough_dielectric, roughness: 0.4, ior: 1.5}
shapes:
  - {name: room, file: ../bunny/room.obj, material: white}
  - {name: left_wall, file: ../bunny/left_wall.obj, material: white}
  - {name: bunny, file: ../bunny/bunny.obj, material: glass,
     transform: {scale: 0.6, translate: [0, 0.45, 0]}}
  - {name: patch, file: patch.obj, material: black}                # faces the camera
  - {name: lamp, file: lamp.obj, material: black, emission: 100}   # shines downwards, at the bunny
"""


def write(directory):
    patch = mesh.translate(mesh.square(PATCH_EDGE), PATCH_CENTRE)
    lamp = mesh.face_towards(mesh.square(LAMP_EDGE), LAMP_CENTRE, (LAMP_CENTRE[0], 0, LAMP_CENTRE[2]))
    mesh.write_obj(directory / "patch.obj", patch, "Square patch, facing the camera")
    mesh.write_obj(directory / "lamp.obj", lamp, "Area light, facing down")
