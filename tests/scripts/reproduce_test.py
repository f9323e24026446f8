#!/usr/bin/python3
"""scripts/reproduce.py in small: its rows, pictures and page, and that its three stages are one run.

usage: reproduce_test.py PROGRAM
"""

import csv
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import lengths
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
PROGRAM = sys.argv.pop(1)

from reproduction import measure
from reproduction.catalogue import RECONSTRUCTIONS


class ReproduceTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def reproduce(self, *arguments):
        command = [sys.executable, ROOT / "scripts/reproduce.py", "--output", self.folder, "--runs", self.folder / "runs",
                   *arguments]
        environment = {**os.environ, "ISOCHRON_PROGRAM": PROGRAM}
        return subprocess.run([str(c) for c in command], env=environment, capture_output=True, text=True, check=False)

    @lengths.long
    def test_writes_rows_pictures_and_page_and_keeps_other_rows(self):
        table = self.folder / "measured/reconstructions/tree.csv"
        other = measure.Run(1, "iterations_reached", 1, 200, 0.25, 1, 0.1, 40, 50, 0.2, 0.25, 60)
        measure.store(table, [other])
        done = self.reproduce("branches", "--seeds", "1", "2", "--iterations", "3", "--samples", "2")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(measure.load(table), [other])
        rows = measure.load(self.folder / "measured/reconstructions/branches.csv")
        self.assertEqual([(r.seed, r.iterations, r.unknowns) for r in rows], [(1, 3, 1), (2, 3, 1)])
        for row in rows:
            self.assertTrue(0 < row.iteration_seconds < row.seconds and 0 < row.iteration_cpu_seconds < row.cpu_seconds)
            self.assertTrue(1 < row.peak_mib < 2048)
        self.assertTrue((self.folder / "figures/branches.png").read_bytes().startswith(b"\x89PNG"))
        page = (self.folder / "RESULTS.md").read_text()
        self.assertIn("| `branches` | 12 | 1 | 3, 100 |", page)
        self.assertIn("| `tree` | 17 | 1 | 200, 200 | 0.2, 15.5 | 0.25, 744 | 1/3000 | 0.25 | 40 | 180 | 50 | 60 |", page)
        self.assertIn("](figures/branches.png)", page)

    @lengths.long
    def test_stages_are_one_run(self):
        done = self.reproduce("cube", "--seeds", "1", "--iterations", "3", "--samples", "2")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        whole = self.folder / "whole"
        subprocess.run([PROGRAM, "run", ROOT / "experiments/cube.yaml", "-o", whole, "--quiet", "--no-plots", "--seed", "1",
                        "--samples", "2", "--set", "target.samples=8", "--set", "optimizer.iterations=3"], check=True)
        parts = self.folder / "runs/cube.1"
        self.assertEqual((parts / "final.exr").read_bytes(), (whole / "final.exr").read_bytes())
        self.assertEqual(*[yaml.safe_load((f / "summary.yaml").read_text())["parameters"] for f in (parts, whole)])
        logs = [list(csv.reader((f / "log.csv").read_text().splitlines())) for f in (parts, whole)]
        self.assertEqual(*[[row[:1] + row[2:] for row in log] for log in logs])

    def test_every_experiment_with_a_target_is_in_the_catalogue(self):
        targets = {f.stem: yaml.safe_load(f.read_text()).get("target") for f in ROOT.glob("experiments/*.yaml")}
        beyond_the_paper = {"corner", "cove", "hidden_s", "letter", "rabbit", "relief"}
        files = {name for name, target in targets.items() if target} - beyond_the_paper
        self.assertEqual(files, set(RECONSTRUCTIONS))

    def test_unknown_names_are_refused(self):
        done = self.reproduce("cubes")
        self.assertEqual(done.returncode, 2)
        self.assertIn("there is no reconstruction cubes", done.stderr)


if __name__ == "__main__":
    lengths.main()
