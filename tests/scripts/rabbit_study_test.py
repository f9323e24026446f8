#!/usr/bin/python3
"""The light-cone transform on surfaces whose place is known, errors of the rabbit itself, and the tables and pictures of the study."""

import pathlib
import shutil
import sys
import tempfile
import unittest
import unittest.mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import lengths
import light_cone
import matplotlib.image
import numpy as np
import plot_rabbit_study
import rabbit_errors
import rabbit_study
import shape_bound
import shape_study
import smoothing_study
import wrong_models
import yaml
from isochron.captures import Capture
from isochron.mesh_files import read_mesh
from reproduction.measure import Failure
from reproduction.tables import write_rows

BIN, BINS, REACH = 0.005, 400, 0.8


def capture(places, side=16, half=0.25, late=0.0):
    """Light of small diffuse surfaces, of equal area, seen by a confocal wall."""
    along = np.linspace(half, -half, side)
    points = np.stack([*np.meshgrid(-along, along, indexing="ij"), np.zeros((side, side))], axis=-1)
    counts = np.zeros((BINS, side, side))
    for place in places:
        distance = np.linalg.norm(points - place, axis=-1)
        at = (2 * distance + late) / BIN - 0.5  # between two bins' middles
        first = at.astype(int)
        for later, share in ((0, first + 1 - at), (1, at - first)):
            np.add.at(counts, (first + later, *np.indices((side, side))), share / distance**4)
    return Capture(counts, points, np.broadcast_to([0, 0, 1.0], points.shape), None, BIN, 0.0, None)


class LightConeTest(unittest.TestCase):
    def test_points_are_found(self):
        for place, late in (((0.05, -0.1, 0.4), 0), ((-0.15, 0.12, 0.55), 0.03)):
            volume, = light_cone.volumes(capture([place], late=late), late, REACH, [10])
            i, j, k = np.unravel_index(volume.albedo.argmax(), volume.albedo.shape)
            self.assertLess(abs(volume.across[i] - place[0]), 0.04)  # a little over the distance of points
            self.assertLess(abs(volume.up[j] - place[1]), 0.04)
            self.assertLess(abs(np.sqrt(volume.squares[k]) - place[2]), BIN)

    def test_a_plate_at_an_angle(self):
        x, y = (a.ravel() for a in np.meshgrid(np.linspace(-0.12, 0.12, 49), np.linspace(-0.12, 0.12, 49)))
        volume, = light_cone.volumes(capture(np.stack([x, y, 0.5 + 0.2 * x], axis=-1)), 0, REACH, [1])
        vertices, triangles = light_cone.surface(volume, 0.3)
        used = vertices[np.unique(triangles)]
        self.assertGreater(len(used), 20)
        self.assertLess(np.abs(used[:, :2]).max(), 0.12 + 0.04)
        inner = used[np.abs(used[:, :2]).max(axis=1) < 0.1]
        self.assertLess(np.abs(inner[:, 2] - 0.5 - 0.2 * inner[:, 0]).max(), 0.02)

    def test_counts_are_kept(self):
        light = capture([(0, 0, 0.3)])
        counts, step = light_cone.counts_over_squares(light, 0, REACH)
        self.assertEqual(counts.shape, (16, 16, light_cone.CELLS))
        np.testing.assert_allclose(counts.sum(axis=2), light.counts.sum(axis=0), rtol=1e-12)
        middles = step * (np.arange(light_cone.CELLS) + 0.5)
        distance = np.linalg.norm(light.points - [0, 0, 0.3], axis=-1)
        np.testing.assert_allclose(counts @ np.sqrt(middles) / counts.sum(axis=2), distance, atol=BIN)

    def test_kernel_is_a_paraboloid(self):
        values = light_cone.kernel((16, 16, 128), (0.05, 0.05), 0.005)
        self.assertAlmostEqual(float(np.linalg.norm(values)), 1, 5)
        for i, j in ((0, 0), (3, 0), (2, -4)):
            mean = values[i, j] @ np.arange(128) / values[i, j].sum()
            self.assertAlmostEqual(mean, (i * i + j * j + 1 / 6) * 0.0025 / 0.005, delta=0.01)  # 1/6: of a pixel's extent


