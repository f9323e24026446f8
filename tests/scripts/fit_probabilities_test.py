#!/usr/bin/python3
"""That scripts/fit_probabilities.py fits counts of what an experiment found: draws have other deviances, none of which is that of a
wrong model; and z of the truth. By chance 1 % (three p-values below 0.003), as the fits are right."""

import os
import pathlib
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
os.environ["ISOCHRON_PROGRAM"] = sys.argv.pop(1)
import error_coverage
import fit_probabilities
import seeds
from isochron import exr
from reproduction.tables import read_rows

DRAWS = 3


class FitProbabilitiesTest(unittest.TestCase):
    def test_draws_of_a_fit(self):
        error_coverage.TRUE_SAMPLES, error_coverage.SAMPLES = 1024, 128
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(temporary)
            error_coverage.write(folder, "flat")
            expected = error_coverage.render_expected(folder)
            exr.write(folder / "counts.exr", {name: seeds.generator(1).poisson(mean) for name, mean in expected.items()})
            fit_probabilities.measure(folder / "experiment.yaml", folder / "p.csv", DRAWS, 4096)
            rows = read_rows(folder / "p.csv")
            text = fit_probabilities.tables_of(rows)
        self.assertEqual([int(r["draw"]) for r in rows], [*range(1 + DRAWS)])
        self.assertEqual(len({r["deviance"] for r in rows}), 1 + DRAWS)
        for row in rows[1:]:
            self.assertGreater(float(row["p_value"]), 0.003, rows)
            self.assertLess(abs(float(row["true_z"])), 4)
        self.assertIn(f"| experiment | {float(rows[0]['p_value']):.2g} | {DRAWS} |", text)

    def test_z_of_the_truth_is_normal(self):
        """By chance 1e-4: mean and variance of 400 within four standard errors."""
        means, draws, random = np.geomspace(0.003, 60, 500), 400, seeds.generator(2)
        true_z = fit_probabilities.true_z_of(means)
        z = [true_z(random.poisson(means)) for _ in range(draws)]
        self.assertLess(abs(np.mean(z)), 4 / np.sqrt(draws))
        self.assertLess(abs(np.var(z) - 1), 4 * np.sqrt(2 / draws))


if __name__ == "__main__":
    unittest.main()
