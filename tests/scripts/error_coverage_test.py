#!/usr/bin/python3
"""Whether runs state errors that cover the truth, on six draws of the tilted plate of scripts/error_coverage.py, and whether p-values
of right models are uniform, on fifty of its flat one.

Each quantity's sum of squared errors over stated errors follows chi square with six degrees of freedom. The limits are its
quantiles of 5e-5 and of 1 - 5e-5 if stated errors are right to 20 %; five quantities: false alarms in 5e-4 of all runs at most.
Errors as if all else were known, a third of these for a tilt, are found out. The distance between the p-values' distribution and the
uniform one by Kolmogorov and Smirnov: false alarms in 1e-3 of all runs. These begin with so few samples of the expected counts that their
noise would spoil the p-values, were no others added.
"""

import os
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
os.environ["ISOCHRON_PROGRAM"] = sys.argv.pop(1)
import error_coverage
from scipy.stats import kstest
from reproduction.tables import read_rows

DRAWS, FIT_DRAWS = 6, 50
FIT_SAMPLES = 32
SEED = 1000 * int(os.environ.get("ISOCHRON_TEST_SEED", "0"))
LEAST, MOST = 0.136 / 1.2**2, 29.4 * 1.2**2
QUANTITIES = {"z", "tilt_x", "tilt_y", "dark", "gain * paint"}


class CoverageTest(unittest.TestCase):
    def test_plate(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "plate.csv"
            error_coverage.measure(file, DRAWS, ("plate",), SEED)
            rows = [r for r in read_rows(file) if r["quantity"] in QUANTITIES]
        self.assertEqual({r["quantity"] for r in rows}, QUANTITIES)
        for name in QUANTITIES:
            own = [float(r["z"]) for r in rows if r["quantity"] == name]
            self.assertEqual(len(own), DRAWS)
            self.assertTrue(LEAST < sum(z * z for z in own) < MOST, f"{name}: {own}")

    def test_p_values(self):
        error_coverage.FIT_SAMPLES = FIT_SAMPLES
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "flat.csv"
            error_coverage.measure(file, FIT_DRAWS, ("flat",), SEED)
            p = error_coverage.p_values(read_rows(file), "flat")
        self.assertEqual(len(p), FIT_DRAWS)
        self.assertGreater(kstest(p, "uniform").pvalue, 1e-3, sorted(p))


if __name__ == "__main__":
    unittest.main()
