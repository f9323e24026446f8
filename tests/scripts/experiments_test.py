#!/usr/bin/python3
"""Every experiment of this repository runs, ends at the same result when it is killed and resumed and, unless it is there to show a failure, comes
closer to its target: a few iterations with few pixels and samples, by fixed seeds. Closer in the parameters: with so
few samples the loss is mostly noise. The cube with few takes another way than with its own, by its first step.

usage: experiments_test.py PROGRAM
"""

import csv
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = sys.argv.pop(1)

# Image size, samples per pixel and number of iterations at which the way to the target shows, and learning rate (None:
# the experiment's own). Experiments that are not listed take the first entry; theirs need not come closer.
DEFAULT = ([4, 4], 4, 3, None)
CLOSER = {
    "branches": ([12, 12], 16, 6, None),
    "corridor": ([2, 2], 4096, 8, 0.02),
    "height_field": ([12, 12], 16, 6, None),
    "tree": ([16, 16], 8, 6, None),
}


class ExperimentsTest(unittest.TestCase):
    def run_program(self, *arguments, folder):
        """With a few samples some fits lose their data: which and when is up to the random numbers."""
        done = subprocess.run([PROGRAM, *map(str, arguments), "--quiet", "--no-plots"], capture_output=True, text=True)
        self.assertIn(done.returncode, (0, 1), done.stderr)
        summary = yaml.safe_load((folder / "summary.yaml").read_text())
        self.assertEqual(summary["status"], "diverged" if done.returncode else "iterations_reached", done.stderr)
        return summary

    def of(self, experiment):
        return yaml.safe_load(experiment.read_text())

    def test_experiments(self):
        files = sorted(ROOT.glob("experiments/*.yaml"))
        # Others show derivatives alone, or need a measurement that is not part of the repository.
        experiments = [f for f in files if "capture" not in self.of(f).get("target", {"capture": None})]
        self.assertLessEqual(set(CLOSER), {e.stem for e in experiments})
        for experiment in experiments:
            with self.subTest(experiment.stem), tempfile.TemporaryDirectory() as folder:
                self.check(experiment, pathlib.Path(folder) / "run")

    def check(self, experiment, run):
        resolution, samples, iterations, rate = CLOSER.get(experiment.stem, DEFAULT)
        settings = [f"target.samples={4 * samples}", f"optimizer.iterations={iterations}"]
        if "capture" in self.of(experiment.parent / self.of(experiment)["scene"]):
            settings.append("output.histogram_samples=4")
        else:
            settings.append(f"resolution={resolution}")
        if rate:
            settings.append(f"optimizer.learning_rate={rate}")
        overrides = [word for setting in settings for word in ("--set", setting)]
        words = ["run", experiment, "--samples", samples, *overrides, "-o"]
        summary = self.run_program(*words, run, folder=run)
        self.assertEqual(summary["iterations"], iterations)
        if experiment.stem in CLOSER:
            self.assertLess(summary["param_rmse_final"], 0.99 * summary["param_rmse_initial"])

        killed = run.with_name("killed")
        self.kill_after_first_step([*words, killed], killed)
        self.run_program("resume", killed, folder=killed)
        self.assertEqual((killed / "final.exr").read_bytes(), (run / "final.exr").read_bytes())
        self.assertEqual(self.log(killed), self.log(run))

    def kill_after_first_step(self, words, folder):
        """Kills the program, without a warning, as soon as there is a checkpoint; some run on to their end before."""
        process = subprocess.Popen([PROGRAM, *map(str, words), "--quiet", "--no-plots"])
        files = [folder / "checkpoint.yaml", folder / "levels/1/checkpoint.yaml"]  # the latter of a run in levels
        while process.poll() is None and not any(file.exists() for file in files):
            time.sleep(0.001)
        process.kill()
        process.wait()
        self.assertTrue(any(file.exists() for file in files))

    def log(self, run):
        """The log's rows without their seconds."""
        with open(run / "log.csv", encoding="ascii", newline="") as file:
            return [row[:1] + row[2:] for row in csv.reader(file)]


if __name__ == "__main__":
    unittest.main()
