#!/usr/bin/python3
"""The pages of measurements: every table from the shipped files, and steps that are done again only where the program has changed."""

import csv
import contextlib
import io
import os
import pathlib
import re
import sys
import tempfile
import types
import unittest
import unittest.mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import cube_cost
import measure
from measurement import page, record, steps, tables


class Number(unittest.TestCase):
    def test_has_two_digits(self):
        shown = [tables.number(x) for x in (0.0123, 0.996, 1.04, 9.96, 15.4, 104, 29412, 4.5e6, 3.21e-7, -0.5, 0, float("inf"))]
        self.assertEqual(shown, ["0.012", "1.0", "1.0", "10", "15", "100", "29000", "4.5 x 10^6", "3.2 x 10^-7", "-0.50", "0", "inf"])


class Tables(unittest.TestCase):
    def test_all_come_from_the_shipped_measurements(self):
        for name, table in tables.TABLES.items():
            with self.subTest(name):
                lines = table(ROOT / "experiments/measured").splitlines()
                self.assertGreater(len(lines), 2)
                widths = {line.count("|") for line in lines if line}
                self.assertNotIn("nan", "".join(lines))
                self.assertLessEqual(len(widths), 2 if name == "stated_errors" else 1, "rows as wide as their header")

    def test_a_race_ends_where_the_error_stays_low(self):
        rows = [{"core_seconds": str(i), "error": str(e)} for i, e in enumerate((1, 0.009, 0.02, 0.008, 0.005))]
        self.assertEqual(tables._race(rows), (3.0, 0.005))
        self.assertEqual(tables._race(rows[:3]), (None, 0.02))

    def test_cubes_are_beside_the_bytes_of_their_result(self):
        row = {"command": "render", "channels": "3", "pictures": "no", "seconds_10_bins": "2", "seconds_1000_bins": "3",
               "peak_bytes": str(4 * 256 * 256 * 1000 * 3 // 2)}
        self.assertEqual(cube_cost.table_of([row]).splitlines()[-1],
                         "| `render`, colour | no | 2.00 s | 3.00 s | 1.50 | 393 MB | 0.50 |")


class Page(unittest.TestCase):
    def test_names_every_table_and_shows_pictures_that_exist(self):
        text = page.TEMPLATE.read_text(encoding="utf-8")
        marks = set(re.findall(r"\{\{(.*?)\}\}", text))
        self.assertEqual(marks, {*tables.TABLES, "versions"})
        for picture in re.findall(r"\]\((figures/[^)]*)\)", text):
            self.assertTrue((ROOT / "experiments" / picture).exists(), picture)
        for step in re.findall(r"step: `([\w/]+)`", text):
            self.assertIn(step, steps.STEPS | steps.egg("."))

    def entry(self, name, version):
        return record.Record(name, version, "2020-01-02", "1.5", "2 x chip")

    @unittest.mock.patch.object(record, "version", lambda programs: "not measured")
    def test_says_which_versions_where_they_differ(self):
        entry = self.entry
        same = {name: entry(name, "abc") for name in steps.STEPS}
        self.assertEqual(page.versions(same), f"All of version `abc`, 2020-01-02, on 2 x chip, in {1.5 * len(same):.0f} minutes.")
        other = same | {"cubes": entry("cubes", "def")}
        self.assertIn("- Of version `def`, 2020-01-02, on 2 x chip, in 2 minutes: `cubes`.", page.versions(other))
        del other["speed"]
        self.assertIn("- Of older versions: `speed`.", page.versions(other))

    @unittest.mock.patch.object(record, "version", lambda programs: "new" if any("figure9" in p for p in programs) else "abc")
    def test_what_has_not_changed_is_of_the_present_version(self):
        measured = {name: self.entry(name, "new" if name == "figure9" else "abc") for name in steps.STEPS}
        self.assertRegex(page.versions(measured), "^All of version `new`")
        measured["figure9"] = self.entry("figure9", "abc")
        self.assertIn("- Of version `abc`, 2020-01-02, on 2 x chip, in 2 minutes: `figure9`.", page.versions(measured))
        self.assertIn("- Of version `new`", page.versions(measured))


class Steps(unittest.TestCase):
    def test_name_scripts_that_can_be_run(self):
        for step in steps.STEPS.values():
            for command, *_ in step.commands:
                if command.startswith("scripts/"):
                    self.assertTrue(os.access(ROOT / command, os.X_OK), command)

    def test_know_their_programs(self):
        self.assertEqual(steps.STEPS["gate_width"].programs, ("tests/benchmark/measure/gate_width.cpp",))
        self.assertEqual(steps.STEPS["figure9"].programs, ("tests/benchmark/measure/figure9.cpp",))
        self.assertEqual(steps.STEPS["charts/cube"].programs, ())
        self.assertEqual(steps.STEPS["figure1"].programs, ())
        for step in steps.STEPS.values():
            for program in step.programs:
                self.assertTrue((ROOT / program).exists(), program)


class Version(unittest.TestCase):
    def test_is_of_the_programs_too(self):
        asked = []
        with unittest.mock.patch.object(record, "_git", lambda *words: asked.append(words) or "abc"):
            self.assertEqual(record.version(("p.cpp",)), "abc+")
        self.assertEqual([words[0] for words in asked], ["status", "log"])
        self.assertTrue(all({"core", "p.cpp"} <= set(words) for words in asked), asked)


class Resume(unittest.TestCase):
    def run_all(self, arguments, fail=()):
        """What was measured, in a copy that keeps its own records."""
        done = []

        def run(words, **_):
            done.append(words[-1])
            return types.SimpleNamespace(returncode=1 if words[-1] in fail else 0)

        known = {name: steps.Step((("scripts/x", name),), removed=(self.old,)) for name in ("a/1", "a/2", "b")}
        with unittest.mock.patch.multiple(measure, STEPS=known, subprocess=types.SimpleNamespace(run=run)), \
             unittest.mock.patch.object(page, "write"), contextlib.redirect_stdout(io.StringIO()), \
             contextlib.redirect_stderr(io.StringIO()):
            status = measure.main(arguments)
        return done, status

    def test_only_what_is_not_of_this_version(self):
        with tempfile.TemporaryDirectory() as folder, \
             unittest.mock.patch.object(record, "FILE", pathlib.Path(folder) / "versions.csv"), \
             unittest.mock.patch.object(record, "version", lambda programs: "one"):
            self.old = pathlib.Path(folder) / "older_rows.csv"
            self.old.touch()
            self.assertEqual(self.run_all(["--all"], fail=["a/2"]), (["a/1", "a/2", "b"], 1))
            self.assertFalse(self.old.exists())
            self.assertEqual(self.run_all(["--all"]), (["a/2"], 0))
            self.assertEqual(self.run_all(["--all"]), ([], 0))
            self.assertEqual(self.run_all(["a/*"]), (["a/1", "a/2"], 0), "named steps are measured again")
            with open(record.FILE, encoding="ascii", newline="") as file:
                self.assertEqual([row["version"] for row in csv.DictReader(file)], ["one"] * 3)
            with unittest.mock.patch.object(record, "version", lambda programs: "two"):
                self.assertEqual(self.run_all(["--all"]), (["a/1", "a/2", "b"], 0))

    def test_a_step_that_does_not_exist_is_refused(self):
        with self.assertRaises(SystemExit) as refused, contextlib.redirect_stderr(io.StringIO()) as text:
            measure.main(["nothing"])
        self.assertEqual(refused.exception.code, 2)
        self.assertIn("there is no step nothing", text.getvalue())


if __name__ == "__main__":
    unittest.main(verbosity=2)
