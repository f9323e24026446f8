#!/usr/bin/python3
"""`isochron check` on shipped experiments, at few pixels and fixed seeds: derivatives agree with finite differences, and
by few enough samples' noise that a wrong sign or a factor of two would show.

|z| stays below 6 in every row: for batches of normal noise, 32 of them, a row exceeds that with a probability of 1.2e-6,
any of these 479 rows once in 1700 runs. A derivative off by its own size differs by more than 6 in the clearest row.

usage: checks_test.py PROGRAM
"""

import csv
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = sys.argv.pop(1)
LIMIT = 6

# Samples per pixel, and pixels across. The other experiments take too long for a clear verdict: see the README.
EXPERIMENTS = {
    "corridor": (2048, 2),
    "cube": (256, 16),
    "figure1": (2048, 16),
    "height_field": (64, 8),
    "height_field_steady": (64, 8),
    "tree": (192, 16),
}


class ChecksTest(unittest.TestCase):
    def test_experiments(self):
        for name, (samples, pixels) in EXPERIMENTS.items():
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                # Its own verdict, at a 1 % chance of a false alarm in each table, is not asked.
                done = subprocess.run(
                    [PROGRAM, "check", ROOT / f"experiments/{name}.yaml", "--samples", str(samples),
                     "--set", f"resolution=[{pixels}, {pixels}]", "-o", folder, "--quiet"],
                    capture_output=True, text=True)
                self.assertLessEqual(done.returncode, 1, done.stderr)
                with open(pathlib.Path(folder) / "check.csv", encoding="ascii", newline="") as file:
                    rows = [{k: float(v) for k, v in row.items() if k != "parameter"} for row in csv.DictReader(file)]
                self.assertLess(max(abs(row["z"]) for row in rows), LIMIT)
                self.assertGreater(max(
                    abs(row["total"]) / math.hypot(row["standard_error"], row["finite_difference_error"])
                    for row in rows if row["total"] != 0), LIMIT)


if __name__ == "__main__":
    unittest.main()
