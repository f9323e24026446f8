#!/usr/bin/python3
"""Numbers have a point, read or written, in programs that speak a language with a decimal comma, as windows of Qt and GTK set it.

usage: locale_test.py PACKAGES     PACKAGES: the folder that holds the package with its extension
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

PACKAGES = sys.argv.pop(1)
FIELD = pathlib.Path(__file__).resolve().parents[1] / "data/field"
NAME = "de_DE.UTF-8"
SCRIPT = """
import locale, sys
locale.setlocale(locale.LC_ALL, sys.argv[1])
print(locale.localeconv()["decimal_point"])
import isochron
print(isochron.Experiment(sys.argv[2]).render().mean())
isochron.Experiment(sys.argv[3]).run(sys.argv[4])
"""
SCENE = """\
capture:
  sensor: {corner: [-0.2, 0.2, 0], across: [0.4, 0, 0], down: [0, -0.4, 0], size: [3, 2]}
  normal: [0, 0, 1]
  laser: confocal
materials: {paper: {type: diffuse, albedo: 0.5, two_sided: true}}
shapes:
  - {name: ply, file: board.ply, material: paper, transform: {translate: [0, 0, 0.5]}}
  - {name: off, file: board.off, material: paper, transform: {translate: [0, 0.5, 0.55]}}
  - {name: stl, file: board.stl, material: paper, transform: {translate: [0.5, 0, 0.55]}}
"""
EXPERIMENT = """\
name: board
scene: scene.yaml
max_bounces: 1
gates: {kind: bins, unit: ps, scene_unit_m: 1, start: 3000, width: 64.5, count: 20, response: response.csv}
parameters:
  - {name: corners, type: vertices, shape: ply, direction: free, initial: offsets.txt, target: 0}
target: {samples: 16}
samples: {primal: 4, interior: 4, visibility: 4, path_length: 0}
loss: {kind: poisson}
optimizer: {method: quasi_newton, iterations: 1}
output: {geometry: obj}
"""
POINTS = ("-0.2 -0.15 0.0", "0.25 -0.15 0.0", "0.25 0.2 0.0")
FILES = {
    "scene.yaml": SCENE, "board.yaml": EXPERIMENT, "response.csv": "offset,value\n0,0.0\n8.5,2.25\n40,0\n",
    "offsets.txt": "0.01 0.02 0.01, " * 3,
    "board.off": "OFF\n3 1 0\n" + "\n".join(POINTS) + "\n3 0 1 2\n",
    "board.stl": "solid s\nfacet normal 0 0 1\nouter loop\n" + "".join(f"vertex {p}\n" for p in POINTS) + "endloop\nendfacet\n",
    "board.ply": "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
                 "property list uchar int vertex_indices\nend_header\n" + "\n".join(POINTS) + "\n3 0 1 2\n"}


class LocaleTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        for name, text in FILES.items():
            (self.folder / name).write_text(text)

    def run_in(self, language):
        """What the script prints, and the files that it writes, without times."""
        out = self.folder / "run"
        environment = {**os.environ, "PYTHONPATH": PACKAGES, "LOCPATH": str(self.folder), "PYTHONWARNINGS": "ignore"}
        done = subprocess.run([sys.executable, "-c", SCRIPT, language, FIELD / "locale/e.yaml", self.folder / "board.yaml", out],
                              env=environment, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        names = ("summary.yaml", "experiment.yaml", "final.h5", "geometry/initial_ply.obj", "geometry/final_ply.obj")
        files = {name: re.sub(rb"(?m)^(\w*seconds|.*memory).*$", b"", (out / name).read_bytes()) for name in names}
        shutil.rmtree(out)
        return done.stdout.split(), files

    def test_a_decimal_comma_changes_nothing(self):
        made = shutil.which("localedef") and subprocess.run(
            ["localedef", "-i", "de_DE", "-f", "UTF-8", "--no-archive", self.folder / NAME], capture_output=True).returncode == 0
        if not made:
            self.skipTest("no locale with a decimal comma can be made here")
        (comma, mean), files = self.run_in(NAME)
        (point, expected), of_c = self.run_in("C")
        self.assertEqual((comma, point), (",", "."))
        self.assertEqual(mean, expected)
        for name in files:
            self.assertEqual(files[name], of_c[name], name)


if __name__ == "__main__":
    unittest.main()