class StudyTest(unittest.TestCase):
    def test_the_rabbit_has_no_errors(self):
        vertices, triangles = read_mesh(rabbit_errors.SCENE / "rabbit.obj")
        true = rabbit_errors.depths(vertices, triangles)
        self.assertEqual(rabbit_study.row_of((vertices, triangles), true, 2.0, "explained"), ("0", "0", "0", "0", "1", "2", "explained", ""))
        half = np.where(np.arange(len(true)) < len(true) / 2, true, np.nan)  # where the other method sees something
        moved = vertices + [0, 0, 0.004] * (vertices[:, :1] > 0)
        row = rabbit_study.row_of((moved, triangles), half, 2.0)
        self.assertEqual(row[1], "4")
        self.assertEqual((row[2], row[3]), ("0", "0"))
        self.assertEqual(rabbit_study.row_of(None, true, 1.0, "no_signal"), ("", "", "", "", "", "1", "no_signal", ""))

    def test_depths_are_covered_within_three_errors(self):
        """Of a plate that leans by 60 degrees, errors along its normal are half of those in depth."""
        lean = np.sqrt(3)
        text = ("ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
                "property double standard_error\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n")
        text += "".join(f"{x} {y} {0.5 + lean * x} 0.001\n" for x, y in ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)))
        lines = np.linspace(-0.12, 0.12, 25)
        true = np.tile(0.5 + lean * lines, (25, 1))
        with tempfile.TemporaryDirectory() as temporary:
            path = pathlib.Path(temporary) / "plate.ply"
            path.write_text(text + "3 0 2 1\n3 0 3 2\n", encoding="ascii")
            self.assertEqual(rabbit_errors.covered(path, true + 0.0059, lines), 1)
            self.assertEqual(rabbit_errors.covered(path, true - 0.0061, lines), 0)
            self.assertAlmostEqual(rabbit_errors.covered(path, np.where(lines < 0.001, true, true + 0.1), lines), 11 / 21, delta=0.05)

    def test_the_transform_settles_on_what_sees_most(self):
        surfaces = {(1, 0.1): (0.9, 9), (1, 0.2): (0.5, 1), (2, 0.1): (0.85, 5), (2, 0.2): (0.82, 7)}  # silhouette, 80 % error
        with unittest.mock.patch.multiple(rabbit_study, RATIOS=(1, 2), BRIGHTNESSES=(0.1, 0.2)), \
                unittest.mock.patch.multiple(light_cone, volumes=lambda *arguments: iter(arguments[3]),
                                             surface=lambda ratio, least: (ratio, least)), \
                unittest.mock.patch.object(rabbit_errors, "errors", lambda *key: dict(zip(("silhouette", "within_80_mm"), surfaces[key]))):
            self.assertEqual(rabbit_study.by_light_cone(None)[0], (2, 0.1))

    def test_fits(self):
        """With a stand-in for the program."""
        def program(*words):
            self.assertEqual(words[:2], ("reconstruct", "c.h5"))
            out = words[words.index("-o") + 1]
            self.assertFalse(out.exists())
            if verdict:
                (out / "geometry").mkdir(parents=True)
                (out / "summary.yaml").write_text(f"fit: {{verdict: {verdict}}}\n")
                shutil.copy(ROOT / "tests/data/field/meshes/bom.ply", out / "geometry/final_surface.ply")
            if verdict in (None, "no_signal"):
                raise Failure("status 1")

        with tempfile.TemporaryDirectory() as temporary, unittest.mock.patch.object(rabbit_study, "program", program), \
                unittest.mock.patch.object(rabbit_errors, "covered", lambda *arguments: 0.96):
            for verdict in ("explained", "no_signal", None):
                with self.subTest(verdict=verdict):
                    if verdict is None:
                        with self.assertRaises(Failure):
                            rabbit_study.by_fit("c.h5", 300, 1, pathlib.Path(temporary) / "run")
                        continue
                    found, said, covered = rabbit_study.by_fit("c.h5", 300, 1, pathlib.Path(temporary) / "run")
                    self.assertEqual((said, found is None), (verdict, verdict == "no_signal"))
                    self.assertEqual(covered, "0.960" if found else "")

    def test_pictures(self):
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(temporary)
            self.assertEqual(plot_rabbit_study.main([str(folder)]), 2)
            rows = [("back_projection", 2000, 64, "", 1, 2, 7, 2, 7, 0.7, 10, "", ""), ("light_cone", 2000, 64, "", 1, 2, 6, 2, 5, 0.7, 5, "", ""),
                    ("fit", 2000, 64, 30, 1, "", "", "", "", "", 5, "no_signal", ""),
                    *(("fit", 2000, 64, limit, seed, 1, 3 + seed, 1, 3, 0.9, limit + seed, verdict, covered) for limit, seed, verdict, covered in
                      ((60, 1, "explained", 0.95), (60, 2, "explained", 0.975), (60, 3, "unexplained", 0.96), (120, 1, "explained", 1)))]
            write_rows(folder / "rabbit_seconds.csv", rabbit_study.COLUMNS, rows)
            self.assertEqual(plot_rabbit_study.main([str(folder), str(folder / "a.png")]), 0)
            self.assertGreater(np.ptp(matplotlib.image.imread(folder / "a.png")[..., :3]), 0.9)
            fits = [row for row in plot_rabbit_study.read_rows(folder / "rabbit_seconds.csv") if row["method"] == "fit"]
            self.assertEqual(plot_rabbit_study.medians(fits, "seconds", "within_80_mm"), [[62, 121], [5, 4]])
            table = rabbit_study.table_of(plot_rabbit_study.read_rows(folder / "rabbit_seconds.csv"), "seconds").splitlines()
            self.assertEqual(table[2], "| 30 | 0 of 1 |  |  |  |  | 2 | 7 | 0.7 |")
            self.assertEqual(table[3], "| 60 | 2 of 3 | 1 | 4 to 6 | 0.9 | 95 to 97.5 % | 2 | 7 | 0.7 |")
            table = rabbit_study.table_of_verdicts(fits).splitlines()
            self.assertEqual(table[2:], ["| 2000 | 3 of 5 | 95 % | 1 | 4 to 6 | 0.9 |"])


