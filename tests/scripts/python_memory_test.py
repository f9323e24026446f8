#!/usr/bin/python3
"""Experiments of dictionaries and arrays: the bits of the same ones in files, runs, errors that name keys, and no files left.

usage: python_memory_test.py PROGRAM PACKAGES     PACKAGES: the folder that holds the package with its extension
"""

import copy
import gc
import io
import os
import pathlib
import pickle
import subprocess
import sys
import tempfile
import unittest
import warnings

PROGRAM, PACKAGES = sys.argv[1:3]
del sys.argv[1:3]
sys.path.insert(0, PACKAGES)
import isochron
import numpy as np
import yaml
from isochron.mesh_files import read_mesh
from seeds import generator

WALL = np.stack(np.meshgrid(np.linspace(-0.2, 0.2, 5), np.linspace(0.2, -0.2, 4), [0.0], indexing="ij"), axis=-1)[:, :, 0]
METRES_PER_PS = 299792458e-12
THIRD = 1 / 3  # has no short decimals
POINTS = np.array([[-0.2, -0.15, 0], [0.25, -0.15, 0], [0.25, THIRD - 0.13, 0], [-0.2, 0.2, 0.01]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
OFFSETS, RESPONSE = np.arange(100) * 4.0, np.exp(-np.arange(100) / 25)
MASK = np.ones((5, 4), bool)
MASK[2, 1] = False


def text_of(vertices, triangles):
    """OBJ, with all digits."""
    return "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in vertices.tolist()) + "".join(f"f {a} {b} {c}\n" for a, b, c in triangles + 1)


def board(target):
    """A capture's experiment."""
    scene = {"capture": {"file": target["capture"]},
             "materials": {"paper": {"type": "diffuse", "albedo": 0.5, "two_sided": True}},
             "shapes": [{"name": "board", "vertices": POINTS, "triangles": TRIANGLES, "material": "paper",
                         "transform": {"translate": np.array([0, 0, 0.5])}}]}
    return {"name": "board", "scene": scene, "max_bounces": 1,
            "gates": {"kind": "bins", "unit": "ps", "scene_unit_m": 1, "start": 3000, "width": 64, "count": 20,
                      "response": (OFFSETS, RESPONSE)},
            "target": target,
            "parameters": [{"name": "corners", "type": "vertices", "shape": "board", "direction": "free", "initial": POINTS / 30},
                           {"name": "gain", "type": "gain", "initial": np.float64(300), "lower": 1}],
            "samples": {"primal": 16, "interior": 16, "visibility": 16, "path_length": 0},
            "optimizer": {"method": "adam", "learning_rate": 0.001, "iterations": 3}}


def measurement():
    rng = generator(61)
    return isochron.Capture(counts=rng.poisson(20, (20, 5, 4)).astype(float), points=WALL, normals=np.array([0.0, 0, 1]), laser=None,
                            delta_t=64 * METRES_PER_PS, t_start=3000 * METRES_PER_PS, origins=None)


def room():
    def square(height, size, up):
        corners = np.array([[-size, height, -size], [-size, height, size], [size, height, size], [size, height, -size]])
        return {"vertices": corners[:: 1 if up else -1], "triangles": TRIANGLES}

    materials = {"white": {"type": "diffuse", "albedo": [0.6, 0.5, 0.4]}, "metal": {"type": "rough_conductor", "roughness": 0.3,
                                                                                   "reflectance": 0.9}}
    scene = {"camera": {"position": [0.2, 2.5, 2.5], "look_at": [0, 0, 0], "up": (0, 1, 0), "fov": 40, "resolution": [12, 10]},
             "materials": materials,
             "shapes": [{"name": "floor", "material": "white", **square(0, 2, True)},
                        {"name": "block", "material": "metal", **square(0.5, 0.5, True)},
                        {"name": "lamp", "material": "white", "emission": 10, **square(2, 0.5, False)}]}
    return {"name": "room", "scene": scene, "max_bounces": 2,
            "gates": {"kind": "gaussian", "centers": np.array([4.5, 5.5]), "sigma": 0.3},
            "parameters": [{"name": "turn", "type": "rotation", "shape": "block", "axis": [0, 0, 1], "initial": 5}],
            "samples": {"primal": 8, "interior": 8, "visibility": 8, "path_length": 0}}


class MemoryTest(unittest.TestCase):
    def setUp(self):
        self.enterContext(warnings.catch_warnings(action="ignore"))  # so few samples that gates are dark
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        self.scratch = self.folder / "scratch"
        self.scratch.mkdir()
        before = tempfile.tempdir
        tempfile.tempdir = str(self.scratch)
        self.addCleanup(setattr, tempfile, "tempdir", before)

    def assert_nothing_left(self):
        gc.collect()
        self.assertEqual(list(self.scratch.iterdir()), [])

    def write(self, description):
        """The same experiment in files, written by other means: text where the program takes it."""
        description = copy.deepcopy(description)
        scene, target = description["scene"], description.setdefault("target", {})
        for shape in scene["shapes"]:
            shape["file"] = f"{shape['name']}.obj"
            (self.folder / shape["file"]).write_text(text_of(shape.pop("vertices"), shape.pop("triangles")))
            if "transform" in shape:
                shape["transform"] = {"translate": [0, 0, 0.5]}
        if "capture" in scene:
            some = target["capture"]
            isochron.write_capture(self.folder / "some.h5", some.counts, some.delta_t, some.t_start, some.points, some.normals)
            scene["capture"]["file"] = target["capture"] = "some.h5"
            table = "".join(f"{a!r},{b!r}\n" for a, b in zip(OFFSETS.tolist(), RESPONSE.tolist()))
            (self.folder / "irf.csv").write_text(table)
            (self.folder / "start.txt").write_text("\n".join(map(repr, (POINTS / 30).ravel().tolist())))
            description["gates"]["response"] = "irf.csv"
            description["parameters"][0]["initial"], description["parameters"][1]["initial"] = "start.txt", 300
        if "mask" in target:
            np.save(self.folder / "some.npy", target["mask"])
            target["mask"] = "some.npy"
        if "images" in target:
            isochron.write_exr(self.folder / "some.exr", {f"gate{g:03d}.{c}": image[..., i] for g, image in enumerate(target["images"])
                                                          for i, c in enumerate("RGB")})
            target["images"] = "some.exr"
            scene["camera"]["up"] = [0, 1, 0]
            description["gates"]["centers"] = [4.5, 5.5]
        description["scene"] = "some_scene.yaml"
        (self.folder / "some_scene.yaml").write_text(yaml.safe_dump(scene))
        (self.folder / "some.yaml").write_text(yaml.safe_dump(description))
        return self.folder / "some.yaml"

    def cases(self):
        images = generator(62).uniform(0, 1, (2, 10, 12, 3))
        return (board({"capture": measurement(), "mask": MASK}), room() | {"target": {"images": images}})

    def test_bits_are_those_of_files(self):
        for description in self.cases():
            file = self.write(description)
            memory = isochron.Experiment.from_dict(description)
            saved = isochron.Experiment(memory.save(self.folder / "saved"))
            for other in (isochron.Experiment(file), saved):
                with self.subTest(name=memory.name, saved=other is saved):
                    np.testing.assert_array_equal(memory.initial, other.initial)
                    np.testing.assert_array_equal(memory.target, other.target)
                    np.testing.assert_array_equal(memory.render(), other.render())
                    np.testing.assert_array_equal(memory.jvp(None, np.ones_like(memory.initial)), other.jvp(None, np.ones_like(memory.initial)))
                    mine, theirs = memory.evaluate(), other.evaluate()
                    self.assertEqual(mine.loss, theirs.loss)
                    np.testing.assert_array_equal(mine.gradient, theirs.gradient)
                    self.assertGreater(np.abs(mine.gradient).max(), 0)
            del memory
        self.assert_nothing_left()

    def test_runs(self):
        """From memory and by the command from what was saved; one that was stopped goes on without the experiment."""
        description = board({"capture": measurement(), "mask": MASK})
        experiment = isochron.Experiment.from_dict(description)
        run = experiment.run(self.folder / "whole")
        file = experiment.save(self.folder / "saved")
        done = subprocess.run([PROGRAM, "run", file, "-o", self.folder / "command", "--quiet", "--no-plots"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        experiment.run(self.folder / "stopped", callback=lambda row: row.iteration == 1)
        del experiment
        self.assert_nothing_left()
        resumed = isochron.resume(self.folder / "stopped")
        self.assertEqual((run.status, resumed.status), ("iterations_reached", "iterations_reached"))
        self.assertNotEqual(run.values["gain"], 300)
        for other in (resumed, isochron.read_run(self.folder / "command")):
            for name, values in run.values.items():
                np.testing.assert_array_equal(values, other.values[name])
        vertices, triangles = read_mesh(run.folder / "inputs/scene/board.ply")
        np.testing.assert_array_equal(vertices, POINTS)
        np.testing.assert_array_equal(triangles, TRIANGLES)

    def test_errors_name_keys(self):
        def changed(path, value):
            description = board({"capture": measurement(), "mask": MASK})
            *way, last = path
            inner = description
            for key in way:
                inner = inner[key]
            inner[last] = value
            return description

        shape = ("scene", "shapes", 0)
        nan = np.where(np.arange(12).reshape(4, 3) == 7, np.nan, POINTS)
        for path, value, words in (
            ((*shape, "vertices"), np.zeros((5, 2)), "scene.shapes[0].vertices: expected [N, 3], got (5, 2)"),
            ((*shape, "vertices"), [[1, 2, 3], [1, 2]], "scene.shapes[0].vertices: expected [N, 3], got rows of different lengths"),
            ((*shape, "vertices"), nan, "scene.shapes[0].vertices: vertex 2 is not finite"),
            ((*shape, "vertices"), np.zeros((4, 3)), "scene.shapes[0].vertices: has no face with an area"),
            ((*shape, "triangles"), TRIANGLES + 0.0, "scene.shapes[0].triangles: expected integers [M, 3], got elements of type float64"),
            ((*shape, "triangles"), [[0, 1, 4]], "scene.shapes[0].triangles: triangle 0, [0, 1, 4], has a vertex that is not there"),
            ((*shape, "file"), "a.obj", "scene.shapes[0].file: stands beside an array"),
            ((*shape, "material"), "glass", "scene.shapes[0].material: "),
            (("scene", "materials", "paper", "albedo"), -1, "scene.materials.paper.albedo: -1 is out of range"),
            (("scene",), "none.yaml", "scene: there is no file 'none.yaml'"),
            (("gates", "width"), object(), "gates.width: object has no YAML"),
            (("gates", "width"), np.nan, "gates.width: '.nan' is not a finite number"),
            (("gates", "response"), (OFFSETS, RESPONSE[1:]), "gates.response: expected a file, or a pair of arrays"),
            (("gates", "response"), (OFFSETS, -RESPONSE), "gates.response: "),
            (("parameters", 0, "initial"), np.array([1.0, np.inf]), "parameters[0].initial: value 1 is not finite"),
            (("parameters", 0, "initial"), np.zeros(5), "parameters[0].initial: "),
            (("target", "mask"), np.ones((4, 5)), "target.mask: an array of [4, 5] (allowed: [5, 4]"),
            (("target", "mask"), np.zeros((5, 4)), "target.mask: leaves no pixel"),
            (("target", "images"), np.ones((2, 3)), "target.images: expected [gate, row, column, channel]"),
            (("target", "capture"), isochron.Capture(np.ones((20, 3, 3)), WALL, np.array([0.0, 0, 1]), None, 1.0, 0.0, None),
             "target.capture: counts of (20, 3, 3) do not fit"),
        ):
            with self.subTest(words):
                with self.assertRaises(isochron.InputError) as caught:
                    isochron.Experiment.from_dict(changed(path, value)).target  # noqa: B018 reads the mask
                line = str(caught.exception)
                self.assertEqual(line[:len(words)], words)
                self.assertNotIn(str(self.scratch), line)
                self.assertNotIn("\n", line)
        with self.assertRaisesRegex(isochron.InputError, "expected a dictionary"):
            isochron.Experiment.from_dict("board.yaml")
        with self.assertRaisesRegex(isochron.InputError, "save: the experiment board has its files already"):
            isochron.Experiment(self.write(board({"capture": measurement()}))).save(self.folder / "saved")
        self.assert_nothing_left()

    def test_copies(self):
        """All kinds live on without the first."""
        experiment = isochron.Experiment.from_dict(room())
        expected = experiment.render()
        copies = [action(experiment) for action in (copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one)))]
        del experiment
        gc.collect()
        for number, again in enumerate(copies):
            np.testing.assert_array_equal(again.render(), expected)
            self.assertTrue(again.save(self.folder / f"copy{number}").exists())
        del copies, again
        gc.collect()
        self.assert_nothing_left()

    def test_nothing_is_left_at_the_end(self):
        code = """
import os, python_memory_test as t
kept = t.isochron.Experiment.from_dict(t.room())
if os.fork() == 0:
    raise SystemExit  # ends before its parent uses the files
os.wait()
kept.save("saved")
raise RuntimeError("the end")
"""
        words = f"import sys\nsys.argv = ['', '', {os.path.abspath(PACKAGES)!r}]\n{code}"
        done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, cwd=self.folder,
                              env={**os.environ, "TMPDIR": str(self.scratch), "PYTHONPATH": str(pathlib.Path(__file__).parent)})
        self.assertIn("the end", done.stderr)
        self.assertTrue((self.folder / "saved/experiment.yaml").exists())
        self.assert_nothing_left()

    def test_images_show_themselves(self):
        from PIL import Image

        experiment = isochron.Experiment.from_dict(room())
        image = experiment.render()
        for name, shown in (("colours", image), ("grey", isochron.Image(image[..., :1], image.coordinates)), ("signed", image - image.mean())):
            with self.subTest(name), Image.open(io.BytesIO(shown._repr_png_())) as picture:
                self.assertEqual(picture.format, "PNG")
                colours = np.asarray(picture.convert("RGB"), int).reshape(-1, 3)
                self.assertGreater(np.count_nonzero(np.ptp(colours, axis=1) > 20), 1000)  # axes and text are grey
        self.assertIsNone(image[0]._repr_png_())

    def test_example(self):
        done = subprocess.run([sys.executable, pathlib.Path(isochron.__file__).resolve().parents[1] / "examples/fit_arrays.py", self.folder / "run"],
                              capture_output=True, text=True, env={**os.environ, "PYTHONPATH": os.path.abspath(PACKAGES)})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLess(float(done.stdout.split("error: ")[1].split()[0]), 0.02)  # of 0.2; what noise leaves is 0.0014

    def test_captures_in_no_order(self):
        """Of points without a grid, from two spots: counts [bin, spot, point]."""
        rng = generator(63)
        points, spots = WALL.reshape(-1, 3), WALL[[0, 2], 1]
        some = isochron.Capture(rng.poisson(20, (20, 2, 20)), points, np.array([0.0, 0, 1]), spots, 64 * METRES_PER_PS, 0.0, None)
        some.write(self.folder / "list.h5")
        again = isochron.read_capture(self.folder / "list.h5")
        np.testing.assert_array_equal(again.counts.reshape(some.counts.shape), some.counts)
        np.testing.assert_array_equal(again.points.reshape(-1, 3), points)
        np.testing.assert_array_equal(again.laser.reshape(-1, 3), spots)
        again.write(self.folder / "again.h5")
        np.testing.assert_array_equal(isochron.read_capture(self.folder / "again.h5").counts, again.counts)
        # Files of confocal ones name the points as the laser's.
        measurement().write(self.folder / "confocal.h5")
        isochron.read_capture(self.folder / "confocal.h5").write(self.folder / "again.h5")
        self.assertEqual(isochron.read_capture(self.folder / "again.h5").counts.shape, (20, 5, 4))


if __name__ == "__main__":
    unittest.main()
