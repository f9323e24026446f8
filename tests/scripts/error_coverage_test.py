#!/usr/bin/python3
"""Whether runs state errors that cover the truth, on six draws of the tilted plate of scripts/error_coverage.py.

Each quantity's sum of squared errors over stated errors follows chi square with six degrees of freedom. The limits are its
quantiles of 5e-5 and of 1 - 5e-5 if stated errors are right to 20 %; five quantities: false alarms in 5e-4 of all runs at most.
Errors as if all else were known, a third of these for a tilt, are found out.
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
from reproduction.tables import read_rows

DRAWS = 6
LEAST, MOST = 0.136 / 1.2**2, 29.4 * 1.2**2
QUANTITIES = {"z", "tilt_x", "tilt_y", "dark", "gain * paint"}


class CoverageTest(unittest.TestCase):
    def test_plate(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "plate.csv"
            error_coverage.measure(file, DRAWS, ("plate",))
            rows = [r for r in read_rows(file) if r["quantity"] in QUANTITIES]
        self.assertEqual({r["quantity"] for r in rows}, QUANTITIES)
        for name in QUANTITIES:
            own = [float(r["z"]) for r in rows if r["quantity"] == name]
            self.assertEqual(len(own), DRAWS)
            self.assertTrue(LEAST < sum(z * z for z in own) < MOST, f"{name}: {own}")


if __name__ == "__main__":
    unittest.main()
