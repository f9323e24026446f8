#!/usr/bin/python3
"""Commands that several processes share through MPI: the same bits for any number of them, also after one died.

Compared are all images (EXR), meshes and histograms byte by byte, log.csv and summary.yaml (with the final parameters) but for
times and memory, each with those of one process without mpirun.

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

import yaml

PROGRAM = sys.argv.pop(1)
EXPERIMENTS = pathlib.Path(__file__).resolve().parents[2] / "experiments"
# More ranks than cores, which a cluster would not have, and as root, as in containers.
ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
MPIRUN = ["mpirun", "--oversubscribe", "--bind-to", "none", "-n"]

# Images and interior terms by both kinds of sums, the learning of the visibility term, a Jacobian, a capture, and levels.
RUNS = {
    "cube": ("cube.yaml", "target.samples=16", "optimizer.iterations=3"),
    "cube_lm": ("cube.yaml", "target.samples=16", "optimizer.iterations=2", "optimizer.method=levenberg_marquardt",
                "optimizer.learning_rate=", "gates.sigma=0.05"),
    "height_field": ("height_field.yaml", "target.samples=16", "samples.primal=4", "samples.interior=4", "optimizer.iterations=2"),
    "standard": ("height_field.yaml", "target.samples=16", "samples.primal=4", "samples.interior=4", "optimizer.iterations=2",
                 "estimator.sampling=standard"),
    "letter": ("letter.yaml", "target.samples=16", "samples.primal=4", "samples.interior=4", "optimizer.iterations=1",
               "optimizer.inner_iterations=2", "output.histogram_samples=16"),
    "levels": ("height_field.yaml", "target.samples=16", "samples.primal=4", "samples.interior=4", "optimizer.iterations=2",
               "parameters[0].remesh={levels: 2}"),
}
# Ranks and threads of each.
EVERY_SHARING = [(ranks, threads) for ranks in (1, 2, 3, 4) for threads in (1, 2)]
SHARINGS = {"cube": EVERY_SHARING, "height_field": [(1, 2), (2, 1), (3, 2)], "letter": [(2, 2), (4, 1)], "cube_lm": [(2, 1), (3, 2)],
            "standard": [(2, 2), (4, 1)], "levels": [(2, 1), (3, 2)]}
# Ranks before and after one of them dies, by which signal; 0: without mpirun. Iterations of the whole run.
DEATHS = [("cube", 3, 2, signal.SIGKILL, "1", 10), ("cube", 2, 0, signal.SIGTERM, "0", 10),
          ("height_field", 2, 4, signal.SIGKILL, "1", 30), ("letter", 4, 3, signal.SIGKILL, "2", 10),
          ("levels", 2, 3, signal.SIGKILL, "1", 30), ("levels", 3, 1, signal.SIGTERM, "0", 30)]


def command(ranks, *arguments):
    return [*([] if ranks == 0 else [*MPIRUN, str(ranks)]), PROGRAM, *map(str, arguments)]


def results(folder):
    """What must be the same, by file: all but times and where the run was."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.suffix in (".exr", ".ply", ".h5"):
            found[name] = path.read_bytes()
        elif path.name in ("log.csv", "derive.csv", "gradient.csv"):
            with open(path, encoding="ascii", newline="") as lines:
                found[name] = [{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(lines)]
        elif path.name == "summary.yaml":
            found[name] = yaml.load(path.read_text(), yaml.BaseLoader)
            for timed in (found[name], *found[name].get("levels", []), *([found[name]["start"]] if "start" in found[name] else [])):
                del timed["seconds"]
            del found[name]["last_call"]
    return found


def ended(folder):
    summary = folder / "summary.yaml"
    return summary.exists() and not summary.read_text().startswith("status: interrupted")


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
            for ranks, threads in SHARINGS[name]:
                with self.subTest(name=name, ranks=ranks, threads=threads):
                    shared = self.folder / f"{name}_{ranks}_{threads}"
                    said = self.run_program(ranks, *self.arguments(name, shared), "--threads", threads)
                    self.same(expected, shared)
                    self.assertEqual(said.stderr.count("iterations_reached"), 1, said.stderr)  # one rank alone speaks

    def test_reconstructions_have_the_same_bits(self):
        """Of a capture's file, which one rank alone reads."""
        self.run_program(0, *self.arguments("letter", self.folder / "letter"), "--quiet")
        capture = self.folder / "letter/final.h5"
        for ranks in (0, 2):
            self.run_program(ranks, "reconstruct", capture, "-o", self.folder / f"found_{ranks}", "--seconds", 1, "--threads", 1,
                             "--no-plots", "--quiet")
        expected = results(self.folder / "found_0")
        self.assertIn("geometry/final_surface.ply", expected)
        self.same(expected, self.folder / "found_2")

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

    def wait_for_rows(self, folder, count):
        for _ in range(3000):
            if (folder / "log.csv").exists() and len((folder / "log.csv").read_text().splitlines()) > count:
                return
            time.sleep(0.02)
        self.fail("no rows")

    def kill(self, signal_number, rank, folder):
        """One rank of the run in the folder."""
        for entry in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                of_ours = str(folder).encode() in (entry / "cmdline").read_bytes().split(b"\0")
                if of_ours and f"\0OMPI_COMM_WORLD_RANK={rank}\0".encode() in (entry / "environ").read_bytes():
                    os.kill(int(entry.name), signal_number)
            except OSError:
                pass  # it has gone

    def test_goes_on_with_another_number_after_one_died(self):
        expected = {}
        for name, before, after, signal_number, rank, iterations in DEATHS:
            with self.subTest(name=name, before=before, after=after):
                longer = ("--set", f"optimizer.iterations={iterations}", "--quiet")
                if name == "letter":
                    longer += ("--set", "optimizer.inner_iterations=1")
                if name not in expected:
                    self.run_program(0, *self.arguments(name, self.folder / f"{name}_alone"), *longer)
                    expected[name] = results(self.folder / f"{name}_alone")
                folder = self.folder / f"{name}_died_{rank}"
                shared = subprocess.Popen(command(before, *self.arguments(name, folder), *longer, "--threads", 1),
                                          env=ENVIRONMENT, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
                self.wait_for_rows(folder, 3)
                self.kill(signal_number, rank, folder)
                complaint = shared.communicate(timeout=60)[1]
                self.assertNotEqual(shared.returncode, 0)
                self.assertTrue(f"rank {rank}" in complaint or "continue with" in complaint, complaint)
                self.assertFalse(ended(folder))
                self.run_program(after, "resume", folder, "--no-plots", "--quiet")
                self.same(expected[name], folder)

    def test_without_the_library(self):
        """Of Open MPI: a module that asks for one of another name."""
        for name in ("isochron", "isochron_mpi.so"):
            data = (pathlib.Path(PROGRAM).parent / name).read_bytes()
            (self.folder / name).write_bytes(data.replace(b"libmpi.so.", b"libnot.so."))
            (self.folder / name).chmod(0o755)
        done = subprocess.run([*MPIRUN, "3", self.folder / "isochron", "run", EXPERIMENTS / "cube.yaml", "-o", self.folder / "run"],
                              env=ENVIRONMENT, capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 2)
        self.assertEqual([line for line in done.stderr.splitlines() if line.startswith("isochron")],
                         ["isochron: error: started by MPI, which needs Open MPI's library (allowed: to install libopenmpi3): "
                          "libnot.so.40: cannot open shared object file: No such file or directory"])


if __name__ == "__main__":
    unittest.main()
