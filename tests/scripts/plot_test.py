#!/usr/bin/python3
"""scripts/plot.py on folders such as the program leaves behind, whole or in part."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
sys.path[:0] = [str(SCRIPTS), str(SCRIPTS.parent / "app/python")]
from isochron import exr, plot
import matplotlib.image
import numpy as np
from in_process import run_main
from isochron.pictures import curves, reading, scales, sheets

HEADER = "iteration,seconds,loss,image_rmse,param_rmse,gradient_norm,height\n"
NOTES = {"isochron.gateCenters": "12 12.5 13 14", "isochron.gateUnit": "ns", "isochron.quantity": "radiance"}


def images(gates, channels="Y", component="", value=1.0):
    prefix = f"{component}." if component else ""
    names = [(g, f"{prefix}gate{g:03d}.{c}") for g in range(gates) for c in channels]
    return {name: np.full((6, 8), value * (g + 1)) for g, name in names}


class PlotTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def plot(self, *options):
        """In this process; test_failures_are_one_line starts one."""
        return run_main(plot.main, self.folder, *options)

    def assert_drawn(self, *names, options=()):
        result = self.plot(*options)
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
        self.assert_drawn("target.png", "initial.png", "final.png", "residual.png", "height.png", "rmse.png")

    def test_many_gates_and_colours(self):
        exr.write(self.folder / "render.exr", images(64, "RGB"))
        self.assert_drawn("render.png")

    def test_a_thousand_gates_make_a_picture_of_bounded_size(self):
        stack = images(1200)
        for g in list(range(500)) + list(range(900, 1200)):
            stack[f"gate{g:03d}.Y"] = np.zeros((6, 8))
        exr.write(self.folder / "render.exr", stack)
        exr.write(self.folder / "height.exr", images(1200, component="total"))
        self.assert_drawn("render.png", "height.png")
        for name in ("render", "height"):
            height, width = matplotlib.image.imread(self.folder / f"{name}.png").shape[:2]
            self.assertLess(max(height, width), 2000)
        self.assertEqual(sheets.pick_gates(5, np.ones((1200, 2, 2)) * (np.arange(1200) // 500 == 1)[:, None, None]),
                         [500, 625, 750, 874, 999])

    def test_of_very_many_gates_those_are_read_that_are_shown(self):
        # Gates that are not named as bright are damaged: pictures that read them would say so.
        stack = images(300)
        lit = range(100, 201)
        for g in set(range(300)) - set(lit):
            stack[f"gate{g:03d}.Y"] = np.full((6, 8), np.nan)
        largest = " ".join(str(g + 1.0 if g in lit else 1e-9) for g in range(300))
        exr.write(self.folder / "render.exr", stack, {"isochron.peaks": largest})
        self.assert_drawn("render.png")
        found = reading.peaks(self.folder / "render.exr")
        chosen = scales.pick_by_peaks(5, *found.values())
        self.assertEqual(chosen, [100, 125, 150, 175, 200])
        read = reading.read_stack(self.folder / "render.exr", chosen)[""]
        self.assertEqual([read[g, 0, 0] for g in (*chosen, 0, 101)], [g + 1 for g in chosen] + [0, 0])
        self.assertIsNone(scales.pick_by_peaks(300, *found.values()))
        self.assertEqual(scales.pick_by_peaks(3, np.zeros(9)), [0, 4, 8])
        self.assertEqual(scales.pick_gates(2, None, among=chosen), [100, 200])

    def test_rows_of_zero_terms_are_not_drawn(self):
        stack = {**images(2, component="total"), **images(2, component="interior"), **images(2, component="visibility")}
        exr.write(self.folder / "all.exr", stack)
        exr.write(self.folder / "zero.exr", {**stack, **images(2, component="visibility", value=0)})
        self.assert_drawn("all.png", "zero.png")
        rows = [matplotlib.image.imread(self.folder / f"{n}.png").shape[0] for n in ("all", "zero")]
        self.assertGreater(rows[0], rows[1] + 100)

    def test_gates_name_themselves(self):
        exr.write(self.folder / "render.exr", images(4), NOTES)
        folder = reading.Folder(self.folder)
        gates = folder.gates(self.folder / "render.exr", 4)
        self.assertEqual([gates.label(g) for g in range(4)], ["12", "12.5", "13", "14"])
        self.assertEqual((gates.axis, gates.quantity), ("travel time (ns)", "radiance"))
        self.assertEqual(folder.gates(self.folder / "render.exr", 3).label(1), "gate 1")

    def test_pixel_and_row(self):
        exr.write(self.folder / "render.exr", images(4), NOTES)
        exr.write(self.folder / "height.exr", images(4, component="total"), NOTES)
        self.assert_drawn("render_pixel_7_5.png", "height_pixel_7_5.png", "render_row_5.png", "height_row_5.png",
                          options=("--pixel", "7,5", "--row", "5"))
        result = self.plot("--pixel", "8,5")
        self.assertEqual(result.returncode, 1)
        self.assertIn("there is no column 8 (0 to 7)", result.stderr)
        self.assertEqual(self.plot("--pixel", "one").returncode, 2)

    def test_errors_of_each_parameter(self):
        header = HEADER.strip() + ",power,height.rmse,power.rmse,height.gradient,power.gradient\n"
        rows = "0,0.5,1,1,0.3,2,0.3,800,0.3,200,1,1\n1,1,0.5,0.7,0.2,1,0.2,900,0.15,100,1,1\n"
        (self.folder / "log.csv").write_text(header + rows)
        curves_of = curves.parameter_curves(reading.read_log(self.folder / "log.csv"))
        self.assertEqual([c[0] for c in curves_of], ["height: 0.3 to 0.15", "power: 200 to 100"])
        for _, values in curves_of:
            np.testing.assert_allclose(values, [1, 0.5])
        self.assert_drawn("rmse.png")

    def test_gaps_in_the_error_of_the_images_are_explained(self):
        rows = "".join(f"{i},1,{e},{max(e, 0)},0.3,2,0.3\n" for i, e in enumerate((1, 0.5, -0.1, 0.2, -0.2)))
        (self.folder / "log.csv").write_text(HEADER + rows)
        image = reading.read_log(self.folder / "log.csv")["image_rmse"]
        self.assertEqual(curves.gap_note(image), "gaps (2 of 5 rows): squared error, unbiased, estimated below 0")
        self.assertEqual(curves.gap_note(image[:2]), "")
        self.assert_drawn("rmse.png")

    def test_black_and_not_finite_pixels(self):
        exr.write(self.folder / "black.exr", images(2, value=0.0))
        broken = images(2)
        broken["gate000.Y"][0, 0], broken["gate001.Y"][1, 1] = np.nan, np.inf
        exr.write(self.folder / "broken.exr", broken)
        self.assert_drawn("black.png", "broken.png")

    def test_dim_gates_are_brighter_and_say_so(self):
        levels = (1.0, 0.5, 0.09, 0.002, 0.0)
        self.assertEqual([sheets.brightening(np.full((4, 5), level), 1.0) for level in levels], [1, 1, 10, 100, 1])
        for channels in ((), (3,)):
            stack = np.stack([np.full((4, 5, *channels), level) for level in levels])
            figure = sheets.draw_images("dim", stack, 1.0, reading.Gates(5, [1.0, 2.0, 3.0, 4.0, 5.0], "ns", "radiance"))
            self.assertEqual([axes.get_title() for axes in figure.axes[:5]], ["1", "2", "3, × 10", "4, × 100", "5"])
            shown = [np.ravel(axes.images[0].get_array())[0] for axes in figure.axes[:5]]
            expected = np.array([1, 0.5, 0.9, 0.2, 0])
            np.testing.assert_allclose(shown, scales.srgb(expected) if channels else expected)

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
        command = [sys.executable, SCRIPTS / "plot.py", self.folder]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"\Aplot\.py: .*neither.*\n\Z")
        (self.folder / "bad.exr").write_bytes(b"nothing")
        exr.write(self.folder / "good.exr", images(1))
        self.assert_fails("bad.exr: not an OpenEXR file")
        self.assertTrue((self.folder / "good.png").exists())


if __name__ == "__main__":
    unittest.main()