class SmoothingTest(unittest.TestCase):
    def test_other_weights_begin_at_the_last_level(self):
        """With a stand-in for the program. The table compares the chosen weight with the best."""
        errors = {0.1: 3.0, 1: 2.4, 10: 2.0}

        def program(*words):
            self.assertEqual(words[:2], ("run", folder / "rabbit-20/levels/10/experiment.yaml"))
            weights.append(float(words[words.index("--set") + 1].removeprefix("parameters.shape.smoothing.variation=")))

        with tempfile.TemporaryDirectory() as name:
            folder, weights = pathlib.Path(name), []
            for level in ("9", "10"):
                (folder / "rabbit-20/levels" / level).mkdir(parents=True)
            (folder / "rabbit-20/geometry").mkdir()
            (folder / "rabbit-20/geometry/final_surface.ply").touch()
            (folder / "rabbit-20/levels/10/experiment.yaml").write_text("parameters: [{name: shape, smoothing: {variation: 0.5}}]\n", encoding="utf-8")
            with unittest.mock.patch.multiple(smoothing_study, program=program, FACTORS=tuple(errors), summary=lambda _: {"loss_final": 0.5},
                                              errors=lambda *_: (errors[weights[-1] / 0.5], 9.0, 0.9)):
                rows = list(smoothing_study.grid("rabbit", 20, folder))
        self.assertEqual(weights, [0.05, 0.5, 5])
        table = smoothing_study.table_of(dict(zip(smoothing_study.COLUMNS, map(str, row))) for row in rows)
        self.assertIn("| rabbit | 20 | 0.5 | 2.4 | 1.20 (10) | 9 | 1.00 (0.1) |", table)

    def test_the_truth_has_no_errors(self):
        with tempfile.TemporaryDirectory() as name:
            path = pathlib.Path(name) / "plates.obj"
            vertices, triangles = shape_study.together(shape_study.shapes()["plates"].parts)
            shape_study.mesh.write_obj(path, (vertices, triangles), "Part")
            self.assertEqual(np.round(smoothing_study.errors("plates", path), 6).tolist(), [0, 0, 1])
        self.assertEqual(smoothing_study.errors("rabbit", rabbit_errors.SCENE / "rabbit.obj"), (0, 0, 1))


