#!/usr/bin/python3
"""The Python package in research: losses of one's own, other processes, notebooks.

usage: python_use_test.py PROGRAM PACKAGES     PACKAGES: the folder that holds the package with its extension
"""

import copy
import io
import math
import multiprocessing
import os
import pathlib
import pickle
import subprocess
import sys
import tempfile
import types
import unittest
import unittest.mock
import warnings

if __name__ == "__main__":  # processes that this one starts have its path
    PROGRAM, PACKAGES = sys.argv[1:3]
    del sys.argv[1:3]
    sys.path.insert(0, PACKAGES)
import isochron
import lengths
import numpy as np
from isochron import progress

QUAD = np.array([[0, 1, 2], [0, 2, 3]])


def quad(size, height):
    return np.array([[-size, height, -size], [-size, height, size], [size, height, size], [size, height, -size]], float)


def description(**more):
    return {
        "name": "room",
        "scene": {"camera": {"position": [0.2, 2.5, 2.5], "look_at": [0, 0, 0], "up": [0, 1, 0], "fov": 40, "resolution": [12, 10]},
                  "materials": {"white": {"type": "diffuse", "albedo": 0.6}},
                  "shapes": [{"name": "floor", "vertices": quad(2, 0), "triangles": QUAD, "material": "white"},
                             {"name": "block", "vertices": quad(0.5, 0.5), "triangles": QUAD, "material": "white"}],
                  "lights": [{"name": "lamp", "type": "point", "position": [0, 2, 0.3], "intensity": 10}]},
        "max_bounces": 2,
        "gates": {"kind": "gaussian", "centers": [4.5, 5.5], "sigma": 0.3},
        "parameters": [{"name": "height", "type": "translation", "shape": "block", "direction": [0, 1, 0], "initial": 0.2, "target": 0},
                       {"name": "paint", "type": "albedo", "material": "white", "initial": 0.4, "target": 0.6}],
        "target": {"samples": 256},
        "samples": {"primal": 16, "interior": 16, "visibility": 16, "path_length": 0},
        "optimizer": {"method": "adam", "learning_rate": 0.02, "iterations": 5}, **more}


def without_target():
    changed = description()
    for parameter in changed["parameters"]:
        del parameter["target"]
    return changed


class UseTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        self.enterContext(warnings.catch_warnings(action="ignore"))  # so few samples that gates are dark


