#!/usr/bin/python3
"""Sessions of Python: without target values, in several threads, beside h5py, and with optimisers of others.

usage: python_sessions_test.py PACKAGES     PACKAGES: the folder that holds the package with its extension
"""

import pathlib
import sys
import tempfile
import threading
import unittest

PACKAGES = sys.argv.pop(1)
sys.path.insert(0, PACKAGES)
import h5py
import isochron
import numpy as np
import scipy.optimize

WALL = np.stack(np.meshgrid(np.linspace(-0.2, 0.2, 6), np.linspace(0.2, -0.2, 5), [0.0], indexing="ij"), axis=-1)[:, :, 0]
SCENE = """\
capture: {file: capture.h5}
materials:
  paper: {type: diffuse, albedo: 0.5, two_sided: true}
shapes:
  - {name: board, file: board.obj, material: paper, transform: {translate: [0, 0, 0.5]}}
"""
BOARD = "v -0.2 -0.15 0\nv 0.25 -0.15 0\nv 0.25 0.2 0\nv -0.2 0.2 0\nf 1 2 3 4\n"
EXPERIMENT = """\
name: board
scene: scene.yaml
max_bounces: 1
gates: {kind: bins, unit: ps, scene_unit_m: 1, start: 3000, width: 64, count: 20}
parameters:
  - {name: paint, type: albedo, material: paper, initial: 0.8}
samples: {primal: 64, interior: 64, visibility: 0, path_length: 0}
"""
METRES_PER_PS = 299792458e-12


class SessionTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        counts = np.zeros((20, 6, 5))
        self.write_counts(counts)
        (self.folder / "scene.yaml").write_text(SCENE)
        (self.folder / "board.obj").write_text(BOARD)
        self.file = self.folder / "board.yaml"
        self.file.write_text(EXPERIMENT)

    def write_counts(self, counts):
        isochron.write_capture(self.folder / "capture.h5", counts, 64 * METRES_PER_PS, 3000 * METRES_PER_PS, WALL, [0, 0, 1])

    def test_without_target_values_it_renders(self):
        experiment = isochron.Experiment(self.file)
        self.assertEqual(experiment.render().shape, (20, 5, 6, 1))
        self.assertEqual(experiment.jvp(None, [1.0]).shape, (20, 5, 6, 1))
        self.assertTrue(np.isnan(experiment.parameters["paint"].target))
        for action in (lambda: experiment.target, experiment.evaluate, experiment.gradient, lambda: experiment.run(self.folder / "run")):
            with self.assertRaisesRegex(isochron.InputError, r"parameters\[0\].target: is missing"):
                action()
        with self.assertRaisesRegex(isochron.InputError, "samples"):
            isochron.Experiment(self.file, {"samples.primal": -1})

    def test_captures_of_several_spots(self):
        """As grids and in no order, written, read and rendered; counts of known gain are fitted."""
        spots = np.array([[-0.15, 0.1, 0], [0.1, 0.12, 0], [0.0, -0.1, 0]])
        layouts = {"grids": (WALL, spots[:, np.newaxis], (3, 1, 6, 5)), "spots in no order": (WALL, spots, (3, 6, 5)),
                   "none in order": (WALL.reshape(-1, 3), spots, (3, 30)), "one spot": (WALL, spots[0], (6, 5)),
                   "one spot, points in no order": (WALL.reshape(-1, 3), spots[0], (30,))}
        images = {}
        for name, (points, laser, shape) in layouts.items():
            counts = np.arange(20 * np.prod(shape)).reshape(20, *shape)
            path = self.folder / "capture.h5"
            isochron.write_capture(path, counts, 64 * METRES_PER_PS, 3000 * METRES_PER_PS, points, [0, 0, 1], laser,
                                   laser_normal=[0, 0.1, 1])
            read = isochron.read_capture(path)
            np.testing.assert_array_equal(read.counts.ravel(), counts.ravel(), err_msg=name)
            np.testing.assert_allclose(read.laser.reshape(-1, 3), np.reshape(laser, (-1, 3)))
            np.testing.assert_array_equal(read.laser_normals.reshape(-1, 3)[-1], [0, 0.1, 1])
            before = path.read_bytes()
            read.write(path)  # what was read is written the same
            self.assertEqual(len(path.read_bytes()), len(before))
            experiment = isochron.Experiment(self.file, {"max_bounces": 1})
            images[name] = experiment.render(samples=256)
            where = images[name].coordinates
            for spot in range(0, images[name].shape[1], images[name].shape[1] // max(1, np.size(laser) // 3)):
                self.assertTrue((np.abs(spots - where.spots[spot, 0]).sum(axis=1) < 1e-9).any(), name)
        np.testing.assert_array_equal(images["grids"], images["spots in no order"])
        # A pixel's random numbers are its own, and points in no order are other pixels.
        flat = images["none in order"].reshape(20, 3, 30).sum(axis=(0, 2))
        np.testing.assert_allclose(images["grids"].reshape(20, 3, 30).sum(axis=(0, 2)), flat, rtol=0.05)

    def test_several_spots_are_fitted(self):
        spots = np.array([[-0.15, 0.1, 0], [0.1, 0.12, 0]])
        write = lambda counts: isochron.write_capture(self.folder / "capture.h5", counts, 64 * METRES_PER_PS, 3000 * METRES_PER_PS,
                                                      WALL, [0, 0, 1], spots)
        write(np.zeros((20, 2, 6, 5)))
        truth = isochron.Experiment(self.file).render({"paint": 0.5}, samples=4096)  # [bin, spots x 5 rows, 6 columns, 1]
        write(np.asarray(truth).reshape(20, 2, 5, 6).transpose(0, 1, 3, 2))
        fit = isochron.Experiment(self.file, {"target.capture": "capture.h5", "parameters[0].initial": 0.8,
                                              "optimizer": {"method": "levenberg_marquardt", "iterations": 6}})
        np.testing.assert_allclose(np.asarray(fit.target), np.asarray(truth), rtol=1e-6)
        self.assertAlmostEqual(float(fit.run(self.folder / "run").values["paint"]), 0.5, delta=0.02)

    def test_captures_that_do_not_fit_are_refused(self):
        for counts, points, laser, wrong in (((20, 6, 5), WALL[:5], None, "do not fit points"),
                                             ((20, 2, 6, 5), WALL, np.zeros((3, 3)), r"do not fit points of \(6, 5\) and spots of \(3, 1\)"),
                                             ((20, 2, 6, 5), WALL, None, "do not fit"), ((20, 6, 5), WALL, np.zeros((2, 2)), "spots of the laser of"),
                                             ((20, 6, 5), WALL[..., :2], None, "points of")):
            with self.assertRaisesRegex(isochron.InputError, "^.*capture.h5: .*" + wrong):
                isochron.write_capture(self.folder / "capture.h5", np.zeros(counts), 0.01, 0, points, [0, 0, 1], laser)

    def test_threads_share_a_target(self):
        """Several threads ask for the first evaluation at once, while another keeps taking the interpreter's lock."""
        expected = isochron.Experiment(self.file, {"parameters[0].target": 0.4}).evaluate()
        for _ in range(5):
            experiment, found, done = isochron.Experiment(self.file, {"parameters[0].target": 0.4}), [], threading.Event()

            def work(experiment=experiment, found=found):
                evaluation = experiment.evaluate()
                found.append((evaluation.loss, evaluation.gradient.tolist(), float(experiment.target.sum())))

            def hold(done=done):
                while not done.is_set():
                    sum(range(1000))

            holder = threading.Thread(target=hold)
            threads = [threading.Thread(target=work) for _ in range(4)]
            holder.start()
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            done.set()
            holder.join()
            self.assertEqual(len(found), 4)
            self.assertEqual(len({str(each) for each in found}), 1)
            self.assertEqual((found[0][0], found[0][1]), (expected.loss, expected.gradient.tolist()))

    def test_h5py_beside_experiments(self):
        stop, failures = threading.Event(), []

        def use_h5py():
            path = self.folder / "other.h5"
            while not stop.is_set():
                try:
                    with h5py.File(path, "w") as file:
                        file["a"] = np.arange(1000.0)
                    with h5py.File(path, "r") as file:
                        if file["a"][999] != 999:
                            failures.append("another value")
                except Exception as error:  # noqa: BLE001 any at all is the failure
                    failures.append(repr(error))

        thread = threading.Thread(target=use_h5py)
        thread.start()
        try:
            for _ in range(20):
                self.assertEqual(isochron.Experiment(self.file).render(samples=2).shape, (20, 5, 6, 1))
        finally:
            stop.set()
            thread.join()
        self.assertEqual(failures, [])

    def test_within_h5py(self):
        """h5py calls back with its lock: who waited for it in another thread would wait for ever."""
        found = []
        with h5py.File(self.folder / "other.h5", "w") as file:
            file["a"] = 1
            file.visit(lambda name: found.append(isochron.Experiment(self.file)))
        self.assertEqual(len(found), 1)
        # h5py's errors are as they were.
        with self.assertRaises(OSError):
            h5py.File(self.folder / "none.h5", "r")

    def test_negative_and_dead_counts(self):
        image = isochron.Experiment(self.file).render({"paint": 0.4}, samples=1024)
        counts = np.moveaxis(np.asarray(image)[..., 0], 1, 2).astype(float)
        counts += 1e-3 * counts.max() * np.where(np.indices(counts.shape).sum(axis=0) % 2, 1, -1)  # some below zero
        counts[3, 2, 2] = np.nan
        self.write_counts(counts)
        target = {"target": {"capture": str(self.folder / "capture.h5")}}
        with self.assertRaisesRegex(isochron.InputError, "nan at column 2, row 2, gate 3 .*target.mask"):
            isochron.Experiment(self.file, target)
        mask = np.ones((6, 5))
        mask[2, 2] = 0
        np.save(self.folder / "mask.npy", mask)
        target["target"]["mask"] = str(self.folder / "mask.npy")
        with self.assertRaisesRegex(isochron.InputError, "is no count .*loss.kind: poisson"):
            isochron.Experiment(self.file, target | {"loss": {"kind": "poisson"}})
        # Beside the noise of 64 samples the ratio is 0.05 to 0.12 with other random numbers.
        experiment = isochron.Experiment(self.file, target | {"samples.primal": 1024})
        self.assertTrue(np.isfinite(np.asarray(experiment.target)).all())
        self.assertLess(experiment.target.min(), 0)
        self.assertLess(experiment.evaluate({"paint": 0.4}).loss, 0.1 * experiment.evaluate({"paint": 0.8}).loss)

    def test_small_losses(self):
        """Of a scene so dim that L-BFGS-B by itself is content with where it starts."""
        dim = isochron.Experiment(self.file, {"parameters[0].target": 0.4, "gates.width": 64})
        factor = 1e-3 / np.sqrt(dim.evaluate().loss)
        parameters = ("parameters", [{"name": "paint", "type": "albedo", "material": "paper", "initial": 0.8, "target": 0.4},
                                     {"name": "gain", "type": "gain", "initial": factor, "target": factor, "lower": 0.999 * factor,
                                      "upper": 1.001 * factor}])
        dim = isochron.Experiment(self.file, dict([parameters]))
        plain = scipy.optimize.minimize(dim.loss_and_gradient, dim.initial, jac=True, method="L-BFGS-B",
                                        bounds=list(zip(dim.lower, dim.upper)))
        self.assertTrue(plain.success)
        self.assertGreater(abs(plain.x[0] - 0.4), 0.05)
        problem = dim.scaled()
        self.assertAlmostEqual(problem.loss_and_gradient(problem.initial)[0], 1)
        found = problem.theta(scipy.optimize.minimize(problem.loss_and_gradient, problem.initial, jac=True, method="L-BFGS-B",
                                                      bounds=problem.bounds).x)
        self.assertAlmostEqual(found[0], 0.4, delta=0.02)


if __name__ == "__main__":
    unittest.main()
