#!/usr/bin/python3
"""isochron.report on folders of runs in every state: what the pages say, and that everybody can read them."""

import base64
import contextlib
import fcntl
import io
import json
import os
import pathlib
import re
import tempfile
import time
import unittest

from report_folders import EXPERIMENT, Page, images, write_capture_run, write_log, write_reconstruction, write_run
import lengths
import numpy as np
from isochron import exr
from isochron.report import __main__ as program
from isochron.report.geometry import coarser, outline
from isochron.report.images import MOST_BYTES, Plan
from isochron.report.run import Run


class ReportTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.top = pathlib.Path(folder.name)
        self.folder = self.top / "run"

    def run_program(self, *arguments):
        """Exit status and messages; within this process, as Matplotlib takes longer to load than most tests."""
        with contextlib.redirect_stderr(io.StringIO()) as messages:
            try:
                status = program.main([str(a) for a in arguments])
            except SystemExit as end:
                status = end.code
        return status, messages.getvalue()

    def page(self, *folders, output=None):
        output = output or self.folder / "report.html"
        more = () if len(folders) < 2 else ("-o", output)
        self.assertEqual(self.run_program(*(folders or (self.folder,)), *more), (0, f"{output}\n"))
        self.text = output.read_text()
        page = Page(self.text)
        self.assertEqual(page.faults, [])
        self.assertEqual(list(output.parent.glob(".*.tmp")), [])
        return page

    def assert_fails(self, words, *arguments):
        status, messages = self.run_program(*arguments)
        self.assertEqual(status, 2, messages)
        self.assertRegex(messages, rf"\Areport: .*{words}.*\n\Z")

    def edit(self, name, before, after):
        path = self.folder / name
        text = path.read_text()
        self.assertIn(before, text)
        path.write_text(text.replace(before, after))

    def viewers(self):
        return [json.loads(text) for text in re.findall(r'<script type="application/json">(.*?)</script>', self.text)]

    def test_finished(self):
        write_run(self.folder)
        page = self.page()
        self.assertEqual([words for level, words in page.headings if level == 2],
                         ["How it ended", "Parameters", "Convergence", "Images over the iterations", "Geometry",
                          "The experiment", "Cost and versions"])
        for words in ("All 20 iterations done", "translation of box", "albedo of white", "25 MB", "1e+06",
                      "scatter of the parameter", "as it was written", "gaussian"):
            self.assertIn(words, page.words)
        sliders = page.all("input", type="range")
        self.assertEqual(len(sliders), 3)
        self.assertEqual({(s["max"], s["value"]) for s in sliders}, {("5", "5")})
        for viewer in self.viewers():
            self.assertEqual(viewer["steps"], ["iteration 0", "iteration 4", "iteration 8", "iteration 12", "iteration 16",
                                               "final, after iteration 20"])
            self.assertEqual([len(uris) for uris in viewer["pictures"]], [6, 6])  # image and difference; the target stays
            self.assertEqual(len(set(viewer["pictures"][0])), 6)
        self.assertEqual(len(page.all("svg")), 6)  # height, colour, loss, images, parameters, gradient
        self.assertEqual(len([p for p in page.all("line") if p.get("class", "").startswith("target")]), 4)
        view = json.loads(re.search(r'id="view-data">(.*?)</script>', self.text)[1])
        self.assertEqual([(m["shape"], m["moment"]) for m in view["meshes"]],
                         [("box", m) for m in ("initial", "current", "target")])
        self.assertEqual(view["names"]["current"], "final")
        self.assertEqual([name for name, _ in view["marks"]], ["camera", "flash"])
        self.assertIn("initial 0.3 (at most 0.3), final 0.01", page.words)

    def test_colours_and_derivatives(self):
        write_run(self.folder, channels="RGB")
        derivatives = self.folder / "report/derivatives"
        derivatives.mkdir(parents=True)
        values = {"total": 0.5, "interior": 0.7, "visibility": -0.2, "path_length": 0}
        parts = [images(value, component=f"{name}.") for name, value in values.items()]
        exr.write(derivatives / "height.exr", {k: v for part in parts for k, v in part.items()})
        (derivatives / "derivatives.yaml").write_text("summary: \"0\"\nsamples: 12\n")
        page = self.page()
        self.assertIn("12 samples", page.words)
        self.assertIn("Zero everywhere: path length", page.words)
        self.assertEqual(len([i for i in page.all("img") if i["alt"].startswith("derivative by height")]), 9)

    def test_time_of_terms(self):
        write_run(self.folder)
        page = self.page()
        rows = re.findall(r'<th scope="row">([^<]*)</th><td>([^<]*)</td><td>([^<]* %)</td>', self.text)
        self.assertEqual(dict((name, (time, share)) for name, time, share in rows), {
            "target images": ("1.5 s", "12.0 %"), "scene made ready": ("0.5 s", "4.0 %"), "images": ("2 s", "16.0 %"),
            "interior term": ("4 s", "32.0 %"), "visibility: edges found and learned about": ("0.25 s", "2.0 %"),
            "visibility term": ("3 s", "24.0 %"), "all else (optimiser, files ...)": ("1.25 s", "10.0 %")})
        self.page(self.folder, self.folder, output=self.top / "c.html")
        self.assertIn("time: interior term", self.text)
        self.edit("summary.yaml", "passes: {", "passes: [] # {")
        self.edit("summary.yaml", "            passes: [] #", "            passes: []} #")
        self.page()

    def test_shapes_that_stand_still(self):
        write_run(self.folder)
        scene = self.folder / "inputs/scene"
        (scene / "ramp.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        (scene / "wedge.stl").write_text("solid w\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                                         "endloop\nendfacet\nendsolid w\n")
        (scene / "plate.ply").write_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                         "property float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n"
                                         "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        self.edit("inputs/scene/scene.yaml", "lights:", "".join(
            f"  - {{name: {name.split('.')[0]}, file: {name}}}\n" for name in ("ramp.off", "wedge.stl", "plate.ply", "gone.stl"))
            + "lights:")
        page = self.page()
        view = json.loads(re.search(r'id="view-data">(.*?)</script>', self.text)[1])
        self.assertEqual(len(view["lines"]), 4)  # the floor's, too
        self.assertTrue(all(line["pairs"] for line in view["lines"]))
        self.assertIn("gone is not drawn: ", page.words)
        self.assertNotIn("ramp is not drawn", page.words)

    def test_going(self):
        write_run(self.folder, status=None)
        with open(self.folder / ".lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            page = self.page()
        self.assertIn("Still going: iteration 8 of 20", page.words)
        self.assertEqual(page.headings[1], (2, "So far"))
        self.assertIn("now", [data for tag, data in page.texts if tag == "th"])
        self.assertIn("0.05", page.words)  # the checkpoint's
        self.assertEqual(self.viewers()[0]["steps"][-1], "iteration 8")

    def test_broken_off(self):
        write_run(self.folder, status=None)
        self.assertIn("Not ended: 8 of 20 iterations so far", self.page().words)
        (self.folder / "summary.yaml").write_text("status: interrupted\niterations: 8\n")
        self.assertIn("Interrupted after 8 of 20", self.page().words)

    def test_nothing_but_the_experiment(self):
        self.folder.mkdir()
        (self.folder / "experiment.yaml").write_text(EXPERIMENT.replace("NAME", "bare"))
        page = self.page()
        self.assertIn("0 of 20 iterations so far", page.words)
        self.assertIn("±", page.words)

    def test_a_fit_that_is_too_near(self):
        write_run(self.folder)
        with open(self.folder / "summary.yaml", "a") as summary:
            summary.write("fit: {deviance: 800, degrees_of_freedom: 1000, floor: 1100, p_value: 1, verdict: unexplained}\n")
        self.assertIn("The fit does not explain the data: deviance 800, expected 1100, p = 1: no Poisson numbers, or not at rest.",
                      self.page().words)

    def test_unknowns_at_bounds(self):
        write_run(self.folder)
        self.assertNotIn("bound", self.page().words)
        with open(self.folder / "summary.yaml", "a") as summary:
            summary.write("at_bounds:\n  height:\n    lower: {bound: -0.5, count: 1, first: [0]}\n"
                          "  colour:\n    upper: {bound: 1, count: 2, first: [0, 2]}\n")
            summary.write("fit: {deviance: 1234.5, degrees_of_freedom: 1000, floor: 1100, p_value: 0.001, verdict: unexplained}\n")
        words = self.page().words
        self.assertIn("The fit does not explain the data: deviance 1234.5, expected 1100, p = 0.001.", words)
        self.assertNotIn("no Poisson numbers", words)
        self.assertIn("height ended at its lower bound −0.5", words)
        self.assertIn("colour: 2 of 3 ended at their upper bound 1 (0, 2)", words)

    def test_diverged(self):
        write_run(self.folder, status="diverged")
        (self.folder / "checkpoint.yaml").unlink()
        exr.write(self.folder / "final.exr", {name: np.full_like(v, np.nan) for name, v in images(1.0).items()})
        page = self.page()
        self.assertIn("Diverged after 20 iterations", page.words)
        self.assertIn("Magenta", page.words)

    def test_damaged_files(self):
        write_run(self.folder)
        for name in ("final.exr", "frames/000004.exr"):
            (self.folder / name).write_bytes((self.folder / name).read_bytes()[:200])
        (self.folder / "summary.yaml").write_text("status: [\n")
        (self.folder / "geometry/initial_box.ply").write_bytes(b"ply\n")
        self.edit("log.csv", "9,5.0,", "9,5.0\n10,")
        page = self.page()
        for words in ("final.exr", "summary.yaml: cannot be read", "initial_box.ply: is no PLY file", "000004.exr"):
            self.assertIn(words, page.words)
        (self.folder / "experiment.yaml").write_text("name: [")
        self.assertIn("experiment.yaml: cannot be read", self.page().words)

    def test_odd_values(self):
        write_run(self.folder)
        for before, after in (("optimizer: {", "optimizer: 3 #"), ("samples: {primal", "samples: [1] #"),
                              ("gates: {", "gates: 7 #"),
                              ("loss: {", "loss: [] #"), ("target: {", "target: yes #"), ("initial: 0.3", "initial: {a: 1}"),
                              ("name: colour", "name: [1, 2]")):
            self.edit("experiment.yaml", before, after)
            self.page()
        for before, after in (("iterations: 20", "iterations: many"), ("last_call: {", "last_call: 1 #"),
                              ("height: 0.01", "height: high"),
                              ("loss_final: 0.01", "loss_final: [1]"), ("parameters:", "standard_errors: 3\nparameters:"),
                              ("parameters:", "combinations: {a: {mean: [x]}, b: 3}\nsteps_left: {c: }\nparameters:")):
            self.edit("summary.yaml", before, after)
            self.page()
        self.edit("inputs/scene/scene.yaml", "position: [0, 1, 4]", "position: here")
        self.page()

    def test_names_cannot_become_part_of_the_page(self):
        evil = "</script><script>alert('1')</script><img src=http://x/>&\"'"
        write_run(self.folder, name=evil)
        for old in ("height", "box"):
            for path in ("experiment.yaml", "summary.yaml", "inputs/scene/scene.yaml", "log.csv"):
                text = (self.folder / path).read_text()
                new = json.dumps(f"{old}{evil}") if path.endswith("yaml") else '"' + f"{old}{evil}".replace('"', '""') + '"'
                (self.folder / path).write_text(re.sub(rf"(?<=[ ,]){old}(?=[,:}}\n])", lambda _: new, text))
        (self.folder / "inputs/scene/scene.yaml").write_text(
            (self.folder / "inputs/scene/scene.yaml").read_text().replace("name: flash", f"name: {json.dumps(evil)}"))
        page = self.page()
        self.assertEqual(page.headings[0][1], evil)
        self.assertEqual(len(page.all("script")), 5)  # three viewers, the view's data, the page's own
        self.assertNotIn("<script>alert", self.text)
        comparison = self.page(self.folder, self.folder, output=self.top / "c.html")
        self.assertNotIn("<script>alert", self.text)
        self.assertEqual(len(comparison.all("script")), 1)

    def test_many_numbers(self):
        write_run(self.folder)
        many = ", ".join(str(0.001 * i) for i in range(5000))
        self.edit("experiment.yaml", "initial: [0.5, 0.5, 0.5], target: [0.7, 0.3, 0.2]", "initial: 0, target: 1")
        self.edit("summary.yaml", "colour: [0.69, 0.31, 1e-05]", f"colour: [{many}]")
        page = self.page()
        self.assertIn("colour, RMS of 5000", page.words)
        self.assertIn("furthest off: colour[4999]", page.words)
        self.assertIn("median", page.words)
        self.assertLess(len(self.text), 500_000)

    def test_capture(self):
        write_capture_run(self.folder)
        page = self.page()
        for words in ("it is a lower bound", "Slice over time: row 2", "Histograms", "drawn from it",
                      "± 0.0005", "undetermined", "gain * paint", "± 0.75", "a Newton step would move z by 0.25"):
            self.assertIn(words, page.words)
        self.assertEqual(self.viewers()[0]["steps"], ["iteration 0", "iteration 1", "final, after iteration 2"])
        self.assertIn("Seen from the wall", page.words)
        (self.folder / "final.h5").unlink()  # not finished
        self.assertNotIn("Histograms", self.page().words)

    def view(self):
        return json.loads(re.search(r'id="view-data">(.*?)</script>', self.text)[1])

    def test_reconstruction(self):
        write_reconstruction(self.folder)
        page = self.page()
        self.assertEqual([words for level, words in page.headings if level == 2][:4],
                         ["How it ended", "The surface", "Geometry", "Parameters"])
        for words in ("The fit explains the data: deviance 1234.5", "Levels; the page shows the last one",
                      "Started from back projection, significant by 41.8 standard deviations of the counts' noise, which took 2.5 s.",
                      "Seen from the wall: depth, albedo and standard error of the surface, and depth and albedo by back-projection, "
                      "the start of the fit."):
            self.assertIn(words, page.words)
        switches = page.all("input", type="radio", name="layer")
        self.assertEqual([(s["value"], "checked" in s) for s in switches], [("shape", False), ("albedo", True), ("uncertainty", False)])
        self.assertEqual([("hidden" in d) for d in page.all("div") if "data-layer" in d], [False, True])
        view = self.view()
        self.assertEqual(view["names"], {"initial": "back-projection", "current": "fit"})
        self.assertEqual([list(m["layers"]) for m in view["meshes"]], [["albedo"], ["albedo", "uncertainty"]])

        def values(mesh, key, kind):
            return np.frombuffer(base64.b64decode(mesh[key]), kind).reshape(-1, 3)

        fit = view["meshes"][1]
        np.testing.assert_allclose(values(fit, "points", "<f4")[0], [-0.2, 0.2, 0.5], rtol=1e-6)  # the capture's coordinates
        np.testing.assert_array_equal(values(fit, "triangles", "<u4"), [(2, 1, 0), (3, 2, 0)])
        for layer in ("albedo", "uncertainty"):
            colours = values(fit["layers"], layer, "u1").astype(int)
            self.assertEqual(len(np.unique(colours, axis=0)), 4)
            self.assertGreater(colours[3].min(), 0.7 * 255)  # nothing is known of the last vertex: pale
            self.assertLess(colours[:3].min(axis=1).max(), 0.6 * 255)
        self.assertEqual(len(view["lines"]), 1)  # the wall; the scene's surface is not drawn twice

    @lengths.long
    def test_reconstruction_that_lacks_something(self):
        write_reconstruction(self.folder)
        self.edit("levels/1/summary.yaml", "status: iterations_reached", "status: interrupted")  # where time was over
        self.assertIn("The fit explains the data", self.page().words)
        self.edit("levels/1/summary.yaml", "status: interrupted", "status: iterations_reached")
        (self.folder / "geometry/final_surface.ply").unlink()
        page = self.page()
        self.assertIn("Seen from the wall: depth and albedo by back-projection, the start of the fit.", page.words)
        self.assertEqual(page.all("input", type="radio"), [])
        self.assertEqual(self.view()["names"], {"initial": "initial", "current": "final", "target": "target"})
        (self.folder / "back_projection.ply").write_bytes(b"ply")
        page = self.page()
        self.assertIn("back_projection.ply: is no PLY file", page.words)
        self.assertNotIn("The surface", [words for _, words in page.headings])

    def test_several_runs(self):
        write_run(self.folder)
        write_run(self.top / "other", name="box")
        other = self.top / "other/experiment.yaml"
        other.write_text(other.read_text().replace("0.03", "0.06"))
        write_log(self.top / "other", 12)
        write_run(self.top / "colours", name="colours", channels="RGB")
        page = self.page(self.folder, self.top / "other", self.top / "colours", output=self.top / "c.html")
        rows = re.findall(r'<th scope="row">([^<]*)</th>', self.text)
        self.assertIn("optimizer.learning_rate", rows)
        self.assertNotIn("optimizer.iterations", rows)
        self.assertIn("Of another shape, not shown: colours", page.words)
        self.assertEqual(len(page.all("svg")), 6)
        self.assertEqual(len(page.all("img")), 9)  # three gates of target and two runs

    def test_no_run(self):
        self.assert_fails("no such folder", self.folder)
        self.folder.mkdir()
        self.assert_fails(r"holds no run \(there is no experiment.yaml\)", self.folder)
        self.assert_fails("the following arguments are required")
        write_run(self.top / "a")
        self.assert_fails("cannot be written", self.top / "a", "-o", self.folder / "no/such/report.html")
        self.assert_fails("cannot be written", self.top / "a", "-o", self.folder)

    def test_pages_stay_small(self):
        class Large:
            def __init__(self, shape):
                self.shape, self.images = shape, {"target": np.ones((shape[0], 1, 1))}

        for shape in ((4, 64, 64), (20, 8, 14, 3), (500, 64, 64), (3, 2000, 1500, 3), (1, 256, 256), (40, 300, 300)):
            plan = Plan(Large(shape), [("", i, None) for i in range(25)])
            pixels = shape[1] // plan.factor * (shape[2] // plan.factor)
            size = pixels * len(plan.gates) * (len(plan.frames) + 1) * (4 if len(shape) == 4 else 2)
            self.assertLessEqual(size, 1.5 * MOST_BYTES, shape)
            self.assertGreaterEqual(len(plan.frames), 3)
            self.assertEqual((plan.frames[0][1], plan.frames[-1][1]), (0, 24))

    def test_meshes(self):
        count = 120
        x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count)))
        points = np.column_stack([x, y, 0 * x])
        corner = np.arange(count * count).reshape(count, count)[:-1, :-1].ravel()
        triangles = np.concatenate([np.stack([corner, corner + 1, corner + count + 1], 1),
                                    np.stack([corner, corner + count + 1, corner + count], 1)])
        self.assertEqual(len(outline(points, triangles)), 4 * (count - 1))  # a flat square has its border alone
        moments, few = coarser([points, points + [0, 0, 1]], triangles)
        self.assertLess(len(few), 2600)
        self.assertGreater(len(few), 500)
        np.testing.assert_allclose(moments[1] - moments[0], np.tile([0, 0, 1], (len(moments[0]), 1)), atol=1e-9)
        box = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)], float)
        faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6),
                 (0, 6, 4), (1, 5, 7), (1, 7, 3)]
        self.assertEqual(len(outline(box, np.array(faces))), 12)

    def test_is_quick(self):
        write_run(self.folder)
        start = time.process_time()
        self.page()
        self.assertLess(time.process_time() - start, 3)

    def test_age_of_a_run_elsewhere(self):
        write_run(self.folder, status=None)
        old = time.time() - 7200
        os.utime(self.folder / "log.csv", (old, old))
        self.assertIn("last row 2.0 h ago", Run(self.folder).state_words)


if __name__ == "__main__":
    lengths.main()
