#!/usr/bin/python3
"""isochron.back_project and isochron.reconstruct: hidden patches of which the counts are known in closed form, confocal and from spots, by file and by arrays.

usage: back_projection_test.py FOLDER     of the package with its extension
"""

import pathlib
import sys
import tempfile
import unittest

import numpy as np
from seeds import generator

sys.path.insert(0, sys.argv.pop(1))

import isochron
from isochron.captures import Capture

HIDDEN = np.array([0.07, -0.05, 0.42])
BIN, BINS = 0.01, 160
DELAY_PS = 200


def wall(count):
    """[Sx, Sy, xyz]: Sy is shorter, so that axes that are mixed up show."""
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, count), np.linspace(0.25, -0.25, count - 4), indexing="ij")
    return np.stack([x, y, np.zeros_like(x)], axis=-1)


def capture(spots=None, delay=0.0):
    points = wall(16)
    back = np.linalg.norm(HIDDEN - points, axis=-1)
    there = back[np.newaxis] if spots is None else np.linalg.norm(HIDDEN - np.array(spots), axis=-1)[:, np.newaxis, np.newaxis]
    bins = ((there + back + delay) / BIN).astype(int)
    means = 0.2 + 400 * HIDDEN[2] ** 4 / (there * back) ** 2 * (bins == np.arange(BINS).reshape(-1, 1, 1, 1))
    counts = generator(3).poisson(means)
    laser = None if spots is None else np.array(spots).reshape(-1, 1, 3)
    counts = counts[:, 0] if len(there) == 1 else counts[:, :, np.newaxis]
    return Capture(counts=counts, points=points, normals=np.array([0.0, 0, 1]), laser=laser, delta_t=BIN, t_start=0.0, origins=None)


class BackProjectionTest(unittest.TestCase):
    def check(self, found):
        brightest = np.unravel_index(found.albedo.argmax(), found.albedo.shape)
        depth, up, across = (axis[i] for axis, i in zip((found.depth, found.up, found.across), brightest))
        off = found.to_capture([across, up, depth]) - HIDDEN
        self.assertLess(np.abs(off[:2]).max(), 0.5 * found.lateral_resolution)
        self.assertLess(abs(off[2]), 0.5 * found.depth_resolution + 0.25 * BIN)
        self.assertTrue(found.surface[brightest])
        self.assertAlmostEqual(found.depth_map[brightest[1:]], HIDDEN[2], delta=0.25 * BIN)
        self.assertLess(np.linalg.norm(found.vertices.mean(axis=0) - HIDDEN), found.lateral_resolution)
        self.assertEqual(len(found.vertex_albedo), len(found.vertices))
        self.assertLess(found.triangles.max(), len(found.vertices))
        a, b, c = (found.vertices[found.triangles[:, k]] for k in range(3))
        self.assertTrue((np.cross(b - a, c - a)[:, 2] < 0).all(), "not counter-clockwise seen from the wall")

    def test_confocal(self):
        self.check(isochron.back_project(capture()))

    def test_one_spot_and_several(self):
        self.check(isochron.back_project(capture([[0.1, 0.1, 0]])))
        self.check(isochron.back_project(capture([[0.1, 0.1, 0], [-0.2, 0, 0]])))

    def test_response_by_arrays_and_by_file(self):
        late = capture(delay=DELAY_PS * 0.299792458e-3)
        offsets, values = np.array([0, 190, 200, 210]), np.array([0, 0, 1, 0])
        self.check(isochron.back_project(late, (offsets, values)))
        self.check(isochron.back_project(late, (offsets / 1000, values), unit="ns"))
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "response.csv"
            file.write_text("offset,value\n" + "".join(f"{o},{v}\n" for o, v in zip(offsets, values)), encoding="ascii")
            self.check(isochron.back_project(late, file))

    def test_files(self):
        some = capture()
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "capture.h5"
            isochron.write_capture(file, some.counts, BIN, 0, some.points, [0, 0, 1])
            found = isochron.back_project(file)
        self.check(found)
        np.testing.assert_array_equal(found.albedo, isochron.back_project(some).albedo)

    def test_dead_points(self):
        some = capture()
        used = np.ones(some.points.shape[:2])
        used[3, 5] = used[12, 2] = 0
        some.counts[40, used == 0] = 100000
        self.check(isochron.back_project(some, used=used))

    def test_nothing(self):
        dark = capture()
        dark.counts[:] = 0
        found = isochron.back_project(dark)
        self.assertEqual((found.albedo.shape, found.depth_map.shape, found.vertices.shape), ((0, 0, 0), (0, 0), (0, 3)))

    def test_reconstructions(self):
        """Of arrays and of files: the same run, at the place of the patch."""
        some = capture(delay=DELAY_PS * 0.299792458e-3)
        response = np.array([0, 190, 200, 210]), np.array([0, 0, 1, 0])
        rows = []
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(temporary)
            run = isochron.reconstruct(some, response, 0.5, rows.append, folder=folder / "arrays")
            isochron.write_capture(folder / "counts.h5", some.counts, BIN, 0, some.points, [0, 0, 1])
            np.savetxt(folder / "response.csv", np.transpose(response), delimiter=",", header="offset,value", comments="")
            again = isochron.reconstruct(folder / "counts.h5", folder / "response.csv", 0.5, folder=folder / "files")
            vertices, triangles = run.meshes()["surface"]
            for mine, other in zip((vertices, triangles), again.meshes()["surface"]):
                np.testing.assert_array_equal(mine, other)
            with self.assertRaisesRegex(isochron.InputError, "no light"):
                some.counts[:] = 0
                isochron.reconstruct(some, folder=folder / "dark")
            self.assertIn("no_signal", (folder / "dark/summary.yaml").read_text(encoding="ascii"))
        self.assertLess(np.abs(vertices.mean(axis=0) - HIDDEN).max(), 0.02)
        self.assertGreater(len(rows), 3)
        self.assertEqual(run.summary["start"]["method"], "back_projection")

    def test_mistakes(self):
        some = capture()
        for arguments, what in (({"used": [1, 0]}, "mask"), ({"false_alarms": 2}, "false alarm"), ({"response": "no.csv"}, "no.csv"),
                                ({"response": ([0, 1], [1, 1]), "unit": "mm"}, "mm"), ({"response": ([1, 0], [1, 1])}, "offset")):
            with self.subTest(what), self.assertRaisesRegex(isochron.InputError, what):
                isochron.back_project(some, **arguments)
        some.counts = some.counts[:, :3]
        with self.assertRaisesRegex(isochron.InputError, "do not fit"):
            isochron.back_project(some)


if __name__ == "__main__":
    unittest.main()
