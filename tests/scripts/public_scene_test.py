#!/usr/bin/python3
"""scripts/public_scene.py in small: its rows, table and picture, and the errors that it makes of images.

usage: public_scene_test.py PROGRAM
"""

import contextlib
import io
import os
import pathlib
import re
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
os.environ["ISOCHRON_PROGRAM"] = sys.argv.pop(1)

import numpy as np
import public_scene
from reproduction.measure import Usage
from reproduction.tables import Usage as WrongUsage
from reproduction.tables import read_rows

SCENE = """<scene version="0.5.0">
  <integrator type="bdpt"> <integer name="maxDepth" value="3"/> </integrator>
  <sensor type="perspective"> <float name="fov" value="40"/>
    <transform name="toWorld"> <lookAt origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/> </transform>
    <film type="hdrfilm"> <integer name="width" value="8"/> <integer name="height" value="8"/>
      <float name="tstart" value="20"/> <float name="tresolution" value="2"/> <float name="tresolution_light" value="2"/>
      <integer name="duration" value="10"/> </film> </sensor>
  <shape type="rectangle" id="floor"> <transform name="toWorld"> <scale value="2"/> <rotate x="1" angle="-90"/> </transform>
    <bsdf type="diffuse"> <spectrum name="reflectance" value="0.7, 0.3, 0.2"/> </bsdf> </shape>
  <shape type="rectangle" id="lamp"> <transform name="toWorld"> <scale value="0.3"/> <rotate x="1" angle="90"/> <translate y="2"/> </transform>
    <bsdf type="diffuse"/> <emitter type="area"> <spectrum name="radiance" value="8"/> </emitter> </shape>
  <shape type="rectangle" id="shade"> <transform name="toWorld"> <scale value="0.2"/> <rotate x="1" angle="90"/> <translate y="1"/> </transform>
    <bsdf type="twosided"> <bsdf type="diffuse"/> </bsdf> </shape>
</scene>"""


class PublicSceneTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        self.file = self.folder / "in.xml"
        self.file.write_text(SCENE)

    def quietly(self, call, *arguments):
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            return call(*arguments)

    def test_measures_draws_and_prints(self):
        counts, public_scene.SAMPLES = public_scene.SAMPLES, {"image": (4, 64), "derivative": (64, 2048)}
        self.addCleanup(setattr, public_scene, "SAMPLES", counts)
        csv, png = self.folder / "a.csv", self.folder / "a.png"
        self.quietly(public_scene.measure, self.file, "lamp,shade", "0,1,0", csv, png)
        rows = read_rows(csv)
        self.assertEqual([(row["what"], row["samples"]) for row in rows],
                         [("image", "4"), ("image", "64"), ("derivative", "64"), ("derivative", "2048")])
        self.assertEqual({row["seeds"] for row in rows}, {str(public_scene.SEEDS)})
        for few, many in (rows[:2], rows[2:]):
            self.assertTrue(0 < float(many["pixel_error"]) < 0.5 * float(few["pixel_error"]), rows)
            self.assertTrue(0 < float(many["mean_error"]) < float(few["mean_error"]), rows)
        for row in rows:
            self.assertTrue(0 < float(row["cpu_seconds"]) and 1 < float(row["peak_mib"]) < 2048 and 0 < int(row["lit_frames"]) <= 10)
        self.assertTrue(png.read_bytes().startswith(b"\x89PNG"))
        lines = public_scene.table_of(rows).splitlines()
        self.assertEqual([line.split("|")[1:3] for line in lines[2:]], [
            [" images ", " 4 "], [" images ", " 64 "], [" derivative ", " 64 "], [" derivative ", " 2048 "]])
        self.assertEqual({line.count("|") for line in lines}, {lines[0].count("|")})

    def test_the_derivative_is_of_all_that_moves(self):
        both = ("lamp", "shade")
        experiment = self.quietly(public_scene.imported, self.file, both, [0, 1, 0], self.folder)
        _, total, parts = public_scene.derive(experiment, 4, 1, self.folder / "d", 2)
        each = [public_scene.stack(self.folder / f"d/move_{i}.exr", "total") for i in range(2)]
        self.assertTrue(all(part.any() for part in each))
        np.testing.assert_array_equal(total, each[0] + each[1])
        self.assertEqual((total.shape, len(parts), len(parts[0])), ((10, 8, 8, 1), 2, 10))

    def test_errors(self):
        """Known noise about a known image of 40 frames, of which 20 hold nearly no light."""
        rng = np.random.default_rng(1)
        image = rng.uniform(1, 2, (40, 16, 16, 1)) * np.where(np.arange(40) < 20, 1, 1e-3)[:, None, None, None]
        table = [{"mean": "2", "standard_error": "0.3"}] * 40
        found = public_scene.Noise()
        for seconds in (3, 2, 4):
            found.add(Usage(seconds, 2 * seconds, 10 * seconds), image + rng.normal(0, 0.1, image.shape), [table, table])
        what, samples, seeds, wall, cpu, mebibytes, lit, pixels, mean = found.row("image", 16, found)
        self.assertEqual((what, samples, seeds, wall, cpu, mebibytes), ("image", 16, 3, "2", "4", "40"))
        self.assertTrue(17 <= lit <= 19, lit)
        self.assertAlmostEqual(float(pixels), 0.1 / np.sqrt((image[:20] ** 2).mean()), delta=0.005)
        self.assertAlmostEqual(float(mean), 0.3 / np.sqrt(8), places=3)

    def test_memory_is_the_program_s_own(self):
        experiment = self.quietly(public_scene.imported, self.file, ["lamp"], [0, 1, 0], self.folder)
        ours = np.ones(1 << 26)  # 512 MiB
        usage = public_scene.program("render", experiment, "-o", self.folder / "r", "--samples", 2)
        self.assertTrue(1 < usage.peak_mib < ours.nbytes / 2**20, usage)

    def test_mistakes(self):
        experiment = self.quietly(public_scene.imported, self.file, ["nothing"], [0, 1, 0], self.folder)
        with self.assertRaisesRegex(public_scene.Failure, "nothing"):
            public_scene.program("derive", experiment, "-o", self.folder / "d")
        with self.assertRaises(WrongUsage):
            public_scene.measure(self.file, "lamp", "0,1", "a.csv", "a.png")
        self.file.write_text(re.sub('<[^<]*"(tstart|tresolution|tresolution_light|duration)"[^>]*>', "", SCENE))
        with self.assertRaisesRegex(SystemExit, "its film has no bins"):
            self.quietly(public_scene.measure, self.file, "lamp", "0,1,0", self.folder / "a.csv", self.folder / "a.png")


if __name__ == "__main__":
    unittest.main()