class OwnLossTest(UseTest):
    def squares(self, target):
        def loss(image):
            self.assertEqual(image.coordinates.centers.tolist(), [4.5, 5.5])
            return ((image - target) ** 2).mean(), 2 * (image - target) / image.size
        return loss

    def test_squares_are_the_programs_loss(self):
        """The program's loss has no bias from noise, and the same random numbers: neither has one that Python computes."""
        for samples, tolerance in ((16, 1e-9), (7, 0.05)):  # the program takes halves of an odd number for equal
            experiment = isochron.Experiment.from_dict(description(
                samples={"primal": samples, "interior": 8, "visibility": 8, "path_length": 0}))
            known = experiment.run(self.folder / f"known_{samples}").log
            own = experiment.run(self.folder / f"own_{samples}", loss=self.squares(experiment.target)).log
            for name in ("loss", "image_rmse", "gradient_norm", "height", "paint"):
                np.testing.assert_allclose(own[name], known[name], rtol=tolerance, atol=1e-9, err_msg=name)
            self.assertLess(np.abs(np.log(own["loss_noise"] / known["loss_noise"])).max(), np.log(3))

    def test_line_searches(self):
        experiment = isochron.Experiment.from_dict(description(optimizer={"method": "lbfgs", "iterations": 3}))
        run = experiment.run(self.folder / "run", loss=self.squares(experiment.target))
        self.assertLess(run.log["loss"][-1], 0.05 * run.log["loss"][0])
        self.assertAlmostEqual(float(run.values["paint"]), 0.6, delta=0.05)

    def test_needs_no_target(self):
        experiment = isochron.Experiment.from_dict(without_target())
        rows = []
        run = experiment.run(self.folder / "run", loss=lambda image: (-image.mean(), np.array(-1 / image.size)), callback=rows.append)
        self.assertEqual(run.status, "iterations_reached")
        self.assertGreater(run.values["paint"], 0.45)  # brighter
        self.assertTrue(math.isnan(rows[0].image_rmse))
        self.assertEqual([(row.iteration, row.iterations, row.levels) for row in rows if not row.closing], [(i, 5, 0) for i in range(6)])
        self.assertFalse((self.folder / "run/target.exr").exists())
        self.assertEqual(subprocess.run([PROGRAM, "report", self.folder / "run"], capture_output=True, check=False).returncode, 0)

    def test_stopped_it_is_resumed_with_its_loss_alone(self):
        experiment = isochron.Experiment.from_dict(description())
        loss = self.squares(experiment.target)
        whole = experiment.run(self.folder / "whole", loss=loss)
        stopped = experiment.run(self.folder / "stopped", loss=loss, callback=lambda row: row.iteration == 2)
        with self.assertRaisesRegex(isochron.InputError, "minimises a loss of its own, .*squares.*loss=..."):
            isochron.resume(stopped.folder)
        failed = subprocess.run([PROGRAM, "resume", stopped.folder], capture_output=True, text=True, check=False)
        self.assertEqual(failed.returncode, 2, failed.stderr)
        self.assertIn("loss of its own", failed.stderr)
        resumed = isochron.resume(stopped.folder, loss=loss)
        self.assertEqual({name: value.tolist() for name, value in resumed.values.items()},
                         {name: value.tolist() for name, value in whole.values.items()})
        known = experiment.run(self.folder / "known", callback=lambda row: row.iteration == 2)
        with self.assertRaisesRegex(isochron.InputError, "without loss="):
            isochron.resume(known.folder, loss=loss)
        experiment.run(stopped.folder, force=True)  # leaves nothing of the earlier run's loss
        isochron.resume(stopped.folder)

    def test_mistakes_are_named(self):
        experiment = isochron.Experiment.from_dict(description())
        for loss, wrong in ((lambda image: 1.0, "expected two values"), (lambda image: (1.0, np.ones(7)), r"shape \(7,\)"),
                            (lambda image: (1.0, np.nan * image), "not finite"), (lambda image: ("a", image), "expected two values")):
            with self.assertRaisesRegex(isochron.InputError, "^loss: .*" + wrong):
                experiment.run(self.folder / "run", loss=loss)
        with self.assertRaises(ZeroDivisionError):
            experiment.run(self.folder / "run", loss=lambda image: 1 / 0)
        for changes, wrong in (({"optimizer": {"method": "quasi_newton"}}, r"optimizer.method: quasi_newton: .*\(allowed: adam, lbfgs\)"),
                               ({"optimizer": {"method": "levenberg_marquardt"}}, "optimizer.method: levenberg_marquardt")):
            with self.assertRaisesRegex(isochron.InputError, wrong):
                isochron.Experiment.from_dict(description(**changes)).run(self.folder / "run", loss=lambda image: (0, 0))


def rendered(experiment):
    return experiment.render({"height": 0.1}, samples=4)


class PickleTest(UseTest):
    def test_experiments_render_the_same_in_other_processes(self):
        made = isochron.Experiment.from_dict(description())
        file = isochron.Experiment(made.save(self.folder), {"seed": 7})
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            images = pool.map(rendered, [made, file])
        for experiment, image in zip((made, file), images):
            np.testing.assert_array_equal(image, rendered(experiment))
            self.assertEqual(image.coordinates.centers.tolist(), [4.5, 5.5])
        self.assertNotEqual(images[0].sum(), images[1].sum())

    def test_copies_outlive_what_they_are_of(self):
        made = isochron.Experiment.from_dict(description())
        expected, copied = rendered(made), copy.deepcopy(made)
        folder = made._files.folder
        del made
        self.assertFalse(folder.exists())
        np.testing.assert_array_equal(rendered(copied), expected)
        again = pickle.loads(pickle.dumps(copied))
        self.assertEqual(again.save(self.folder / "saved").name, "experiment.yaml")

    def test_paths_and_errors(self):
        isochron.Experiment.from_dict(description()).save(self.folder)
        here = os.getcwd()
        self.addCleanup(os.chdir, here)
        os.chdir(self.folder)
        pickled = pickle.dumps(isochron.Experiment("experiment.yaml", {"samples.primal": 4}))
        os.chdir(here)
        self.assertEqual(pickle.loads(pickled).name, "room")
        (self.folder / "experiment.yaml").unlink()
        with self.assertRaisesRegex(isochron.InputError, "experiment.yaml"):
            pickle.loads(pickled)
        error = pickle.loads(pickle.dumps(isochron.InputError("a line")))
        self.assertEqual(str(error), "a line")

    def test_results(self):
        experiment = isochron.Experiment.from_dict(description())
        image = rendered(experiment)
        again = pickle.loads(pickle.dumps(image))
        self.assertEqual(again.coordinates.unit, image.coordinates.unit)
        self.assertIsNone(pickle.loads(pickle.dumps(image[0])).coordinates)
        found = pickle.loads(pickle.dumps((experiment.evaluate(), experiment.gradient(samples=8), experiment.parameters)))
        self.assertEqual(found[2]["paint"].slice, slice(1, 2))
        run = experiment.run(self.folder / "run", callback=lambda row: pickle.loads(pickle.dumps(row)).iteration == 1)
        self.assertEqual(pickle.loads(pickle.dumps(run)).values, run.values)
        wall = np.zeros((2, 3, 3))
        capture = isochron.Capture(np.ones((4, 2, 3)), wall, wall + [0, 0, 1], None, 0.01, 0.5, None)
        self.assertEqual(pickle.loads(pickle.dumps(capture)).counts.shape, (4, 2, 3))


