#!/usr/bin/python3
"""Commands that several processes share through MPI: the same bits for any number of them, also after one died.

usage: ranks_test.py PROGRAM
"""

import csv
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = sys.argv.pop(1)
EXPERIMENTS = pathlib.Path(__file__).resolve().parents[2] / "experiments"
# More ranks than cores, which a cluster would not have, and as root, as in containers.
ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
MPIRUN = ["mpirun", "--oversubscribe", "--bind-to", "none", "-n"]

# Images and interior terms by both kinds of sums, the learning of the visibility term, a Jacobian, and a capture.
RUNS = {
    "cube": ("cube.yaml", "target.samples=16", "optimizer.iterations=3"),
    "cube_lm": ("cube.yaml", "target.samples=16", "optimizer.iterations=2", "optimizer.method=levenberg_marquardt",
                "optimizer.learning_rate=", "gates.sigma=0.05"),
    "height_field": ("height_field.yaml", "target.samples=16", "samples.primal=4", "samples.interior=4", "optimizer.iterations=2"),
    "standard": ("height_field.yaml", "target.samples=16", "samples.primal=4", "samples.interior=4", "optimizer.iterations=2",
                 "estimator.sampling=standard"),
    "letter": ("letter.yaml", "target.samples=16", "samples.primal=4", "samples.interior=4", "optimizer.iterations=1",
               "optimizer.inner_iterations=2"),
}
SHARINGS = [(1, 2), (2, 1), (3, 2), (4, 1)]


def command(ranks, *arguments):
    return [*([] if ranks == 0 else [*MPIRUN, str(ranks)]), PROGRAM, *map(str, arguments)]


def results(folder):
    """What must be the same, by file: all but times and where the run was."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.suffix in (".exr", ".ply", ".h5"):
            found[path.name] = path.read_bytes()
        elif path.name in ("log.csv", "derive.csv", "gradient.csv"):
            with open(path, encoding="ascii", newline="") as lines:
                found[path.name] = [{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(lines)]
    return found


class RanksTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)

    def run_program(self, ranks, *arguments, status=0):
        process = subprocess.run(command(ranks, *arguments), env=ENVIRONMENT, capture_output=True, text=True, timeout=300)
        self.assertEqual(process.returncode, status, process.stderr)
        return process

    def arguments(self, name, folder):
        file, *settings = RUNS[name]
        return ("run", EXPERIMENTS / file, "-o", folder, "--no-plots",
                *(word for setting in settings for word in ("--set", setting)))

    def same(self, expected, folder):
        found = results(folder)
        self.assertEqual(sorted(found), sorted(expected))
        for name, content in expected.items():
            self.assertTrue(found[name] == content, f"{folder.name}: {name} differs")

    def test_runs_have_the_same_bits(self):
        for name in RUNS:
            alone = self.folder / name
            self.run_program(0, *self.arguments(name, alone), "--quiet")
            expected = results(alone)
            self.assertIn("log.csv", expected)
            for ranks, threads in SHARINGS:
                with self.subTest(name=name, ranks=ranks, threads=threads):
                    shared = self.folder / f"{name}_{ranks}_{threads}"
                    said = self.run_program(ranks, *self.arguments(name, shared), "--threads", threads)
                    self.same(expected, shared)
                    self.assertEqual(said.stderr.count("iterations_reached"), 1, said.stderr)  # one rank alone speaks

    def test_derive_and_gradient_have_the_same_bits(self):
        for name in ("derive", "gradient"):
            arguments = (name, EXPERIMENTS / "cube.yaml", "--samples", 4, "--no-plots", "-o")
            if name == "gradient":
                arguments = ("gradient", EXPERIMENTS / "cube.yaml", "--samples", 4, "--set", "target.samples=16", "-o")
            self.run_program(0, *arguments, self.folder / name)
            self.run_program(3, *arguments, self.folder / f"{name}_3", "--threads", 1)
            self.same(results(self.folder / name), self.folder / f"{name}_3")

    def test_mistakes_are_told_once(self):
        for arguments, words in ((("run", "nowhere.yaml"), "nowhere.yaml"),
                                 (("run", EXPERIMENTS / "cube.yaml", "--set", "gates.sigma=-1"), "sigma")):
            said = self.run_program(2, *arguments, "-o", self.folder / "none", status=2).stderr
            self.assertEqual(said.count("isochron: error:"), 1, said)
            self.assertIn(words, said)
        self.assertFalse((self.folder / "none").exists())

    def long_run(self, name):
        return [*self.arguments("cube", self.folder / name), "--set", "optimizer.iterations=40", "--quiet"]

    def wait_for_rows(self, name, count):
        log = self.folder / name / "log.csv"
        for _ in range(600):
            if log.exists() and len(log.read_text().splitlines()) > count:
                return
            time.sleep(0.1)
        self.fail("no rows")

    def test_goes_on_with_another_number_after_one_died(self):
        self.run_program(0, *self.long_run("alone"))
        expected = results(self.folder / "alone")
        for signal_number, victim in ((signal.SIGKILL, "1"), (signal.SIGTERM, "0")):
            name = f"died_{victim}"
            shared = subprocess.Popen(command(3, *self.long_run(name)), env=ENVIRONMENT, stderr=subprocess.PIPE,
                                      stdout=subprocess.DEVNULL, text=True)
            self.wait_for_rows(name, 4)
            for entry in pathlib.Path("/proc").glob("[0-9]*"):
                try:
                    of_ours = str(self.folder / name).encode() in (entry / "cmdline").read_bytes().split(b"\0")
                    if of_ours and f"\0OMPI_COMM_WORLD_RANK={victim}\0".encode() in (entry / "environ").read_bytes():
                        os.kill(int(entry.name), signal_number)
                except OSError:
                    pass  # it has gone
            complaint = shared.communicate(timeout=60)[1]
            self.assertNotEqual(shared.returncode, 0)
            self.assertTrue("rank 1" in complaint or "go on with" in complaint, complaint)
            self.assertLess(len((self.folder / name / "log.csv").read_text().splitlines()), 42)
            self.run_program(2, "resume", self.folder / name, "--no-plots", "--quiet")
            self.same(expected, self.folder / name)


if __name__ == "__main__":
    unittest.main()