class WrongModelsTest(unittest.TestCase):
    def test_responses_are_stretched_about_their_peak(self):
        offsets, values = np.loadtxt(wrong_models.RESPONSE, delimiter=",", skiprows=1).T
        peak = offsets[values.argmax()]
        with tempfile.TemporaryDirectory() as name:
            path = pathlib.Path(name) / "response.csv"
            wrong_models.response(1.2, -16, path)
            self.assertEqual(path.read_text().splitlines()[0], "offset,value")
            moved, same = np.loadtxt(path, delimiter=",", skiprows=1).T
        np.testing.assert_array_equal(same, values)
        np.testing.assert_allclose(moved + 16 - peak, 1.2 * (offsets - peak), atol=1e-6)

    def test_the_table_has_signs(self):
        row = dict(zip(wrong_models.COLUMNS, ("late", "3.1", "5.5", "2.9", "0.9", "1.01", "unexplained", "0.5")))
        self.assertIn("| late | 3.1 / 5.5 / +2.9 | 0.9 | unexplained | 50 % |", wrong_models.table_of([row]))


class ShapesTest(unittest.TestCase):
    def test_plates_are_turned_as_they_say(self):
        vertices, triangles = shape_study.plate((0.1, -0.02, 0.5), (0.2, 0.1), 20, 0)
        np.testing.assert_allclose(np.abs(vertices[:, 2] - 0.5), 0.1 * np.sin(np.radians(20)))
        np.testing.assert_allclose(vertices.mean(axis=0), (0.1, -0.02, 0.5))
        vertices, triangles = shape_study.plate((0, 0, 0.5), (0.2, 0.1), -10, 15)
        for a, b, c in vertices[triangles]:
            normal = np.cross(b - a, c - a)
            self.assertLess(normal[2], 0)  # towards the wall
            self.assertAlmostEqual(0.5 * np.linalg.norm(normal), 0.01)

    @lengths.long
    def test_all_are_seen_from_the_wall(self):
        for name, shape in shape_study.shapes().items():
            with self.subTest(name):
                depths = shape_study.seen(shape_study.together(shape.parts), shape)
                there = np.isfinite(depths)
                self.assertTrue(0.02 < there.mean() < 0.4)
                self.assertFalse(there[[0, -1]].any() or there[:, [0, -1]].any())
                self.assertGreater(np.nanmin(depths), 0.5 * shape.side)
                # Light comes back before the last bin ends.
                self.assertLess(2 * np.hypot(np.nanmax(depths), shape.side), shape.bin * shape.bins * 0.299792458e-3)

    def test_the_table_has_both_methods(self):
        rows = [dict(zip(shape_study.COLUMNS, ("plates", method, *numbers, verdict, "", "0.987"))) for method, numbers, verdict in
                (("back_projection", ("0.9", "2.2", "0.7", "4"), ""), ("fit", ("0.4", "1", "0.9", "213"), "explained"))]
        self.assertIn("| plates | 0.4 / 0.9 | 1 / 2.2 | 0.9 / 0.7 | 213 / 4 | explained | 98.7 % |", shape_study.table_of(rows))