class Terminal(io.StringIO):
    def isatty(self):
        return True


class ProgressTest(UseTest):
    def setUp(self):
        super().setUp()
        self.experiment = isochron.Experiment.from_dict(description(optimizer={"method": "adam", "iterations": 3}))
        self.enterContext(unittest.mock.patch.object(progress, "FIRST", 0.0))

    def long(self, **more):
        """Takes half a second or more."""
        return self.experiment.render(samples=50000, **more)

    def on(self, stream):
        return unittest.mock.patch.object(sys, "stderr", stream)

    def test_scripts_print_nothing_unless_asked(self):
        with self.on(io.StringIO()) as stream:
            self.long()
            self.experiment.run(self.folder / "run")
            self.assertEqual(stream.getvalue(), "")
            self.long(progress=True)
            self.assertRegex(stream.getvalue(), r"^rendering the image: \d+ %")

    def test_terminals_have_a_bar_that_goes(self):
        with self.on(Terminal()) as stream:
            self.long()
            self.assertRegex(stream.getvalue(), r"\[#*\.+\] rendering the image: \d+ %")
            self.assertTrue(stream.getvalue().endswith("\r\x1b[K"))
            shown = len(stream.getvalue())
            self.long(progress=False)
            self.assertEqual(len(stream.getvalue()), shown)

    def test_callables_are_told(self):
        told = []
        self.long(progress=lambda *all: told.append(all))
        self.assertGreater(len(told), 2)
        self.assertTrue(all(0 <= part <= 1 for part, _, _ in told))
        self.assertEqual(told[-1][:2], (1.0, 1.0))
        self.assertTrue(all(math.isnan(loss) and total == 1 for _, total, loss in told))
        told.clear()
        run = self.experiment.run(self.folder / "run", progress=lambda *all: told.append(all))
        self.assertEqual(told, list(zip(range(4), [3] * 4, run.log["loss"])))

    def test_what_they_raise_ends_the_call(self):
        def fail(done, total, loss):
            raise ZeroDivisionError

        for call in (lambda: self.long(progress=fail), lambda: self.experiment.run(self.folder / "run", progress=fail)):
            with self.assertRaises(ZeroDivisionError):
                call()
        told = []
        self.long(progress=lambda *all: told.append(all))  # nothing is left of it
        self.assertGreater(len(told), 2)

    @lengths.long
    def test_notebooks_have_it_below_the_cell(self):
        shown = []

        class Handle:
            def update(self, data, raw):
                shown.append(data)

        def display(data, raw, display_id):
            shown.append(data)
            return Handle()

        fake = types.SimpleNamespace(get_ipython=lambda: types.SimpleNamespace(kernel=1), display=types.SimpleNamespace(display=display))
        with unittest.mock.patch.dict(sys.modules, {"IPython": fake, "IPython.display": fake.display}), self.on(io.StringIO()) as stream:
            self.long()
            self.assertIn("<progress", shown[0]["text/html"])
            self.assertEqual(shown[-1]["text/plain"], "")
            slow = isochron.Experiment.from_dict(description(samples={"primal": 8000, "interior": 8, "visibility": 8, "path_length": 0},
                                                             optimizer={"method": "adam", "iterations": 2}))
            slow.run(self.folder / "run", callback=lambda row: self.long() is None)
            self.assertRegex(shown[-1]["text/plain"], r"^iteration 2/2  loss \S+, \d+ s$")
            self.assertFalse([data for data in shown[-8:] if "rendering the image" in data["text/plain"]])
            self.assertEqual(stream.getvalue(), "")


if __name__ == "__main__":
    lengths.main()
