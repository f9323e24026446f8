#!/usr/bin/python3
"""scripts/plot.py on folders such as the program leaves behind, whole or in part."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
sys.path.insert(0, str(SCRIPTS))
import exr
import matplotlib.image
import numpy as np

HEADER = "iteration,seconds,loss,image_rmse,param_rmse,gradient_norm,height\n"


def images(gates, channels="Y", component="", value=1.0):
    prefix = f"{component}." if component else ""
    names = [(g, f"{prefix}gate{g:03d}.{c}") for g in range(gates) for c in channels]
    return {name: np.full((6, 8), value * (g + 1)) for g, name in names}


class PlotTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def plot(self):
        command = [sys.executable, str(SCRIPTS / "plot.py"), str(self.folder)]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    def assert_drawn(self, *names):
        result = self.plot()
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual(sorted(p.name for p in self.folder.glob("*.png*")), sorted(names))

    def assert_fails(self, words):
        result = self.plot()
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, rf"\Aplot\.py: .*{words}.*\n\Z")

    def test_whole_run(self):
        for name in ("target", "initial", "final"):
            exr.write(self.folder / f"{name}.exr", images(4))
        components = {**images(4, component="interior"), **images(4, component="visibility", value=-1.0)}
        exr.write(self.folder / "height.exr", components)
        experiment = "name: cube\ngates: {kind: gaussian, centers: [5, 6, 7, 8]}\n"
        (self.folder / "experiment.yaml").write_text(experiment)
        (self.folder / "log.csv").write_text(HEADER + "0,0.5,1,1,0.3,2,0.3\n1,1.0,0.5,0.7,0.2,1,0.2\n")
        self.assert_drawn("target.png", "initial.png", "final.png", "height.png", "rmse.png")

    def test_many_gates_and_colours(self):
        exr.write(self.folder / "render.exr", images(64, "RGB"))
        self.assert_drawn("render.png")

    def test_black_and_not_finite_pixels(self):
        exr.write(self.folder / "black.exr", images(2, value=0.0))
        broken = images(2)
        broken["gate000.Y"][0, 0], broken["gate001.Y"][1, 1] = np.nan, np.inf
        exr.write(self.folder / "broken.exr", broken)
        self.assert_drawn("black.png", "broken.png")

    def test_sign_shows_in_the_colour(self):
        for name, value in (("plus", 1.0), ("minus", -1.0)):
            exr.write(self.folder / f"{name}.exr", images(1, component="total", value=value))
        self.assert_drawn("plus.png", "minus.png")
        plus, minus = (matplotlib.image.imread(self.folder / f"{n}.png") for n in ("plus", "minus"))
        centre = np.array(plus.shape[:2]) // 3  # within the only image
        self.assertGreater(plus[tuple(centre)][0], 2 * plus[tuple(centre)][2])
        self.assertGreater(minus[tuple(centre)][2], 2 * minus[tuple(centre)][0])

    def test_log_alone(self):
        # No target known, so no param_rmse; the last line is still being written.
        (self.folder / "log.csv").write_text(HEADER + "0,0.5,1,1,,2,0.3\n1,1.0,0.5,0.7,,1,0.2\n2,1.5,0.")
        self.assert_drawn("rmse.png")
        (self.folder / "rmse.png").unlink()
        (self.folder / "log.csv").write_text(HEADER)
        self.assert_drawn()

    def test_failures_are_one_line(self):
        self.assert_fails("neither")
        (self.folder / "bad.exr").write_bytes(b"nothing")
        exr.write(self.folder / "good.exr", images(1))
        self.assert_fails("bad.exr: not an OpenEXR file")
        self.assertTrue((self.folder / "good.png").exists())


if __name__ == "__main__":
    unittest.main()
