#!/usr/bin/python3
"""What the program renders of scenes that scripts/import_scene.py turned, against sums of our own over lamps, walls and
hidden surfaces. Seeds are fixed; the tolerances are several times the errors of sums and images.

usage: import_scene_rendering_test.py PROGRAM
"""

import re
import unittest

import h5py
import numpy as np
from import_scene_test import ImportSceneTest, scene


class Patch:
    """A rectangle: its middle, half its sides, its normal and what it reflects."""

    def __init__(self, middle, a, b, albedo):
        self.middle, self.a, self.b, self.albedo = (np.array(x, float) for x in (middle, a, b, albedo))
        cross = np.cross(self.a, self.b)
        self.area, self.normal = 4 * np.linalg.norm(cross), cross / np.linalg.norm(cross)

    def points(self, n):
        """The middles of n x n equal parts."""
        s, t = np.meshgrid(*[(2 * np.arange(n) + 1) / n - 1] * 2)
        return self.middle + s.reshape(-1, 1) * self.a + t.reshape(-1, 1) * self.b

    def distances(self, origin, directions):
        t = (self.middle - origin) @ self.normal / (directions @ self.normal)
        at = origin + t[:, None] * directions - self.middle
        inside = (np.abs(at @ self.a) <= self.a @ self.a) & (np.abs(at @ self.b) <= self.b @ self.b)
        return np.where(inside & (t > 0) & (directions @ self.normal < 0), t, np.inf)


def between(x, normal_x, y, normal_y):
    """cos cos / r^2 from each of x to each of y, and r."""
    away = y[None] - x[:, None]
    r = np.linalg.norm(away, axis=2)
    return np.maximum(away @ normal_x, 0) * np.maximum(-(away @ normal_y), 0) / r**4, r


def histogram(lengths, weights, gates):
    start, width, count = gates
    return np.histogram(lengths, count, (start, start + count * width), weights=weights)[0] / width


BOX = scene("""<default name="depth" value="3"/>
  <integrator type="transient_path"> <integer name="max_depth" value="$depth"/> </integrator>
  <sensor type="perspective"> <string name="fov_axis" value="y"/> <float name="fov" value="40"/>
    <transform name="to_world"> <lookat origin="0.4, 1, 3.2" target="0, 0.6, -0.2" up="0.1, 1, 0"/> </transform>
    <film type="transient_hdr_film"> <integer name="width" value="6"/> <integer name="height" value="4"/>
      <rfilter type="box"/> <integer name="temporal_bins" value="14"/> <float name="start_opl" value="3"/>
      <float name="bin_width_opl" value="0.5"/> </film>
  </sensor>""", """<shape type="rectangle" id="floor">
    <bsdf type="diffuse"> <rgb name="reflectance" value="0.8 0.4 0.2"/> </bsdf> <transform name="to_world">
    <rotate x="1" angle="-90"/> <scale x="1.2" z="0.8"/> <translate z="0.1"/> </transform> </shape>
  <shape type="rectangle" id="wall"> <bsdf type="diffuse"> <rgb name="reflectance" value="0.3 0.5 0.9"/> </bsdf>
    <transform name="to_world"> <scale x="1.2" y="0.55"/> <translate y="0.75" z="-1"/> </transform> </shape>
  <shape type="rectangle" id="lamp"> <bsdf type="diffuse"> <float name="reflectance" value="0"/> </bsdf>
    <transform name="to_world"> <translate x="-2" z="-1.5"/> <rotate x="1" angle="90"/> <scale x="0.3" z="0.2"/> </transform>
    <emitter type="area"> <rgb name="radiance" value="10 20 5"/> </emitter> </shape>""")

WALL = """<default name="type" value="single"/>
  <integrator type="transient_nlos_path"> <boolean name="account_first_and_last_bounces" value="true"/>
    <boolean name="nlos_hidden_geometry_sampling" value="true"/> <string name="capture_type" value="$type"/>
    <integer name="filter_bounces" value="3"/> </integrator>
  <emitter type="projector"> <float name="irradiance" value="5"/>
    <transform name="to_world"> <lookat origin="1, 0.3, 0.5" target="-0.5, 0.1, 0.2" up="0,1,0"/> </transform> </emitter>
  <shape type="rectangle" id="relay"> <bsdf type="diffuse"> <float name="reflectance" value="0.7"/> </bsdf>
    <transform name="to_world"> <scale x="0.6" y="0.4"/> <rotate y="1" angle="90"/> <translate x="-0.5"/> </transform>
    <sensor type="nlos_capture_meter"> <point name="sensor_origin" x="0.8" y="0.1" z="-0.4"/>
      <film type="transient_hdr_film"> <integer name="width" value="3"/> <integer name="height" value="2"/>
        <integer name="temporal_bins" value="16"/> <float name="start_opl" value="4"/>
        <float name="bin_width_opl" value="0.1"/> </film>
    </sensor> </shape>"""
