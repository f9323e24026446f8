#!/usr/bin/python3
"""The model of scripts/scaling.py in its limits, and the script of experiments/CLUSTERS.md with stand-ins for Slurm."""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import scaling
from in_process import run_script


def rows(serial, shared):
    """One core as the line serial + shared * samples says; two ranks exchange a megabyte in ten messages."""
    for multiple in scaling.MULTIPLES:
        for sharing, cores in (("1 core", 1), ("2 threads", 2), ("2 ranks", 2)):
            for turn in (1, 2, 3):
                yield {"sharing": sharing, "samples": str(multiple), "round": str(turn),
                       "seconds": str(serial + multiple * shared / cores), "bytes": "1e6" if sharing == "2 ranks" else "0",
                       "messages": "10" if sharing == "2 ranks" else "0"}


class ModelTest(unittest.TestCase):
    def setUp(self):
        self.measured = scaling.Measured(list(rows(0.25, 8)))
        self.model = scaling.Model(self.measured, 128)

    def test_one_core_is_what_was_measured(self):
        self.assertAlmostEqual(self.model.serial, 0.25)
        self.assertAlmostEqual(self.model.shared, 8)
        for multiple, seconds in self.measured.seconds["1 core"].items():
            self.assertAlmostEqual(self.model.seconds(1, multiple), seconds)
        self.assertEqual(self.measured.ratio("2 ranks", "2 threads"), 1)

    def test_work_is_shared_by_whole_partitions(self):
        self.assertEqual(self.model.speed_up_of_work(64), 64)
        self.assertEqual(self.model.speed_up_of_work(100), 64)  # some take two, and the others wait
        self.assertEqual(self.model.speed_up_of_work(10_000), 128)
        self.assertAlmostEqual(self.model.seconds(32), 0.25 + 8 / 32)  # within one rank: no messages

    def test_messages_are_steps_of_a_tree(self):
        step = 10 * scaling.LATENCY + 1e6 / scaling.BANDWIDTH + 1e6 * scaling.ADDING
        self.assertEqual(self.model.exchange(32), 0)
        self.assertAlmostEqual(self.model.exchange(64), step)
        self.assertAlmostEqual(self.model.exchange(1024), 5 * step)
        self.assertAlmostEqual(self.model.exchange(1024, rank_cores=1), 10 * step)

    def test_page_has_what_was_measured(self):
        text = scaling.table({name: self.measured for name in scaling.PARTITIONS})
        self.assertIn("| `letter` | 8.25 s | 4.25 s | 4.25 s | 1.00 | 2.5e+02 ms | 10 | 1e+03 kB |", text)


class CommandTest(unittest.TestCase):
    def test_page_is_rewritten_between_its_marks(self):
        with tempfile.TemporaryDirectory() as folder:
            csv, page = pathlib.Path(folder) / "scaling.csv", pathlib.Path(folder) / "page.md"
            each = [[name, *(row[c] for c in scaling.COLUMNS[1:])] for name in scaling.PARTITIONS for row in rows(0.25, 8)]
            scaling.write_rows(csv, scaling.COLUMNS, each)
            page.write_text("before\n<!-- scaling -->\nold\n<!-- /scaling -->\nafter\n")
            self.assertEqual(scaling.run_action("", ["page", str(csv), str(page)], scaling.page), 0)
            self.assertEqual(page.read_text(), "before\n<!-- scaling -->\n" + scaling.table(scaling.read(csv))
                             + "\n<!-- /scaling -->\nafter\n")
            self.assertEqual(sorted(p.name for p in pathlib.Path(folder).iterdir()), ["page.md", "scaling.csv"])

    def test_wrong_arguments_get_the_usage(self):
        for words in ([], ["draw", "a"], ["plot", "a"], ["measure"]):
            done = run_script(ROOT / "scripts/scaling.py", *words)
            self.assertEqual((done.returncode, done.stderr), (2, scaling.__doc__.strip() + "\n"))


class PageTest(unittest.TestCase):
    """What the page tells a user to submit, run with programs that note how they were called."""

    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        text = (ROOT / "experiments/CLUSTERS.md").read_text(encoding="utf-8")
        self.scripts = re.findall(r"```bash\n(#!/bin/bash.*?)```", text, re.DOTALL)
        for name in ("mpirun", "isochron"):
            stub = self.folder / name
            stub.write_text(f'#!/bin/sh\necho {name} "$@" >> calls\n')
            stub.chmod(0o755)

    def submit(self, script):
        (self.folder / "calls").unlink(missing_ok=True)
        environment = {"PATH": f"{self.folder}:{os.environ['PATH']}", "SLURM_NTASKS": "4", "SLURM_CPUS_PER_TASK": "16",
                       "SLURM_ARRAY_TASK_ID": "3"}
        process = subprocess.run(["bash", "-eu", "-c", script], cwd=self.folder, env=environment, capture_output=True,
                                 text=True)
        calls = self.folder / "calls"
        return process, calls.read_text().splitlines() if calls.exists() else []

    def test_first_job_runs_and_the_next_resumes(self):
        process, calls = self.submit(self.scripts[0])
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertEqual(len(calls), 1)
        self.assertTrue(calls[0].startswith("mpirun "), calls)
        self.assertIn("-n 4 --bind-to none isochron run sofa.yaml -o runs/sofa --threads 16", calls[0])
        (self.folder / "runs/sofa").mkdir(parents=True)
        (self.folder / "runs/sofa/checkpoint.yaml").write_text("")
        _, calls = self.submit(self.scripts[0])
        self.assertIn("isochron resume runs/sofa --threads 16", calls[0])

    def test_sweep_gives_every_task_its_seed(self):
        process, calls = self.submit(self.scripts[1])
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertEqual(len(calls), 1)
        self.assertIn("--seed 3", calls[0])
        self.assertIn("runs/sofa_3", calls[0])


if __name__ == "__main__":
    unittest.main()