class BoundTest(unittest.TestCase):
    def test_quantiles_are_those_of_normal_numbers(self):
        one = shape_bound.quantiles(np.full(10, 2.0))
        self.assertAlmostEqual(one["median_mm"], 2 * 0.67449, places=4)
        self.assertAlmostEqual(one["within_80_mm"], 2 * 1.28155, places=4)
        numbers = np.abs(np.random.default_rng(1).normal(0, np.tile([0.5, 3.0], 200_000)))
        mixed = shape_bound.quantiles(np.array([0.5, 3.0]))
        self.assertAlmostEqual(mixed["median_mm"], np.quantile(numbers, 0.5), delta=0.02)
        self.assertAlmostEqual(mixed["within_80_mm"], np.quantile(numbers, 0.8), delta=0.02)

    def test_normals_of_a_bent_sheet(self):
        found = shape_bound.normals(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1.0]]), np.array([[0, 1, 2], [1, 3, 2]]))
        np.testing.assert_allclose(found[0], [0, 0, 1])
        np.testing.assert_allclose(found[3], np.array([-1, -1, 1]) / np.sqrt(3))

    def test_the_fit_begins_at_the_truth_with_the_last_smoothing(self):
        """On a folder as reconstructions leave it."""
        truth = np.array([[0, 0, 0.4], [0.1, 0, 0.4], [0, 0.1, 0.4]]), np.array([[0, 2, 1]])
        with tempfile.TemporaryDirectory() as name:
            run, folder = pathlib.Path(name) / "run", pathlib.Path(name) / "bound"
            folder.mkdir()
            for level in ("2", "10"):
                (run / "levels" / level).mkdir(parents=True)
            surface = {"name": "surface", "type": "vertices", "shape": "surface", "smoothing": {"bending": 1, "evidence": True}}
            settings = {"scene": "scene.yaml", "target": {"capture": "capture.h5"}, "gates": {"response": "response.csv"},
                        "parameters": [surface | {"remesh": {"levels": 3}}, {"name": "albedo", "type": "albedo", "initial": 1}]}
            last = {"parameters": [surface | {"smoothing": {"bending": 7.5, "evidence": True}}, {"type": "albedo", "initial": [1, 2, 9]}]}
            for file, content in (("experiment.yaml", settings), ("levels/10/experiment.yaml", last), ("levels/2/experiment.yaml", {}),
                                  ("summary.yaml", {"levels": [{"edge_length": 0.03}, {"edge_length": 0.01}]}),
                                  ("scene.yaml", {"capture": {"file": "capture.h5"}, "shapes": [{"name": "surface", "file": "s.obj"}]})):
                (run / file).write_text(yaml.safe_dump(content), encoding="utf-8")
            with unittest.mock.patch.object(shape_bound, "program") as program:
                self.assertEqual(shape_bound.begun_at(truth, run, folder), folder / "fit")
            self.assertEqual(program.call_args.args[:2], ("run", folder / "experiment.yaml"))
            made = yaml.safe_load((folder / "experiment.yaml").read_text(encoding="utf-8"))
            first, albedo = made["parameters"]
            self.assertEqual(first["remesh"], {"levels": 1, "edge_length": 0.01})
            self.assertEqual(first["smoothing"], {"bending": 7.5})
            self.assertEqual(albedo["initial"], 2)
            self.assertEqual(made["gates"]["response"], str(run / "response.csv"))
            self.assertEqual(made["target"]["capture"], str(run / "capture.h5"))
            scene = yaml.safe_load((folder / "scene.yaml").read_text(encoding="utf-8"))
            np.testing.assert_allclose(read_mesh(folder / scene["shapes"][0]["file"])[0], truth[0])


if __name__ == "__main__":
    lengths.main()
