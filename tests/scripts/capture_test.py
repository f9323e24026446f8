#!/usr/bin/python3
"""Captures as a user meets them: what `render` writes is a measurement that `run` fits, expected counts are those that were
rendered, and what is wrong with files and scenes is said in one line.

usage: capture_test.py PROGRAM
"""

import csv
import pathlib
import subprocess
import sys
import tempfile
import unittest

import h5py
import numpy as np
import yaml
from seeds import generator

PROGRAM = sys.argv.pop(1)

SCENE = """\
capture:
  sensor: {corner: [-0.2, 0.2, 0], across: [0.4, 0, 0], down: [0, -0.4, 0], size: [5, 4]}
  normal: [0, 0, 1]
  laser: confocal
materials:
  paper: {type: diffuse, albedo: 0.5, two_sided: true}
shapes:
  - {name: board, file: board.obj, material: paper, transform: {translate: [0, 0, 0.5]}}
"""
BOARD = """\
v -0.2 -0.15 0
v 0.25 -0.15 0
v 0.25 0.2 0
v -0.2 0.2 0
f 1 2 3 4
"""
EXPERIMENT = """\
name: board
scene: scene.yaml
max_bounces: 1
gates: {kind: bins, unit: ps, scene_unit_m: 1, start: 3000, width: 32, count: 40, response: response.csv}
parameters:
  - {name: depth, type: translation, shape: board, direction: [0, 0, 1], initial: -0.03, target: 0}
  - {name: albedo, type: albedo, shape: board, per: vertex, initial: 0.4, target: 0.7}
  - {name: gain, type: gain, initial: 300, target: 300, lower: 299, upper: 301}
  - {name: dark, type: background, initial: 1, target: 2}
target: {samples: 256}
samples: {primal: 64, interior: 64, visibility: 0, path_length: 0}
loss: {kind: poisson}
optimizer: {method: quasi_newton, iterations: 8}
output: {histogram_samples: 4096}
"""
RESPONSE = "offset,value\n" + "".join(f"{4 * i},{np.exp(-4 * i / 100):.6f}\n" for i in range(100))


class CaptureTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        for name, text in (("scene.yaml", SCENE), ("board.obj", BOARD), ("board.yaml", EXPERIMENT), ("response.csv", RESPONSE)):
            (self.folder / name).write_text(text)

    def run_program(self, *arguments):
        return subprocess.run([PROGRAM, *map(str, arguments), "--quiet", "--no-plots"], capture_output=True, text=True)

    def render(self, *arguments):
        done = self.run_program("render", self.folder / "board.yaml", "--at", "target", "--samples", 1024, "-o",
                                self.folder / "rendered", *arguments)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return self.folder / "rendered/render.h5"

    def fit(self, *arguments):
        run = self.folder / "run"
        done = self.run_program("run", self.folder / "board.yaml", "-o", run, "--force", "--set", "target={capture: counts.h5}",
                                *arguments)
        return done, run

    def counts(self, source, change=lambda f: None, seed=1):
        """The rendered file with Poisson numbers in place of expected counts."""
        with h5py.File(source) as read, h5py.File(self.folder / "counts.h5", "w") as written:
            for key in read:
                read.copy(key, written)
            written["H"][...] = generator(seed).poisson(read["H"][()])
            change(written)

    def test_rendered_counts_are_fitted(self):
        rendered = self.render()
        with h5py.File(rendered) as file:
            expected = file["H"][()].astype(float)
            self.assertEqual(expected.shape, (40, 5, 4))  # [T, Sx, Sy]
            self.assertAlmostEqual(file["t_start"][()], 3000e-12 * 299792458, 9)
            np.testing.assert_allclose(file["sensor_grid_xyz"][4, 0], (0.2, 0.2, 0), atol=1e-7)  # columns run across
            np.testing.assert_allclose(file["sensor_grid_xyz"][0, 3], (-0.2, -0.2, 0), atol=1e-7)
        self.assertGreater(expected.max(), 20)
        self.counts(rendered)
        for gates in ("start: 3000, width: 32, count: 40, ", ""):
            with self.subTest(gates):
                done, run = self.fit("--set", "gates={kind: bins, unit: ps, scene_unit_m: 1, " + gates + "response: response.csv}")
                self.assertEqual(done.returncode, 0, done.stderr)
                found = yaml.safe_load((run / "summary.yaml").read_text())["parameters"]
                self.assertLess(abs(found["depth"]), 0.001)
                self.assertLess(abs(found["dark"] - 2), 0.3)
                with h5py.File(run / "final.h5") as file:
                    fitted = file["H"][()].astype(float)
                # The fit is closer than counts are by far: seven unknowns for 800 counts.
                self.assertLess(((fitted - expected) ** 2 / expected).mean(), 0.06)
        # Two bins of the file in each: counts add up, and so do gain and background.
        done, run = self.fit("--set", "gates={kind: bins, unit: ps, scene_unit_m: 1, start: 3064, width: 64, count: 18, response: "
                             "response.csv}", "--set", "parameters[2].upper=601", "--set", "parameters[2].initial=600")
        self.assertEqual(done.returncode, 0, done.stderr)
        with h5py.File(run / "final.h5") as file:
            wanted = expected[2:38].reshape(18, 2, 5, 4).sum(axis=1)
            self.assertLess(((file["H"][()] - wanted) ** 2 / wanted).mean(), 0.06)
        done, run = self.fit("--set", "gates={kind: bins, unit: ps, scene_unit_m: 1, start: 3010, width: 64, count: 18}")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))
        self.assertIn("do not hold whole bins of the file", done.stderr)

    def test_derivatives_through_three_bounces(self):
        """A board behind a black screen, beside a wall: shadow edges of sensor points and spots, and between the vertices. No
        shadow ends at the border of the board, where derivatives are one-sided."""
        for name, corners in (("screen", ((-0.113, -0.06, 0.25), (0.061, -0.06, 0.25), (0.061, 0.14, 0.25), (-0.113, 0.14, 0.25))),
                              ("side", ((0.35, -0.3, 0.15), (0.35, 0.3, 0.15), (0.35, 0.3, 0.6), (0.35, -0.3, 0.6)))):
            lines = ["v %g %g %g" % corner for corner in corners]
            (self.folder / f"{name}.obj").write_text("\n".join(lines) + "\nf 1 2 3 4\n")
        experiment = EXPERIMENT[:EXPERIMENT.index("parameters:")] + """\
parameters:
  - {name: board_x, type: translation, shape: board, direction: [1, 0, 0], initial: 0}
  - {name: screen_x, type: translation, shape: screen, direction: [1, 0, 0], initial: 0}
  - {name: pan, type: camera_rotation, axis: [0, 1, 0], initial: 0}
target: {images: none.exr}
"""
        gates = "gates={kind: gaussian, centers: [1.0, 1.2, 1.4], sigma: 0.06}"
        for laser in ("confocal", "{points: [[0.1, -0.2, 0]]}"):
            scene = SCENE.replace("confocal", laser).replace(
                "shapes:", "  black: {type: diffuse, albedo: 0, two_sided: true}\n"
                "  white: {type: diffuse, albedo: 0.9, two_sided: true}\nshapes:\n"
                "  - {name: screen, file: screen.obj, material: black}\n  - {name: side, file: side.obj, material: white}")
            (self.folder / "scene.yaml").write_text(scene)
            (self.folder / "board.yaml").write_text(experiment.replace("initial: 0", "initial: 0, target: 0").replace(
                "target: {images: none.exr}\n", ""))
            with self.subTest(laser):
                done = self.run_program("check", self.folder / "board.yaml", "--samples", 65536, "--set", gates, "--set",
                                        "max_bounces=3", "-o", self.folder / "check")
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                with open(self.folder / "check/check.csv", encoding="ascii", newline="") as file:
                    rows = list(csv.DictReader(file))
                # What a wrong sign of the visibility term would add to z.
                clearest = max(2 * abs(float(r["visibility"])) / float(r["finite_difference_error"]) for r in rows)
                self.assertGreater(clearest, 10)

    def test_instruments_move_with_the_capture(self):
        """With `origin` as without, moving capture and board alike changes nothing."""
        (self.folder / "scene.yaml").write_text(SCENE.replace("  laser: confocal\n", "  laser: {points: [[0.1, 0, 0]]}\n  origin: "
                                                              "{laser: [0.3, 0, 0.4], sensor: [-0.2, 0.1, 0.5]}\n"))
        gates = "gates: {kind: gaussian, centers: [2.15, 2.2, 2.25], sigma: 0.05}\n"
        (self.folder / "board.yaml").write_text("name: board\nscene: scene.yaml\nmax_bounces: 1\n" + gates + """\
parameters:
  - {name: board, type: translation, shape: board, direction: [0.3, 0, 1], initial: 0}
  - {name: capture, type: camera_translation, direction: [0.3, 0, 1], initial: 0}
samples: {primal: 256, interior: 256, visibility: 0, path_length: 0}
""")
        done = self.run_program("derive", self.folder / "board.yaml", "-o", self.folder / "derived")
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.folder / "derived/derive.csv", encoding="ascii") as file:
            rows = [row for row in csv.DictReader(file) if row["component"] == "total"]
        board, capture = (np.array([float(r["mean"]) for r in rows if r["parameter"] == name]) for name in ("board", "capture"))
        self.assertGreater(np.abs(board).max(), 0)
        np.testing.assert_allclose(capture, -board, atol=1e-4 * np.abs(board).max())

    def test_a_surface_that_faces_away(self):
        (self.folder / "scene.yaml").write_text(SCENE.replace("two_sided: true", "two_sided: false"))
        done = self.run_program("render", self.folder / "board.yaml", "-o", self.folder / "rendered")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (0, 1), done.stderr)
        self.assertIn("does a surface face the wall", done.stderr)

    def test_bad_files_get_one_line(self):
        rendered = self.render()

        def set_counts(value):
            def change(file):
                file["H"][3, 2, 1] = value
            return change

        def without(name):
            def change(file):
                del file[name]
            return change

        def reshaped(file):
            h = file["H"][()][:, :4]
            del file["H"]
            file["H"] = h

        for change, words in ((set_counts(-1), "is no count (loss.kind: poisson"), (set_counts(np.nan), "target.mask"),
                              (without("H"), "H"), (without("delta_t"), "delta_t"), (reshaped, "sensor grid")):
            self.counts(rendered, change)
            done, _ = self.fit()
            lines = done.stderr.strip().split("\n")
            self.assertEqual((done.returncode, len(lines)), (2, 1), done.stderr)
            self.assertIn(words, lines[0])
            self.assertIn("counts.h5", lines[0])

    def test_bad_scenes_and_responses_get_one_line(self):
        wrong = [
            ("scene.yaml", "normal: [0, 0, 1]", "normal: [0, 0, 0]", "normal"),
            ("scene.yaml", "translate: [0, 0, 0.5]", "translate: [0, 0, 0]", "in front of"),
            ("scene.yaml", "translate: [0, 0, 0.5]", "translate: [0, 0, -0.5]", "in front of"),
            ("scene.yaml", "material: paper", "material: paper, emission: 3", "laser"),
            ("scene.yaml", "across: [0.4, 0, 0]", "across: [0, 0, 0]", "across"),
            ("scene.yaml", "laser: confocal", "laser: {points: []}", "laser.points"),
            ("response.csv", RESPONSE, "offset,value\n0,0\n10,0\n", "response"),
            ("response.csv", RESPONSE, "offset,value\n0,1\n10,-1\n", "response"),
            ("board.yaml", "scene: scene.yaml", "scene: scene.yaml\nresolution: [3, 3]", "resolution"),
            ("board.yaml", "initial: 1, target: 2", "initial: -1, target: 2", "parameters[3].initial"),
        ]
        for name, old, new, words in wrong:
            with self.subTest(new):
                file = self.folder / name
                text = file.read_text()
                self.assertIn(old, text)
                file.write_text(text.replace(old, new))
                done = self.run_program("render", self.folder / "board.yaml", "-o", self.folder / "bad")
                file.write_text(text)
                lines = done.stderr.strip().split("\n")
                self.assertEqual((done.returncode, len(lines)), (2, 1), done.stderr)
                self.assertIn(words, lines[0])


if __name__ == "__main__":
    unittest.main()
