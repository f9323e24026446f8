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


def read_triangles(path):
    """Vertex indices of the faces, as in the file."""
    lines = path.read_text().splitlines()
    return np.array([[int(i) - 1 for i in line.split()[1:]] for line in lines if line.startswith("f ")])


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

    def test_bunny_and_tree_are_closed_manifolds_facing_outwards_without_slivers(self):
        # name, number of closed parts, volume between, flattest triangle's height over its longest edge
        for name, parts, (least, most), flattest in (("bunny", 1, (0.25, 0.45), 0.2), ("tree", 8, (0.4, 1), 0.025)):
            with self.subTest(name):
                path = ROOT / f"scenes/{name}/{name}.obj"
                triangles, corners = read_triangles(path), read_obj(path)
                edges = [(t[k], t[(k + 1) % 3]) for t in triangles.tolist() for k in range(3)]
                self.assertEqual(len(edges), len(set(edges)), "an edge of more than two faces, or windings differ")
                self.assertEqual(set(edges), {(b, a) for a, b in edges}, "an open edge")
                # Euler: every part is a sphere.
                vertices = len(np.unique(triangles))
                self.assertEqual(vertices - len(edges) // 2 + len(triangles), 2 * parts)
                volume = np.einsum("ij,ij->i", corners.mean(1), area_vectors(corners)).sum() / 3
                self.assertTrue(least < volume < most, volume)
                longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(1)
                heights = 2 * np.linalg.norm(area_vectors(corners), axis=1) / longest
                self.assertGreater((heights / longest).min(), flattest)

    def test_nothing_touches_in_the_box_of_the_bunny(self):
        bunny = read_obj(ROOT / "scenes/bunny/bunny.obj").reshape(-1, 3)
        lamp = read_obj(ROOT / "scenes/bunny/lamp.obj").reshape(-1, 3)
        self.assertTrue((bunny.min(0) > (-0.99, 0.05, -0.99)).all() and (bunny.max(0) < (0.99, 1.9, 0.99)).all())
        self.assertTrue((lamp[:, 1] > bunny[:, 1].max()).all() and (lamp[:, 1] < 2).all())

    def test_room_and_lamp_face_the_cube(self):
        for name, areas in (("room", {1: 8 * 5.6, 2: 8 * 3}), ("lamp", {1: -0.8 * 0.8})):
            total = area_vectors(read_obj(ROOT / f"scenes/cube/{name}.obj")).sum(0)
            expected = [areas.get(axis, 0) for axis in range(3)]
            np.testing.assert_allclose(total, expected, rtol=1e-9, atol=1e-9, err_msg=name)

    def test_branches_face_outwards(self):
        corners = read_obj(ROOT / "scenes/branches/branches.obj")
        self.assertEqual(len(corners), 7 * 12)
        np.testing.assert_allclose(area_vectors(corners).sum(0), 0, atol=1e-4)
        for bar in corners.reshape(7, 12, 3, 3):  # closed and convex: every face looks away from the middle
            outwards = bar.mean(1) - bar.mean((0, 1))
            self.assertTrue((np.einsum("ij,ij->i", outwards, area_vectors(bar)) > 0).all())

    def test_corridor_faces_inwards_and_is_open_at_one_end(self):
        corners = read_obj(ROOT / "scenes/corridor/corridor.obj")
        # Closed but for the opening, a unit square in the plane z = 0, which adds nothing to the flux of position.
        volume = -np.einsum("ij,ij->i", corners.mean(1), area_vectors(corners)).sum() / 3
        self.assertAlmostEqual(volume, 1.75 + 1.25, places=9)
        np.testing.assert_allclose(area_vectors(corners).sum(0), [0, 0, 1], atol=1e-9)
        end = corners.reshape(-1, 3)[corners.reshape(-1, 3)[:, 0] > 1.7]
        self.assertEqual(len(np.unique(end, axis=0)), 4)

    def test_height_field_and_sofa_face_the_light(self):
        for scene, mesh, towards, area in (("height_field", "terrain", (0, 1, 0), 4),
                                           ("sofa", "sofa", (-0.76604444, 0.64278761, 0), 2.88)):
            corners = read_obj(ROOT / f"scenes/{scene}/{mesh}.obj")
            facing = area_vectors(corners) @ towards
            self.assertTrue((facing > 0).all(), scene)
            self.assertAlmostEqual(facing.sum(), area, places=4)

    def test_lamps_shine_at_what_they_light(self):
        for scene, target in (("branches", (1, 0, 0)), ("corridor", (-0.5, 0.5, -1.25)), ("height_field", (0, 0, 0)),
                              ("sofa", (0.75, 0.7, 0))):
            corners = read_obj(ROOT / f"scenes/{scene}/lamp.obj")
            towards = target - corners.mean((0, 1))
            area = area_vectors(corners).sum(0)
            np.testing.assert_allclose(area / np.linalg.norm(area), towards / np.linalg.norm(towards), atol=1e-3)


if __name__ == "__main__":
    unittest.main()
