#!/usr/bin/python3
"""Point and spot lights before a camera: derivatives with moving shadows against finite differences, and the warning about a light
that is where the camera is.

usage: lights_test.py PROGRAM
"""

import csv
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv.pop(1)

QUADS = {"floor": ((-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)), "wall": ((-2, 0, -2), (2, 0, -2), (2, 3, -2), (-2, 3, -2)),
         "plate": ((-0.42, 0.7, 0.36), (0.33, 0.75, 0.4), (0.37, 0.8, -0.31), (-0.39, 0.75, -0.35))}
SCENE = """\
camera: {position: [0.3, 1.7, 3.1], look_at: [0, 0.4, 0], up: [0, 1, 0], fov: 50, resolution: [12, 12]}
materials:
  white: {type: diffuse, albedo: 0.7, two_sided: true}
shapes:
""" + "".join(f"  - {{name: {name}, file: {name}.obj, material: white}}\n" for name in QUADS)
LIGHTS = {"point": "{name: lamp, type: point, position: [-0.4, 1.3, 0.4], intensity: 5}",
          "spot": "{name: lamp, type: spot, position: [-0.4, 1.3, 0.4], direction: [0.3, -1, -0.3], cone: 50, blend: 0.7, intensity: 5}",
          "flash": "{name: lamp, type: point, position: [0.3, 1.7, 3.1], intensity: 5}"}
EXPERIMENT = """\
name: lights
scene: scene.yaml
max_bounces: 2
gates: {kind: gaussian, centers: [4, 5, 6], sigma: 0.4}
parameters:
  - {name: lamp_x, type: translation, light: lamp, direction: [1, 0, 0.3], initial: 0, target: 0}
  - {name: plate_x, type: translation, shape: plate, direction: [1, 0, 0], initial: 0, target: 0}
  - {name: camera_x, type: camera_translation, direction: [1, 0, 0], initial: 0, target: 0}
"""
TURN = "  - {name: turn, type: rotation, light: lamp, axis: [0.2, 0, 1], initial: 0, target: 0}\n"


class LightsTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        for name, corners in QUADS.items():
            (self.folder / f"{name}.obj").write_text("".join("v %g %g %g\n" % c for c in corners) + "f 1 2 3 4\n")

    def run_program(self, command, light, *arguments):
        (self.folder / "scene.yaml").write_text(SCENE + f"lights:\n  - {LIGHTS[light]}\n")
        (self.folder / "lights.yaml").write_text(EXPERIMENT + (TURN if light == "spot" else ""))
        words = [PROGRAM, command, self.folder / "lights.yaml", "-o", self.folder / "out", "--quiet", "--no-plots", *arguments]
        return subprocess.run([str(w) for w in words], capture_output=True, text=True)

    def test_derivatives_are_finite_differences(self):
        for light in ("point", "spot"):
            with self.subTest(light):
                done = self.run_program("check", light, "--samples", 8192)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                with open(self.folder / "out/check.csv", encoding="ascii", newline="") as file:
                    rows = list(csv.DictReader(file))
                # What shadows and silhouettes left out, or of the wrong sign, would add to z.
                for parameter in ("lamp_x", "plate_x", "camera_x"):
                    clearest = max(abs(float(r["visibility"])) / float(r["finite_difference_error"]) for r in rows
                                   if r["parameter"] == parameter)
                    self.assertGreater(clearest, 8, parameter)

    def test_a_light_that_leaves_the_camera_is_told_of(self):
        for light, told in (("flash", True), ("point", False)):
            done = self.run_program("render", light, "--samples", 4)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual("light 'lamp' is at the camera's position" in done.stderr, told, done.stderr)


if __name__ == "__main__":
    unittest.main()
