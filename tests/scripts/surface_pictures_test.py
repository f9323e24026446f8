#!/usr/bin/python3
"""Pictures of reconstructions: what is seen of surfaces whose answer is known, and where it is drawn."""

import contextlib
import io
import pathlib
import tempfile
import unittest
import unittest.mock

from report_folders import METRES_PER_PS, TRIANGLES, write_ply, write_reconstruction
import matplotlib

matplotlib.use("Agg")
import matplotlib.image
import matplotlib.pyplot as plt
import lengths
import numpy as np
from isochron import plot
from isochron.errors import InputError
from isochron.pictures import raster
from isochron.pictures.found_surface import FoundSurface, width_at_half
from isochron.pictures.raster import Seen
from isochron.pictures.surface_sheet import Sight, shades, surface_figure
from seeds import generator


class RasterTest(unittest.TestCase):
    LINES = np.linspace(-1.03, 0.97, 61)

    def plane(self, slopes, middle, corner=0.7):
        """A square of triangles of many sizes on a plane, and a value that is another plane's."""
        places = np.concatenate([generator(3).uniform(-corner, corner, (60, 2)), corner * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])])
        triangles = matplotlib.tri.Triangulation(*places.T).triangles
        return np.column_stack([places, middle + places @ slopes]), triangles, 2 + places @ [0.3, -0.4]

    def test_a_plane_is_met_where_it_is(self):
        points, triangles, values = self.plane([0.5, -0.25], 2)
        up = self.LINES[:50]
        seen = Seen(points, triangles, self.LINES, up)
        x, y = np.meshgrid(self.LINES, up)
        inside = (abs(x) < 0.7) & (abs(y) < 0.7)
        np.testing.assert_allclose(seen.depth, np.where(inside, 2 + 0.5 * x - 0.25 * y, np.nan), atol=1e-12)
        np.testing.assert_allclose(seen.of(values), np.where(inside, 2 + 0.3 * x - 0.4 * y, np.nan), atol=1e-12)
        values[7] = np.nan  # spoils the triangles at this vertex, and no others
        spoilt = inside & np.isnan(seen.of(values))
        self.assertGreater(spoilt.sum(), 0)
        self.assertLess(spoilt.sum(), 0.3 * inside.sum())

    def test_the_nearest_is_seen_whatever_the_order(self):
        near, far = self.plane([0.2, 0], 1, corner=0.4), self.plane([0, 0.1], 3)
        x, y = np.meshgrid(self.LINES, self.LINES)
        expected = np.where((abs(x) < 0.4) & (abs(y) < 0.4), 1 + 0.2 * x, np.where((abs(x) < 0.7) & (abs(y) < 0.7), 3 + 0.1 * y, np.nan))
        for first, second in ((near, far), (far, near)):
            points = np.concatenate([first[0], second[0]])
            triangles = np.concatenate([first[1], second[1] + len(first[0])])
            for most in (raster.MOST_PAIRS, 500):
                with self.subTest(most=most), unittest.mock.patch.object(raster, "MOST_PAIRS", most):
                    np.testing.assert_allclose(Seen(points, triangles, self.LINES, self.LINES).depth, expected, atol=1e-12)

    def test_edges_have_no_holes_and_what_stands_on_edge_is_not_seen(self):
        lines = np.arange(5.0)  # through vertices and along edges
        points = np.array([(x, y, 1) for y in lines for x in lines])
        corner = np.array([5 * y + x for y in range(4) for x in range(4)])
        squares = np.concatenate([np.stack([corner, corner + 1, corner + 6], 1), np.stack([corner, corner + 6, corner + 5], 1)])
        np.testing.assert_array_equal(Seen(points, squares, lines, lines).depth, np.ones((5, 5)))
        upright = np.array([[1, 1, 0], [3, 1, 0], [2, 1, 1]])
        self.assertTrue(np.isnan(Seen(upright, [(0, 1, 2)], lines, lines).depth).all())
        self.assertTrue(np.isnan(Seen(points + 9, squares, lines, lines).depth).all())
        self.assertTrue(np.isnan(Seen(points, np.empty((0, 3), int), lines, lines).depth).all())


class SurfacePictureTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(plt.close, "all")
        self.folder = write_reconstruction(pathlib.Path(folder.name) / "run")

    def figure(self):
        """Axes and pictures by title."""
        figure = surface_figure(FoundSurface(self.folder))
        figure.draw_without_rendering()
        return {axes.get_title(): (axes, axes.images[0]) for axes in figure.axes if axes.images and axes.get_title()}

    def colour(self, panel, x, y):
        left, right, bottom, top = panel[1].get_extent()
        picture = panel[1].get_array()
        return picture[int((y - bottom) / (top - bottom) * len(picture)), int((x - left) / (right - left) * picture.shape[1])]

    def test_who_stands_at_the_wall_has_x_to_the_left(self):
        panels = self.figure()
        self.assertEqual(list(panels), ["Fit: depth", "Fit: albedo", "Fit: standard error", "Back-projection: depth",
                                        "Back-projection: albedo"])
        for axes, _ in panels.values():
            places = axes.transData.transform([(0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2)])
            self.assertGreater(places[1, 0], places[0, 0])
            self.assertGreater(places[1, 1], places[2, 1])
            self.assertAlmostEqual(places[1, 0] - places[0, 0], places[1, 1] - places[2, 1], 6)
            self.assertEqual((axes.get_xlabel(), axes.get_ylabel()), ("x (m)", "y (m)"))
        found = panels["Back-projection: depth"]
        self.assertEqual([self.colour(found, *place)[3] for place in ((-0.15, 0.15), (0.15, -0.15), (0.15, 0.15), (0, 0))],
                         [1, 1, 0, 0])

    def test_colours_are_those_of_the_values(self):
        panels = self.figure()
        depths = [self.colour(panels["Fit: depth"], 0.17, y) for y in (0.15, -0.13)]
        self.assertGreater(depths[0][:3].sum(), depths[1][:3].sum())  # near is bright
        other = self.colour(panels["Back-projection: depth"], -0.17, 0.17)  # 0.51 m, and so is the fit at y = 0.16
        np.testing.assert_allclose(other, self.colour(panels["Fit: depth"], 0.15, 0.16), atol=0.03)
        albedo = [self.colour(panels["Fit: albedo"], 0.1, y)[:3].sum() for y in (0.15, -0.05)]
        self.assertLess(*albedo)

    def test_what_is_not_determined_is_pale(self):
        found = FoundSurface(self.folder)
        self.assertAlmostEqual(found.resolution, 20 * METRES_PER_PS)  # half a bin
        np.testing.assert_array_equal(found.undetermined(np.array([0.001, np.nan, 0.0061, np.inf])), [0, 1, 1, 1])
        panels = self.figure()
        for name in ("Fit: depth", "Fit: albedo", "Fit: standard error"):
            self.assertGreater(self.colour(panels[name], -0.1, -0.15)[:3].min(), 0.7, name)  # at the vertex without an error
            self.assertLess(self.colour(panels[name], 0.15, 0.1)[:3].min(), 0.6, name)
        sight = Sight(found, found.fit, np.array([0.1]), np.array([0.15]))
        self.assertAlmostEqual(sight.errors[0, 0], 1000 * (0.002 + 0.001 * 0.125 - 0.001 * 0.25), 9)
        missing = shades(np.array([[np.nan, 1.0]]), "inferno", 0, 1)
        np.testing.assert_array_equal(missing[..., 3], [[0, 1]])

    @lengths.long
    def test_pictures_are_about_what_is_not_dark(self):
        before = self.figure()["Fit: depth"]
        square = np.array([[-0.2, 0.2, 0.5], [0.2, 0.2, 0.5], [0.2, -0.2, 0.6], [-0.2, -0.2, 0.6]])
        far = [[0.1, 0.8, 0.1], [0.2, 0.8, 0.1], [0.2, 0.7, 0.1]]
        for albedo, same in ((0.001, True), (0.5, False)):
            write_ply(self.folder / "geometry/final_surface.ply", np.concatenate([square, far]), [*TRIANGLES, (4, 5, 6)],
                      albedo=[0.2, 0.4, 0.6, 0.8] + [albedo] * 3)
            after = self.figure()["Fit: depth"]
            self.assertEqual(before[1].get_extent() == after[1].get_extent(), same)
            if same:
                np.testing.assert_allclose(self.colour(after, 0.15, 0.1), self.colour(before, 0.15, 0.1), atol=1e-3)

    def test_width_of_a_response(self):
        offsets = np.array([0, 1, 2, 4, 5.0])
        self.assertAlmostEqual(width_at_half(offsets, np.array([0, 1, 2, 0, 0.0])), 2)
        self.assertAlmostEqual(width_at_half(offsets, np.array([0, 0, 1, 1, 1.0])), 3.5)
        with open(self.folder / "experiment.yaml") as file:
            text = file.read()
        text = text.replace("scene_unit_m: 1}", "scene_unit_m: 1, response: {offsets: [0, 100, 200], values: [0, 1, 0]}}")
        (self.folder / "experiment.yaml").write_text(text)
        self.assertAlmostEqual(FoundSurface(self.folder).resolution, 50 * METRES_PER_PS)

    @lengths.long
    def test_plot_draws_it(self):
        drawn = dict.fromkeys(("plot_images", "plot_signed", "plot_log"), unittest.mock.DEFAULT)  # have tests of their own
        sheet = unittest.mock.patch.object(plot.Pictures, "draw_capture")
        with sheet, unittest.mock.patch.multiple(plot, **drawn), contextlib.redirect_stderr(io.StringIO()) as messages:
            self.assertEqual((plot.main([str(self.folder)]), messages.getvalue()), (0, ""))
        picture = matplotlib.image.imread(self.folder / "surface.png")
        self.assertGreater(min(picture.shape[:2]), 700)
        self.assertGreater(np.ptp(picture[..., :3]), 0.9)

    @lengths.long
    def test_less_than_all(self):
        square = np.array([[-0.2, 0.2, 0.5], [0.2, 0.2, 0.5], [0.2, -0.2, 0.6], [-0.2, -0.2, 0.6]])
        write_ply(self.folder / "geometry/final_surface.ply", square, TRIANGLES)  # of a run that was begun without numbers
        self.assertEqual(list(self.figure()), ["Fit: depth", "Back-projection: depth", "Back-projection: albedo"])
        (self.folder / "geometry/final_surface.ply").unlink()
        self.assertEqual(list(self.figure()), ["Back-projection: depth", "Back-projection: albedo"])
        capture = self.folder / "inputs/scene/s.h5"
        (self.folder / "final.h5").rename(capture)
        (self.folder / "inputs/scene/s.yaml").write_text("capture: {file: s.h5}\n")
        self.assertEqual(list(self.figure()), ["Back-projection: depth", "Back-projection: albedo"])
        (self.folder / "back_projection.ply").write_bytes(b"ply\n")
        with self.assertRaisesRegex(InputError, "back_projection.ply: is no PLY file"):
            FoundSurface(self.folder)
        capture.unlink()
        with self.assertRaisesRegex(InputError, "s.h5: cannot be read"):
            FoundSurface(self.folder)


if __name__ == "__main__":
    lengths.main()
