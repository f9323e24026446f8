#!/usr/bin/python3
"""The prototype of derivatives along which the path's length stays: against finite differences, and without a tail at any width."""

import pathlib
import sys
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import length_keeping as prototype


def grid(n):
    left, lower, width = prototype.PIXEL
    along = (np.arange(n) + 0.5) / n
    v, u = np.meshgrid(lower + width * along, left + width * along, indexing="ij")
    return u.ravel(), v.ravel()


class LengthKeeping(unittest.TestCase):
    def test_dirac_gates_agree_with_finite_differences(self):
        u, v = grid(250)
        for length in (prototype.LENGTH, 5.325):  # with more light, and more ends of arcs
            step = 2e-4
            above, below = (prototype.radiance(u, v, prototype.THETA + side * step, length).mean() for side in (1, -1))
            parts = [part.mean() for part in prototype.derivative(u, v, prototype.THETA, length)]
            found, expected = sum(parts), (above - below) / (2 * step)
            self.assertLess(abs(found - expected), 0.02 * abs(expected))
            self.assertGreater(min(np.abs(parts)), 0, "both parts are there")

    def test_interior_of_an_open_lamp_agrees_with_finite_differences(self):
        """Where nothing ends an arc, the interior is all."""
        u, v = np.zeros(1), np.full(1, 0.003)
        floor = prototype.Floor(u, v, prototype.THETA)
        length = floor.r1 + 1.001 * (prototype.LAMP_HEIGHT - prototype.THETA)
        inner, ends = prototype.derivative(u, v, prototype.THETA, length)
        step = 1e-6
        above, below = (prototype.radiance(u, v, prototype.THETA + side * step, length) for side in (1, -1))
        np.testing.assert_allclose(inner, (above - below) / (2 * step), rtol=1e-6)
        self.assertEqual(ends, 0)

    def test_samples_of_the_interior_have_its_mean(self):
        generator = np.random.default_rng(1)
        u, v = (part[generator.integers(0, 250**2, 200_000)] for part in grid(250))
        samples = prototype.interior(u, v, prototype.LENGTH, generator)
        exact = prototype.derivative(u, v, prototype.THETA, prototype.LENGTH)[0]
        error = np.std(samples - exact) / np.sqrt(len(samples))
        self.assertLess(abs(np.mean(samples - exact)), 4 * error)  # false alarm: 6e-5
        self.assertLess(error, 0.15 * abs(np.mean(exact)), "a missing half would show")

    def test_pairs_grow_a_tail_and_kept_lengths_do_not(self):
        u, v = (part[np.random.default_rng(2).integers(0, 250**2, 100_000)] for part in grid(250))
        spread = lambda values: np.std(values)
        pairs = [spread(prototype.pair(u, v, width * prototype.LENGTH, np.random.default_rng(4))) for width in (1e-2, 1e-4)]
        kept = [spread(sum(prototype.derivative(u, v, prototype.THETA, prototype.LENGTH + width * np.random.default_rng(5).normal(size=len(u)))))
                for width in (1e-3, 0)]
        self.assertLess(kept[1], 1.5 * kept[0])
        self.assertGreater(pairs[0], 5 * kept[0])


if __name__ == "__main__":
    unittest.main(verbosity=2)
