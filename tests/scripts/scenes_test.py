#!/usr/bin/python3
"""The committed scenes are what scripts/make_scenes.py writes, and their meshes face the right way."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]


def read_obj(path):
    words = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([[float(x) for x in w[1:]] for w in words if w[0] == "v"])
    triangles = np.array([[int(i) - 1 for i in w[1:]] for w in words if w[0] == "f"])
    return vertices[triangles]


def area_vectors(corners):
    return 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


class ScenesTest(unittest.TestCase):
    def test_committed_files_are_the_generated_ones(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            subprocess.run([sys.executable, str(ROOT / "scripts/make_scenes.py"), str(folder)], check=True)
            generated = [p.relative_to(folder) for p in folder.rglob("*") if p.is_file()]
            self.assertTrue(generated)
            for path in generated:
                self.assertEqual((folder / path).read_bytes(), (ROOT / "scenes" / path).read_bytes(), path)

    def test_cube_is_closed_and_faces_outwards(self):
        corners = read_obj(ROOT / "scenes/cube/cube.obj")
        # Divergence theorem: the volume is positive only with outward faces, and right only without holes.
        volume = np.einsum("ij,ij->i", corners.mean(1), area_vectors(corners)).sum() / 3
        self.assertAlmostEqual(volume, 0.8**3, places=7)
        np.testing.assert_allclose(area_vectors(corners).sum(0), 0, atol=1e-8)

    def test_room_and_lamp_face_the_cube(self):
        for name, areas in (("room", {1: 8 * 5.6, 2: 8 * 3}), ("lamp", {1: -0.8 * 0.8})):
            total = area_vectors(read_obj(ROOT / f"scenes/cube/{name}.obj")).sum(0)
            expected = [areas.get(axis, 0) for axis in range(3)]
            np.testing.assert_allclose(total, expected, rtol=1e-9, atol=1e-9, err_msg=name)


if __name__ == "__main__":
    unittest.main()
