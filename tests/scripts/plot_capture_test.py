#!/usr/bin/python3
"""scripts/plot_capture.py on small runs of captures, and its parts against scenes whose answer is known."""

import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
sys.path[:0] = [str(SCRIPTS), str(SCRIPTS.parent / "app/python")]
from isochron import exr
import h5py
import matplotlib.image
import numpy as np
from isochron import plot_capture
from isochron.captures import write_capture
from isochron.pictures.back_projection import BackProjection
from isochron.pictures.capture_run import METRES_PER_PS, CaptureRun
from isochron.pictures.deviance import Fit
from isochron.pictures.wall import Plane, Wall
from in_process import run_main
from report_folders import write_ply
from seeds import generator

PS, START, BINS = 20, 2000, 120
LENGTHS = (START + PS * (np.arange(BINS) + 0.5)) * METRES_PER_PS
EXPERIMENT = """name: small
scene: inputs/scene/s.yaml
gates: {kind: bins, unit: ps, scene_unit_m: 1}
target: {capture: inputs/scene/s.h5}
parameters:
  - {name: z, type: translation, shape: the board, direction: [0, 0, 1], initial: 0}
  - {name: gain, type: gain, initial: 1}
  - {name: paint, type: albedo, per: vertex, shape: the board, initial: 0.5}
"""
SUMMARY = """status: iterations_reached
iterations: 3
parameters:
  z: 0.01
  gain: 1e-05
  paint: [0, 0.25, 0.5, 1e-05, 0.125, 1]
"""


def grid(columns=8, rows=6):
    """The importer's: columns along +x, rows along -y."""
    points = np.zeros((columns, rows, 3))
    points[..., 0] = np.linspace(-0.3, 0.3, columns)[:, np.newaxis]
    points[..., 1] = np.linspace(0.3, -0.3, rows)
    return points


def light_of(points, place, laser=None):
    """Expected counts [T, Sx, Sy] of one hidden point, above a background."""
    way = np.linalg.norm(points - place, axis=-1)
    way = way + (way if laser is None else np.linalg.norm(np.asarray(laser) - place))
    pulse = np.exp(-0.5 * ((LENGTHS[:, np.newaxis, np.newaxis] - way) / (1.5 * PS * METRES_PER_PS)) ** 2)
    return 2 + 30 * pulse


class PlotCaptureTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name) / "run"
        self.png = self.folder / "capture.png"
        self.points, self.place = grid(), np.array([0.1, -0.1, 0.5])
        self.write()

    def write(self, laser=None, bend=0.0):
        (self.folder / "geometry").mkdir(parents=True, exist_ok=True)
        (self.folder / "inputs" / "scene").mkdir(parents=True, exist_ok=True)
        (self.folder / "inputs" / "scene" / "s.yaml").write_text("capture: {file: s.h5}\n")
        (self.folder / "experiment.yaml").write_text(EXPERIMENT)
        (self.folder / "summary.yaml").write_text(SUMMARY)
        fit = light_of(self.points, self.place, laser)
        counts = generator(5).poisson(fit)
        write_capture(self.folder / "final.h5", fit, PS * METRES_PER_PS, START * METRES_PER_PS, self.points, (0, 0, 1),
                      laser, "isochron")
        self.write_target(counts)
        x, y = (a.ravel() for a in np.meshgrid([-0.2, 0, 0.2], [0.2, -0.2]))
        self.vertices = np.column_stack([x, y, 0.5 + 0.1 * x + bend * (x == 0)])
        self.triangles = [(0, 3, 1), (1, 3, 4), (1, 4, 2), (2, 4, 5)]
        write_ply(self.folder / "geometry" / "final_the_board.ply", self.vertices, self.triangles)
        return counts

    def write_target(self, counts):
        names = [f"gate{g:03d}.Y" for g in range(len(counts))]
        exr.write(self.folder / "target.exr", {n: layer.T for n, layer in zip(names, counts)})

    def edit(self, name, before, after):
        path = self.folder / name
        text = path.read_text()
        self.assertIn(before, text)
        path.write_text(text.replace(before, after))

    def run_script(self, *options):
        """Exit status and messages."""
        result = run_main(plot_capture.main, self.folder, *options)
        return result.returncode, result.stderr

    def assert_drawn(self, *options, png=None):
        self.assertEqual(self.run_script(*options), (0, ""))
        self.assert_picture(png)

    def assert_picture(self, png=None):
        picture = matplotlib.image.imread(png or self.png)
        self.assertGreater(min(picture.shape[:2]), 1000)
        self.assertGreater(np.ptp(picture[..., :3]), 0.9)
        (png or self.png).unlink()
        self.assertEqual(list(self.folder.glob("*.tmp")), [])

    def assert_fails(self, words, *options):
        status, messages = self.run_script(*options)
        self.assertEqual(status, 2, messages)
        self.assertRegex(messages, rf"\Aplot_capture\.py: .*{words}.*\n\Z")
        self.assertFalse(self.png.exists())

    def test_run(self):
        for script in ("plot_capture.py", "plot.py"):  # which draws it, too
            command = [sys.executable, SCRIPTS / script, self.folder]
            result = subprocess.run(command, capture_output=True, text=True, check=False)
            self.assertEqual((result.returncode, result.stdout, result.stderr), (0, "", ""))
            self.assert_picture()
        self.assertFalse((self.folder / "surface.png").exists())  # of reconstructions alone
        self.assert_drawn("-o", self.folder / "other.png", png=self.folder / "other.png")

    def test_bent_surface_mask_and_window(self):
        self.write(bend=0.05)
        np.save(self.folder / "mask.npy", np.arange(48).reshape(8, 6) % 5)
        self.edit("experiment.yaml", "s.h5}", "s.h5, mask: mask.npy, window: [0.8, 1.2]}")
        self.assert_drawn()
        run = CaptureRun(self.folder)
        self.assertEqual((run.used_points.sum(), run.used_bins.sum()), (38, np.sum(abs(LENGTHS - 1) <= 0.2)))
        self.assertEqual(Fit(run).readings, 38 * run.used_bins.sum())
        self.assertFalse(Plane(run.surfaces[0].points).flat)

    def test_without_paint_without_geometry_and_without_summary(self):
        self.edit("experiment.yaml", "  - {name: paint, type: albedo, per: vertex, shape: the board, initial: 0.5}\n", "")
        self.edit("summary.yaml", "  paint: [0, 0.25, 0.5, 1e-05, 0.125, 1]\n", "")
        self.assert_drawn()
        self.assertIsNone(CaptureRun(self.folder).surfaces[0].albedo)
        shutil.rmtree(self.folder / "geometry")
        (self.folder / "summary.yaml").unlink()
        self.assert_drawn()

    def test_values_are_those_of_the_summary_else_of_the_checkpoint(self):
        (self.folder / "checkpoint.yaml").write_text("parameters:\n  - {name: z, value: [0.5]}\n")
        run = CaptureRun(self.folder)
        self.assertEqual((run.values["z"][0], run.values["gain"][0], run.unknowns), (0.01, 1e-5, 8))
        np.testing.assert_array_equal(run.surfaces[0].albedo, [0, 0.25, 0.5, 1e-5, 0.125, 1])
        np.testing.assert_allclose(run.surfaces[0].points, self.vertices)
        np.testing.assert_array_equal(run.surfaces[0].triangles, self.triangles)
        (self.folder / "summary.yaml").unlink()
        self.assertEqual(CaptureRun(self.folder).values["z"][0], 0.5)

    def test_painted_shape_that_does_not_move(self):
        shutil.rmtree(self.folder / "geometry")
        self.edit("experiment.yaml", "  - {name: z, type: translation, shape: the board, direction: [0, 0, 1], initial: 0}\n",
                  "")
        # A vertex without a face, one twice: the program leaves out the first and welds the others.
        vertices = [(9, 9, 9), *self.vertices[:4], self.vertices[1], *self.vertices[4:]]
        faces = [(2, 5, 3), (6, 5, 7), (3, 7, 4), (4, 7, 8)]
        text = [f"v {p[0]} {p[1]} {p[2]}" for p in vertices] + [f"f {a} {b} {c}" for a, b, c in faces]
        (self.folder / "inputs" / "scene" / "b.obj").write_text("\n".join(text) + "\n")
        (self.folder / "inputs" / "scene" / "s.yaml").write_text(
            "capture: {file: s.h5}\nshapes:\n  - name: the board\n    file: b.obj\n"
            "    transform: {scale: 2, rotate: {axis: [0, 0, 3], degrees: 90}, translate: [0, 0, 1]}\n")
        surface = CaptureRun(self.folder).surfaces[0]
        turned = 2 * self.vertices @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + [0, 0, 1]
        np.testing.assert_allclose(surface.points, turned, atol=1e-12)
        np.testing.assert_array_equal(surface.triangles, self.triangles)
        self.assert_drawn()

    def test_several_spots(self):
        first = self.write(laser=(-0.2, 0.1, 0))
        spots = np.array([[[-0.2, 0.1, 0]], [[0.2, 0.1, 0]]])
        with h5py.File(self.folder / "final.h5", "r+") as file:
            light = file["H"][()]
            for name in ("H", "laser_grid_xyz", "laser_grid_normals"):
                del file[name]
            file["H"] = np.stack([light, 0 * light], axis=1)[:, :, np.newaxis]
            file["laser_grid_xyz"], file["laser_grid_normals"] = spots, np.broadcast_to([0.0, 0, 1], spots.shape)
        self.write_target(np.concatenate([first, 0 * first], axis=2))
        run = CaptureRun(self.folder)
        self.assertEqual((run.spots, run.confocal), (2, False))
        np.testing.assert_array_equal(run.counts, first)
        np.testing.assert_allclose(run.fit, light)
        self.assert_drawn()

    def test_one_point_and_a_scanning_laser(self):
        """The spots are what is shown, and the point is the spot."""
        looks, light = np.array([-0.2, 0.1, 0]), light_of(self.points, self.place, (-0.2, 0.1, 0))
        counts = generator(6).poisson(light)
        write_capture(self.folder / "final.h5", light.reshape(BINS, -1, 1, 1, 1), PS * METRES_PER_PS, START * METRES_PER_PS,
                      looks.reshape(1, 1, 3), (0, 0, 1), self.points.reshape(-1, 1, 3), "isochron")
        self.write_target(counts.reshape(BINS, 1, -1))
        run = CaptureRun(self.folder)
        self.assertEqual((run.spots, run.confocal), (1, False))
        np.testing.assert_array_equal(run.counts, counts.reshape(BINS, -1, 1))
        np.testing.assert_allclose(run.points, self.points.reshape(-1, 1, 3))
        np.testing.assert_allclose(run.laser[3, 0], looks)
        np.testing.assert_allclose(run.wall.high - run.wall.low, [0.6, 0.6])
        self.assert_drawn()

    def test_few_points_in_a_line(self):
        self.points = grid(3, 1)
        self.write()
        self.assert_drawn()

    def test_errors(self):
        self.edit("inputs/scene/s.yaml", "capture", "camera")
        self.assert_fails("not the run of a capture, its scene has no key `capture`")
        self.write()
        self.assert_fails("cannot be written: No such file", "-o", self.folder / "none" / "a.png")
        self.assert_fails("unrecognized arguments: --pixel; usage:", "--pixel")
        self.write_target(np.zeros((BINS - 1, 8, 6)))
        self.assert_fails("target.exr: not 120 gates of 8 x 6 readings")
        self.write()
        self.edit("summary.yaml", ", 0.125, 1]", "]")
        self.assert_fails("final_the_board.ply: 6 vertices, but 4 albedos in paint")
        (self.folder / "geometry" / "final_the_board.ply").write_bytes(b"ply\n")
        self.assert_fails("final_the_board.ply: is no PLY file")
        (self.folder / "final.h5").write_bytes(b"no HDF5")
        self.assert_fails("final.h5: cannot be read: ")
        (self.folder / "final.h5").unlink()
        self.assert_fails("the run has no final.h5: not finished")
        (self.folder / "experiment.yaml").write_text("a: [")
        self.assert_fails("experiment.yaml: cannot be read: ")
        (self.folder / "experiment.yaml").unlink()
        self.assert_fails("not the folder of a run, it has no experiment.yaml")
        shutil.rmtree(self.folder)
        self.assert_fails("run: no such folder")

    def test_deviance(self):
        fit = Fit(CaptureRun(self.folder))
        self.assertEqual((fit.readings, fit.dark), (BINS * 48, 0))
        # Counts are Poisson numbers of the fit: 5760 readings have a deviance with a standard deviation of 2 %.
        self.assertAlmostEqual(fit.ratio, 1, delta=0.08)
        self.write_target(np.full((BINS, 8, 6), 7.0))
        with h5py.File(self.folder / "final.h5", "r+") as file:
            light = np.full((BINS, 8, 6), 5.0)
            light[0, 0, 0] = 0
            file["H"][...] = light
        fit = Fit(CaptureRun(self.folder))
        self.assertEqual(fit.dark, 1)
        expected = 2 * (5 - 7 + 7 * np.log(7 / 5)) * fit.readings / (fit.readings - 8)
        self.assertAlmostEqual(fit.fitted, expected, places=9)

    def test_back_projection_finds_a_point(self):
        for laser, place in ((None, (0.1, -0.1, 0.5)), (None, (-0.15, 0.2, 0.4)), ((0.25, 0, 0), (0.1, -0.1, 0.5))):
            self.points, self.place = grid(20, 16), np.array(place)
            self.write(laser)
            found = BackProjection(CaptureRun(self.folder), np.array([-0.3, -0.3]), np.array([0.3, 0.3]), (0.38, 0.52))
            up, across = np.unravel_index(found.picture.argmax(), found.picture.shape)
            self.assertLess(np.hypot(found.across[across] - place[0], found.up[up] - place[1]), 0.03)

    def test_late_light(self):
        self.edit("experiment.yaml", "scene_unit_m: 1}",
                  "scene_unit_m: 1, response: {offsets: [0, 10, 50], values: [0, 1, 0]}}")
        self.edit("experiment.yaml", "{name: gain, type: gain, initial: 1}", "{name: gain, type: time_offset, initial: 1}")
        self.edit("summary.yaml", "gain: 1e-05", "gain: 30")
        self.assertAlmostEqual(CaptureRun(self.folder).delay, 40 * METRES_PER_PS)


