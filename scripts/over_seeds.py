#!/usr/bin/python3
"""Runs the tests with other random numbers, again and again, and says which fail more often than they state.

Usage: over_seeds.py BUILD SEEDS [options of ctest]     (scripts/test --seeds builds, then calls this)

Seed 0 is that of the tests as they are; SEEDS others follow. A test states its rate in a comment inside it or at the head of its file,
a script in its docstring: "false alarms: 1e-5", "by chance 1 %" or "by chance once in 1000" (the largest of what is said counts).
One that states none should never fail, for which one in a million is taken. A test is one too many where so many failures had a
probability below 1 % at twice its rate. Writes a table, for tests/README.md, into BUILD/seeds.md; exit status 1 where a test fails too
often.
"""

import ast
import os
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree as xml

from scipy.stats import binom

ROOT = pathlib.Path(__file__).resolve().parent.parent
NEVER = 1e-6
SURE = 0.01
RATE = r"(\d+(?:\.\d+)?(?:e-\d+| ?%)|once in \d+(?: \d{3})*)"
STATED = re.compile(rf"(?:false(?:ly)? alarm(?:s|ed)?|by chance)\b[^.;]*?{RATE}|{RATE}[^.;]*?by chance", re.IGNORECASE)


def rates_in(comments):
    numbers = ["".join(groups) for groups in STATED.findall(comments)]
    return [1 / float(n[len("once in"):].replace(" ", "")) if n.startswith("once") else
            float(n[:-1]) / 100 if n.endswith("%") else float(n) for n in numbers]


def comments_of(text):
    lines = (line.split("//", 1)[1].strip() if "//" in line else "" for line in text.splitlines())
    return re.sub(r"\s+", " ", " ".join(lines))


def stated_rate(name):
    """Of ctest's Prefix/Suite.Case/0, by the source that defines it; of scripts.NAME, by what its script says of itself."""
    suite, _, case = name.partition(".")
    script = ROOT / f"tests/scripts/{case.removesuffix('.long')}_test.py"
    if suite == "scripts" and script.exists():
        return max(rates_in(re.sub(r"\s+", " ", ast.get_docstring(ast.parse(script.read_text())) or "")) or [NEVER])
    suite, case = suite.split("/")[-1], case.split("/")[0]
    for source in ROOT.glob("tests/*/*_test.cpp"):
        text = source.read_text()
        begin = re.search(rf"^TEST(?:_F|_P)?\({re.escape(suite)}, {re.escape(case)}\)", text, re.MULTILINE)
        if not begin:
            continue
        body = text[begin.start():].split("\n}\n", 1)[0]
        above = text[:begin.start()].rsplit("\n\n", 1)[-1]
        head = text.split("#include", 1)[0]
        return max(rates_in(comments_of(above + body)) or rates_in(comments_of(head)) or [NEVER])
    return NEVER


def run(build, seed, options):
    """{test: passed} of one seed."""
    results = build / "seeds.xml"
    results.unlink(missing_ok=True)
    subprocess.run(["ctest", "--test-dir", build, "--output-junit", results.resolve(), "-j2", *options],
                   env=dict(os.environ, ISOCHRON_TEST_SEED=str(seed)), stdout=subprocess.DEVNULL)
    if not results.exists():
        sys.exit("over_seeds.py: ctest wrote no results; are its options right?")
    cases = xml.parse(results).getroot().iter("testcase")
    return {case.get("name"): case.get("status") == "run" for case in cases if case.get("status") != "notrun"}


def main(build, seeds, options):
    failures, runs, tests = {}, 0, 0
    for seed in range(int(seeds) + 1):
        passed = run(build, seed, options)
        failed = [name for name, good in passed.items() if not good]
        tests, runs = max(tests, len(passed)), runs + 1
        for name in failed:
            failures.setdefault(name, []).append(seed)
        print(f"seed {seed}: {len(passed) - len(failed)} of {len(passed)} passed", *failed, sep="\n  ", flush=True)
    lines = [f"{tests} tests, seeds 0 to {seeds}: {tests - len(failures)} never failed.", "",
             "| test | failed | of | states | seeds |", "|---|---|---|---|---|"]
    too_often = []
    for name, at in sorted(failures.items()):
        rate = stated_rate(name)
        if binom.sf(len(at) - 1, runs, min(1, 2 * rate)) < SURE:
            too_often.append(name)
        lines.append(f"| {name} | {len(at)} | {runs} | {rate:.2g} | {', '.join(map(str, at))} |")
    text = "\n".join(lines if failures else lines[:1]) + "\n"
    (build / "seeds.md").write_text(text)
    print("\n" + text)
    if too_often:
        sys.exit("more often than stated: " + ", ".join(too_often))


if __name__ == "__main__":
    if len(sys.argv) < 3 or not sys.argv[2].isdigit() or int(sys.argv[2]) < 1:
        print("over_seeds.py: wants a build folder and a number of seeds, at least 1", file=sys.stderr)
        sys.exit(2)
    main(pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3:])