HIDDEN = """<shape type="rectangle" id="hidden"> <bsdf type="diffuse"> <float name="reflectance" value="0.6"/> </bsdf>
    <transform name="to_world"> <scale x="0.3" y="0.25"/> <rotate y="1" angle="-90"/> <translate value="0.4 0.1 -0.1"/>
    </transform> </shape>"""


class RenderingTest(ImportSceneTest):
    def test_a_box_through_two_bounces(self):
        """Light of one bounce and of two, gate by gate, and each pixel over all gates."""
        gates, lamp_radiance = (3, 0.5, 14), np.array((10, 20, 5))
        floor = Patch((0, 0, 0.1), (1.2, 0, 0), (0, 0, -0.8), (0.8, 0.4, 0.2))
        wall = Patch((0, 0.75, -1), (1.2, 0, 0), (0, 0.55, 0), (0.3, 0.5, 0.9))
        lamp = Patch((-0.6, 1.5, 0), (0.3, 0, 0), (0, 0, 0.2), (0, 0, 0))
        eye = np.array((0.4, 1, 3.2))
        forward = np.array((0, 0.6, -0.2)) - eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, (0.1, 1, 0))
        right /= np.linalg.norm(right)
        sums = np.zeros((3, 4, 6, 14, 3))  # by bounces

        def rays_of(row, column, n):
            x, y = np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2)
            x, y = (2 * (column + x.reshape(-1, 1)) / 6 - 1) * 1.5, 1 - 2 * (row + y.reshape(-1, 1)) / 4
            rays = forward + np.tan(np.radians(20)) * (x * right + y * np.cross(right, forward))
            return rays / np.linalg.norm(rays, axis=1, keepdims=True)

        for row, column in np.ndindex(4, 6):
            pixel = sums[:, row, column]
            t = lamp.distances(eye, rays_of(row, column, 64))  # nothing stands before it
            t = t[np.isfinite(t)]
            pixel[0] += histogram(t, np.full(len(t), 1 / 64**2), gates)[:, None] * lamp_radiance
            rays = rays_of(row, column, 20)
            t = np.array([patch.distances(eye, rays) for patch in (floor, wall, lamp)])
            for patch, other, distance in ((floor, wall, t[0]), (wall, floor, t[1])):
                met = np.isfinite(distance) & (distance == t.min(axis=0))
                at, length = eye + rays[met] * distance[met, None], distance[met]
                light, way = between(at, patch.normal, lamp.points(6), lamp.normal)
                scale = lamp.area / 36 / len(rays) * lamp_radiance * patch.albedo / np.pi
                pixel[1] += histogram(length[:, None] + way, light, gates)[:, None] * scale
                y, z = other.points(12), lamp.points(3)
                first, way = between(at, patch.normal, y, other.normal)
                second, last = between(y, other.normal, z, lamp.normal)
                scale = lamp.area / 9 * other.area / 144 / len(rays) * lamp_radiance * patch.albedo * other.albedo / np.pi**2
                lengths = (length[:, None] + way)[:, :, None] + last[None]
                pixel[2] += histogram(lengths, first[:, :, None] * second[None], gates)[:, None] * scale
        images = []
        for depth in (1, 2, 3):
            self.imported(BOX, "-D", f"depth={depth}")
            images.append(self.image("--samples", 8192))
        self.assertIn("# Times 0.5, the bins' width", (self.out / "experiment.yaml").read_text())
        for bounces, image in enumerate(images):
            wanted = sums[: bounces + 1].sum(axis=0)
            errors = np.abs((image - wanted).sum(axis=(0, 1))) / wanted.sum(axis=(0, 1)).max(axis=0)
            self.assertLess(errors.max(), 0.01, bounces)
            errors = np.abs((image - wanted).sum(axis=2)) / wanted.sum(axis=2).max(axis=(0, 1))
            self.assertLess(errors.max(), 0.03, bounces)
        # What comes late was reflected twice.
        self.assertEqual(sums[:2, :, :, 9:].max(), 0)
        np.testing.assert_allclose(images[2][:, :, 9:].sum(axis=(0, 1, 2)), sums[2][:, :, 9:].sum(axis=(0, 1, 2)), rtol=0.02)

    def hidden_sum(self, sensor, spot, ends):
        hidden = Patch((0.4, 0.1, -0.1), (0, 0, 0.3), (0, 0.25, 0), 0.6)
        points, wall_normal = hidden.points(150), np.array((1, 0, 0))
        (g1, r1), (g2, r2) = (between(np.array([p]), wall_normal, points, hidden.normal) for p in (sensor, spot))
        return histogram(ends + r1 + r2, g1 * g2 * hidden.area / len(points) * 0.6 / np.pi**3, (4, 0.1, 16))

    def test_a_hidden_rectangle(self):
        """A laser's spot, the hidden rectangle, a point of the wall: histograms of a single and of a confocal capture."""
        laser, detector, spot = np.array((1, 0.3, 0.5)), np.array((0.8, 0.1, -0.4)), np.array((-0.5, 0.1, 0.2))
        self.assertEqual(Patch((0, 0, 0), (0, 0, 0.3), (0, 0.25, 0), 0).normal[0], -1)
        for kind in ("single", "confocal"):
            found = self.imported(scene(WALL, HIDDEN), "-D", f"type={kind}")
            self.assertEqual([shape["name"] for shape in found["shapes"]], ["hidden"])
            with h5py.File(self.rendered("--samples", 4096) / "render.h5") as file:
                counts, places = file["H"][()].astype(float), file["sensor_grid_xyz"][()]
            for column, row in np.ndindex(3, 2):
                # The rectangle's x axis lies along -z of the world.
                sensor = np.array((-0.5, 0.4 * (row - 0.5), -0.6 * (2 * column - 2) / 3))
                np.testing.assert_allclose(places[column, row], sensor, atol=1e-6)
                lit = spot if kind == "single" else sensor
                ends = np.linalg.norm(laser - lit) + np.linalg.norm(detector - sensor)
                wanted = self.hidden_sum(sensor, lit, ends)
                self.assertGreater(wanted.max(), 1e-3)
                self.assertLess(np.abs(counts[:, column, row] - wanted).max(), 0.03 * wanted.max())
        # pi x irradiance x cos / r^2 x albedo^2 x width, the beam being along the projector's axis.
        self.imported(scene(WALL, HIDDEN))
        wanted = np.pi * 5 * 1.5 / np.linalg.norm(laser - spot)**3 * 0.7**2 * 0.1
        times = re.search(r"# Times (\S+) these", (self.out / "experiment.yaml").read_text())[1]
        self.assertAlmostEqual(float(times) / wanted, 1, 5)

    def test_where_a_capture_is_lit(self):
        text = scene(WALL, HIDDEN)
        self.assert_fails("emitter 'projector': misses the wall", text.replace("-0.5, 0.1, 0.2", "2, 2, 2"))
        lit = scene(WALL, HIDDEN, '<emitter type="point"/>')
        self.assert_fails("emitter 'point': nothing but the laser lights a capture", lit)
        spots = lambda *options: self.imported(text, *options)["capture"]["laser"]["points"]
        np.testing.assert_allclose(spots(), [(-0.5, 0.1, 0.2)], atol=1e-9)
        np.testing.assert_allclose(spots("--laser-pixel", "3,1"), [(-0.5, 0, -0.6)], atol=1e-9)
        np.testing.assert_allclose(spots("--laser-point=-0.5,0.1,0"), [(-0.5, 0.1, 0)], atol=1e-9)
        self.assertEqual(len(spots("-D", "type=exhaustive")), 6)
        # With the wall among what reflects in between.
        found = self.imported(text.replace('geometry_sampling" value="true"', 'geometry_sampling" value="false"'))
        self.assertEqual([shape["name"] for shape in found["shapes"]], ["relay", "hidden"])
        self.rendered("--samples", 4)

    def test_a_wall_before_a_camera(self):
        camera = """<sensor type="perspective"> <float name="fov" value="20"/> <transform name="to_world">
          <lookat origin="0.3 0.1 -0.4" target="-0.5 0.1 0" up="0 1 0"/> </transform>"""
        start, end = WALL.index('<sensor type="nlos'), WALL.index("</sensor>") + len("</sensor>")
        film = WALL[WALL.index("<film"):end]
        capture = self.imported(scene(WALL[:start] + WALL[end:], camera + film, HIDDEN))["capture"]
        points = np.array(capture["sensor"]["points"]).reshape(2, 3, 3)
        np.testing.assert_allclose(points[..., 0], -0.5, atol=1e-9)
        self.assertGreater(points[0, 0, 1], points[1, 0, 1])  # rows run down
        # Who looks along -x has +z on the left.
        self.assertGreater(points[0, 0, 2], points[0, 2, 2])
        np.testing.assert_allclose(points[:, 1].mean(axis=0), (-0.5, 0.1, 0), atol=1e-9)
        self.assertEqual(capture["origin"]["sensor"], [0.3, 0.1, -0.4])


if __name__ == "__main__":
    unittest.main()
