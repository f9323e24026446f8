#!/usr/bin/python3
"""`isochron check` on shipped experiments, at few pixels and fixed seeds: derivatives agree with finite differences, and
noise is low enough that a wrong sign or a factor of two would show.

Every |z| stays below its row's limit, which Student's law for the row's degrees of freedom has exceeded in one of a
hundred tables (by chance in 6 % of runs of this test, were its seeds not fixed). A derivative off by its own size differs by
more than the limit in the clearest row.

usage: checks_test.py PROGRAM
"""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import check_experiments  # noqa: E402

PROGRAM = sys.argv.pop(1)

# Samples per pixel, and pixels across. The others take longer for a clear verdict: scripts/check_experiments.py.
QUICK = {
    "corridor": (32768, 2),
    "cube": (256, 16),
    "figure1": (2048, 16),
    "height_field": (2048, 8),
    "height_field_steady": (8192, 8),
    "tree": (8192, 16),
}


class ChecksTest(unittest.TestCase):
    def test_experiments(self):
        for name, (samples, pixels) in QUICK.items():
            with self.subTest(name):
                rows = check_experiments.check(PROGRAM, name, samples, pixels)
                self.assertLess(max(abs(row["z"]) / row["limit"] for row in rows), 1)
                self.assertGreater(max(check_experiments.errors(row) / row["limit"] for row in rows if row["total"]), 1)


if __name__ == "__main__":
    unittest.main()
