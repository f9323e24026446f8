#!/usr/bin/python3
"""scripts/import_capture.py on small files of every kind that it knows."""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
sys.path.insert(0, str(SCRIPTS))
import h5py
import numpy as np
import scipy.io
import import_capture
from captures import response
from in_process import run_main
from seeds import generator

C = 299792458e-12  # metres in a picosecond


def numbered(*shape):
    return np.arange(np.prod(shape)).reshape(shape).astype(np.uint16)


def write_matlab_73(path, arrays):
    """HDF5 behind a header of 512 bytes; axes in reverse order."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, array in arrays.items():
            file[name] = np.asarray(array).T
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, HDF5 schema 1.00 .".ljust(124) + b"\x00\x02IM")


class ImportTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.out = self.folder / "out.h5"

    def run_script(self, name, *options):
        """In this process; test_output_that_cannot_be_written starts one."""
        return run_main(import_capture.main, self.folder / name, self.out, *options)

    def imported(self, name, *options):
        result = self.run_script(name, *options)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        with h5py.File(self.out, "r") as file:
            return {key: value[()] for key, value in file.items()}

    def assert_fails(self, words, name, *options):
        result = self.run_script(name, *options)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertRegex(result.stderr, rf"\Aimport_capture\.py: .*{words}.*\n\Z")
        self.assertNotIn(self.out, list(self.folder.iterdir()))

    def save(self, name, **arrays):
        path = self.folder / name
        if path.suffix == ".mat":
            scipy.io.savemat(path, arrays)
        elif path.suffix == ".npz":
            np.savez(path, **arrays)
        else:
            np.save(path, *arrays.values())

    def test_light_cone_transform_data(self):
        counts = numbered(4, 3, 8)
        self.save("five.mat", rect_data=counts, width=0.35)
        write_matlab_73(self.folder / "seven.mat", {"rect_data": counts, "width": [[0.35]]})
        (self.folder / "plain.mat").write_bytes((self.folder / "seven.mat").read_bytes()[512:])  # as of h5py and Octave
        for name in ("five.mat", "seven.mat", "plain.mat"):
            file = self.imported(name)
            np.testing.assert_array_equal(file["H"], counts.transpose(2, 0, 1))
            self.assertEqual(file["H"].dtype, np.float32)
            self.assertAlmostEqual(file["delta_t"], 4 * C, delta=1e-15)
            self.assertEqual(file["t_start"], 0)
            np.testing.assert_allclose(file["sensor_grid_xyz"][:, 0, 0], np.linspace(-0.35, 0.35, 4))
            np.testing.assert_allclose(file["sensor_grid_xyz"][0, :, 1], [0.35, 0, -0.35], atol=1e-15)
            np.testing.assert_array_equal(file["laser_grid_xyz"], file["sensor_grid_xyz"])
            np.testing.assert_array_equal(file["sensor_grid_normals"], np.broadcast_to([0, 0, 1.0], (4, 3, 3)))
            self.assertFalse(file["t_accounts_first_and_last_bounces"])
            self.assertEqual((file["H_format"][0], file["sensor_grid_format"][0]), (1, 2))
            self.assertEqual(file["scene_info"], b"{original_format: light-cone transform}")

    def test_bins_rebin_stride_and_flip(self):
        counts = numbered(5, 4, 11)
        self.save("in.mat", rect_data=counts, width=1.0)
        file = self.imported("in.mat", "--bins", 2, 9, "--rebin", 3, "--stride", 2, "--flip", "y", "--bin-ps", 8)
        # Rows 0 and 2 of the array are kept; reversed they are rows 3 and 1 of the wall.
        expected = counts[::2, ::2, 2:8].reshape(3, 2, 2, 3).sum(axis=3)[:, ::-1]
        np.testing.assert_array_equal(file["H"], expected.transpose(2, 0, 1))
        self.assertAlmostEqual(file["delta_t"], 24 * C, delta=1e-15)
        self.assertAlmostEqual(file["t_start"], 16 * C, delta=1e-15)
        np.testing.assert_allclose(file["sensor_grid_xyz"][0, :, 1], [1 / 3, -1])
        np.testing.assert_allclose(file["sensor_grid_xyz"][:, 0, 0], [-1, 0, 1])

    def test_fk_migration_data_are_aligned(self):
        arrival = np.array([[5, 7, 9, 6], [8, 5, 6, 7], [9, 9, 5, 8]])  # bins; [Y, X]
        counts = np.zeros((3, 4, 40))
        for y, x in np.ndindex(3, 4):
            counts[y, x, arrival[y, x] :][:20] = 100 * y + 10 * x + np.arange(20)[::-1] + 1
        tof = 32.0 * arrival + np.linspace(-15, 15, 12).reshape(3, 4)
        self.save("both.mat", meas=counts, tofgrid=tof)
        self.save("tof.mat", tofgrid=tof)
        write_matlab_73(self.folder / "apart.mat", {"meas": counts})
        for name, options in (("both.mat", ()), ("apart.mat", ("--tof", self.folder / "tof.mat"))):
            file = self.imported(name, *options)
            self.assertEqual(file["H"].shape, (31, 4, 3))
            for y, x in np.ndindex(3, 4):
                self.assertEqual(file["H"][0, 3 - x, y], 100 * y + 10 * x + 20)
            self.assertEqual(file["t_start"], 0)
            self.assertAlmostEqual(file["delta_t"], 32 * C, delta=1e-15)
            np.testing.assert_allclose(file["sensor_grid_xyz"][:, 0, 0], np.linspace(-1, 1, 4))
        file = self.imported("both.mat", "--bins", -3, 10)
        self.assertAlmostEqual(file["t_start"], -96 * C, delta=1e-15)
        self.assertEqual(file["H"][:3].max(), 0)
        self.assertEqual(file["H"][3, 0, 0], 30 + 20)
        self.save("short.mat", tofgrid=tof[:2])
        self.assert_fails("short.mat: tofgrid is of 4 x 2 points, the counts of 4 x 3", "apart.mat", "--tof",
                          self.remove_output() / "short.mat")
        self.save("late.mat", tofgrid=tof + 2000)
        self.assert_fails("times outside the 1280 ps", "apart.mat", "--tof", self.folder / "late.mat")

    def remove_output(self):
        self.out.unlink()
        return self.folder

    def test_arrays(self):
        counts = numbered(3, 2, 6)
        self.save("a.npy", a=counts.transpose(2, 1, 0))
        file = self.imported("a.npy", "--axes", "TYX", "--bin-ps", 10, "--width", 0.5, "--t-start-ps", -20, "--normal",
                             0, 3, 4, "--laser", 1, 2, 3)
        np.testing.assert_array_equal(file["H"], counts.transpose(2, 0, 1))
        self.assertAlmostEqual(file["t_start"], -20 * C, delta=1e-15)
        np.testing.assert_array_equal(file["laser_grid_xyz"], [[[1, 2, 3]]])
        np.testing.assert_allclose(file["laser_grid_normals"], [[[0, 0.6, 0.8]]])
        np.testing.assert_allclose(file["sensor_grid_normals"], np.broadcast_to([0, 0.6, 0.8], (3, 2, 3)))
        points = np.arange(9.0).reshape(3, 3)
        self.save("p.npy", p=points)
        self.save("b.npz", other=counts, counts=counts[:, 0])
        file = self.imported("b.npz", "--variable", "counts", "--axes", "XT", "--bin-ps", 10, "--points",
                             self.folder / "p.npy")
        np.testing.assert_array_equal(file["H"], counts[:, 0].T[..., np.newaxis])
        np.testing.assert_array_equal(file["sensor_grid_xyz"], points[:, np.newaxis])

    def write_pulse(self, jitter, begin=100, dark=0.5, seed=1):
        """Photons of a pulse that rises for 10 bins and decays with 60, from bin `begin`, and the truth's mean in bins
        behind `begin`."""
        random = generator(seed)
        time = np.arange(1200.0)
        pulse = np.where(time < 10, time / 10, np.exp((10 - time) / 60))
        counts = np.empty((8, 8, 1500))
        for x, y in np.ndindex(8, 8):
            at = begin + random.integers(-jitter, jitter + 1)
            mean = np.zeros(3000)
            mean[1000 + at : 2200 + at] = 300 * pulse
            counts[x, y] = random.poisson(dark + mean[1000:2500])
        self.save("pulse.mat", rect_data=counts.astype(np.uint16), width=0.5)
        return (pulse * (time + 0.5)).sum() / pulse.sum()

    def response(self, *options):
        self.imported("pulse.mat", "--response", self.folder / "r.csv", *options)
        lines = (self.folder / "r.csv").read_text().splitlines()
        self.assertEqual(lines[0], "offset,value")
        offsets, values = np.array([[float(x) for x in line.split(",")] for line in lines[1:]]).T
        self.assertAlmostEqual(np.trapz(values, offsets), 1, delta=0.02)
        return offsets, values

    def test_response_keeps_its_place(self):
        mean = self.write_pulse(jitter=0)
        offsets, values = self.response("--rebin", 4, "--bins", 900, 1300)  # taken before these
        self.assertAlmostEqual(np.average(offsets, weights=values), 4 * (100 + mean), delta=8)
        self.assertLess(abs(offsets[0] - 400), 80)
        self.assertAlmostEqual(offsets[values.argmax()], 4 * 110, delta=12)
        # The decay: e^-1 of the peak after 60 bins.
        self.assertAlmostEqual(np.interp(440 + 240, offsets, values) / values.max(), np.exp(-1), delta=0.05)
        offsets, _ = self.response("--response-end", 800, "--t-start-ps", -400)
        self.assertEqual(offsets[-1], 800)
        self.assertLess(abs(offsets[0]), 80)

    def test_response_without_its_rise(self):
        self.write_pulse(jitter=0, begin=-10)
        offsets, values = self.response()
        self.assertEqual(offsets[0], 0)
        self.assertAlmostEqual(np.average(offsets, weights=values), 240, delta=8)

    def test_response_is_aligned(self):
        mean = self.write_pulse(jitter=12)
        offsets, values = self.response()
        self.assertAlmostEqual(np.average(offsets, weights=values), 4 * (100 + mean), delta=15)
        rise = [offsets[values > part * values.max()][0] for part in (0.05, 0.9)]
        self.assertLess(rise[1] - rise[0], 50)  # 34 ps of the pulse itself; 72 where points are not aligned
        shifts = response.alignment(np.zeros((100, 2, 2)), 0.0, 16)
        self.assertEqual(shifts.tolist(), [0, 0, 0, 0])

    def test_start_of_a_fit(self):
        """Counts of a plane of albedo 0.01 at 0.5 m with gain 1000 over a background of 3, by quadrature."""
        points, bins, bin_ps = np.linspace(-0.1, 0.1, 3), 300, 64
        cell = 4 / 500
        x, y = np.meshgrid(*2 * [(np.arange(500) + 0.5) * cell - 2])
        counts = np.full((3, 3, bins), 3.0)
        for i, j in np.ndindex(3, 3):
            distance = np.sqrt((x - points[i]) ** 2 + (y + points[j]) ** 2 + 0.25)
            light = 0.01 / np.pi * (0.5 / distance) ** 4 / (np.pi**2 * distance**4) * cell**2
            number = (2 * distance / (bin_ps * C)).astype(int)
            counts[i, j] += 1000 / (bin_ps * C) * np.bincount(number.ravel(), light.ravel(), bins)[:bins]
        self.save("plane.npy", a=counts)
        options = ("--bin-ps", bin_ps, "--width", 0.1)
        said = self.run_script("plane.npy", *options, "--bins", 0, bins).stdout
        words = re.search(r"albedo 0\.01, gain (\S+) z\^2 \(z: depth, metres\), background (\S+)\n\Z", said)
        self.assertIsNotNone(words, said)
        self.assertAlmostEqual(float(words[1]) * 0.25, 1000, delta=30)
        self.assertAlmostEqual(float(words[2]), 3, delta=0.05)
        self.assertNotIn("gain", self.run_script("plane.npy", *options).stdout)  # may have the wall's own light

    def test_what_cannot_be_used(self):
        self.save("a.npy", a=numbered(3, 2, 6))
        good = ("--bin-ps", 4, "--width", 1)
        self.assert_fails("none.mat: cannot be read: No such file", "none.mat")
        self.assert_fails(r"not a file of MATLAB, HDF5 or NumPy \(.mat, .hdf5, .h5, .npy, .npz\)", "a.txt")
        for name in ("bad.mat", "bad.npy", "bad.npz"):
            (self.folder / name).write_bytes(b"neither of them" * 50)
            self.assert_fails(f"{name}: cannot be read: ", name)
            (self.folder / name).write_bytes(b"short")
            self.assert_fails(f"{name}: cannot be read: ", name)
            (self.folder / name).write_bytes(b"")
            self.assert_fails(f"{name}: cannot be read: ", name)
        self.assert_fails(r"how long is a bin of array\? \(--bin-ps\)", "a.npy", "--width", 1)
        self.assert_fails(r"where are the points of array\? \(--width or --points\)", "a.npy", "--bin-ps", 4)
        self.assert_fails("array is 3 x 2 x 6, not one size for each axis of XT", "a.npy", *good, "--axes", "XT")
        self.assert_fails("no bins 3 to 9 by 1 in 0 to 6", "a.npy", *good, "--bins", 3, 9)
        self.assert_fails("no bins 0 to 6 by 7 in 0 to 6", "a.npy", *good, "--rebin", 7)
        self.assert_fails("p.npy: 4 x 1 points, the counts are of 3 x 2", "a.npy", "--bin-ps", 4, "--points",
                          self.saved("p.npy", np.zeros((4, 3))))
        self.assert_fails(r"p.npy: array is not \[X, Y, 3\] or \[N, 3\] points", "a.npy", "--bin-ps", 4, "--points",
                          self.saved("p.npy", np.zeros((3, 2))))
        self.assert_fails("there is no array b", "a.npy", *good, "--variable", "b")
        self.save("two.npz", a=numbered(2, 2, 3), b=numbered(2, 2, 3))
        self.assert_fails(r"which array holds the counts\? \(--variable NAME; there are: a, b\)", "two.npz", *good)
        self.assert_fails("--rebin: 0 is less than 1", "a.npy", *good, "--rebin", 0)
        self.assert_fails("--width: 0 is not positive", "a.npy", "--width", 0)
        self.assert_fails("--normal has no direction", "a.npy", *good, "--normal", 0, 0, 0)
        self.assert_fails("needs a confocal capture", "a.npy", *good, "--laser", 0, 0, 0, "--response", "r.csv")
        self.assert_fails("array has no direct light", "a.npy", *good, "--response", "r.csv")
        self.saved("a.npy", np.array([[[1.0, np.nan]]]))
        self.assert_fails("array has values that are not finite", "a.npy", *good)
        self.saved("a.npy", np.array([[[1.0, -1]]]))
        self.assert_fails("array has negative counts", "a.npy", *good)
        self.saved("a.npy", np.array([[["x"]]]))
        self.assert_fails("which array", "a.npy", *good)
        self.assert_fails("array holds no numbers", "a.npy", *good, "--variable", "array")

    def saved(self, name, array):
        self.save(name, a=array)
        return self.folder / name

    def test_output_that_cannot_be_written(self):
        self.save("in.mat", rect_data=numbered(2, 2, 3), width=1.0)
        self.out = self.folder / "none" / "out.h5"
        command = [sys.executable, SCRIPTS / "import_capture.py", self.folder / "in.mat", self.out]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 2)
        self.assertRegex(result.stderr,
                         r"\Aimport_capture\.py: .*out.h5: cannot be written: No such file or directory\n\Z")
        self.assertEqual([p.name for p in self.folder.iterdir()], ["in.mat"])


if __name__ == "__main__":
    unittest.main()
