#!/usr/bin/python3
"""`isochron check` on shipped experiments, at few pixels and fixed seeds: derivatives agree with finite differences, and
noise is low enough that a wrong sign or a factor of two would show.

|z| stays below 6 in every row: for batches of normal noise, 32 of them, a row exceeds that with a probability of 1.2e-6,
any of these 479 rows once in 1700 runs. A derivative off by its own size differs by more than 6 in the clearest row.

usage: checks_test.py PROGRAM
"""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import check_experiments  # noqa: E402

PROGRAM = sys.argv.pop(1)
LIMIT = 6

# Samples per pixel, and pixels across. The others take longer for a clear verdict: scripts/check_experiments.py.
QUICK = {
    "corridor": (32768, 2),
    "cube": (256, 16),
    "figure1": (2048, 16),
    "height_field": (512, 8),
    "height_field_steady": (512, 8),
    "tree": (8192, 16),
}


class ChecksTest(unittest.TestCase):
    def test_experiments(self):
        for name, (samples, pixels) in QUICK.items():
            with self.subTest(name):
                rows = check_experiments.check(PROGRAM, name, samples, pixels)
                self.assertLess(check_experiments.largest_z(rows), LIMIT)
                self.assertGreater(check_experiments.clearest(rows), LIMIT)


if __name__ == "__main__":
    unittest.main()