class WallTest(unittest.TestCase):
    def test_who_looks_along_the_normal_of_the_importers_wall_has_x_to_the_left(self):
        wall = Wall(grid(), np.array([[0, 0, 1.0]]))
        self.assertEqual((wall.across.label, wall.across.inverted, wall.up.label, wall.up.inverted),
                         ("x (m)", True, "y (m)", False))
        np.testing.assert_allclose(wall.place(np.array([0.1, 0.2, 0.3])), [0.1, 0.2, 0.3])
        chosen = wall.spread_points(np.ones((8, 6), bool))
        self.assertEqual(chosen, [(5, 1), (2, 1), (5, 4), (2, 4)])  # upper left first; columns go to the right's left
        used = np.ones((8, 6), bool)
        used[5, 1] = False
        self.assertNotIn((5, 1), wall.spread_points(used))

    def test_a_wall_at_an_angle(self):
        turn = np.array([[0.8, 0, -0.6], [0, 1, 0], [0.6, 0, 0.8]])
        wall = Wall(grid() @ turn + [1, 2, 3], np.array([[0, 0, 1.0]]) @ turn)
        self.assertTrue(wall.across.label.startswith("to the right"))
        self.assertFalse(wall.across.inverted)
        # 0.1 m along the columns is to the left.
        place = wall.place(np.array([0.1, 0.2, 0.3]) @ turn + [1, 2, 3])
        np.testing.assert_allclose(place, [-0.1, 2.2, 0.3], atol=1e-12)
        places = generator(2).uniform(-1, 1, (5, 3))
        np.testing.assert_allclose(wall.place(wall.world(places)), places, atol=1e-12)

    def test_one_row_has_y_up_and_a_floor_x(self):
        self.assertEqual(Wall(grid(4, 1), np.array([[0, 0, 1.0]])).up.label, "y (m)")
        floor = Wall(grid(4, 1)[..., [0, 2, 1]], np.array([[0, 1.0, 0]]))
        self.assertEqual(floor.up.label, "x (m)")

    def test_planes(self):
        wall = Wall(grid(), np.array([[0, 0, 1.0]]))
        places = generator(1).uniform(-0.3, 0.3, (20, 3))
        places[:, 2] = 0.5 + 0.1 * (places[:, 0] - places[:, 0].mean()) - 0.2 * (places[:, 1] - places[:, 1].mean())
        plane = Plane(places)
        self.assertTrue(plane.flat)
        self.assertEqual(plane.describe(wall), ("0.5000 m from the wall", "tilts +5.71° along x, -11.31° along y"))
        places[0, 2] += 0.01
        self.assertFalse(Plane(places).flat)


if __name__ == "__main__":
    unittest.main()
