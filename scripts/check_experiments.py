#!/usr/bin/python3
"""Derivatives of the experiments after the paper against finite differences: runs `isochron check` on small images.

usage: check_experiments.py CSV [FACTOR]

Writes one line per experiment: `experiment,samples,pixels,rows,largest_z,rms_z,beyond_limit,clearest`. Each of the check's rows
is one gate and unknown. Errors come from 16 replicates and, where few samples make the difference, have few degrees of
freedom: `beyond_limit` counts the rows whose |z| exceeds the limit of Student's law, which one of a hundred tables does by chance.
`clearest` is the largest derivative over its error: what a wrong sign or a factor of two would add to z. FACTOR multiplies the numbers of samples, 1 takes some minutes on two cores. Left out is what differs from another
experiment in its optimisation alone.
"""

import csv
import math
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]

# Samples per pixel, pixels across and, where finite differences by every unknown would take too long, a parameter.
EXPERIMENTS = {
    "branches": (32768, 12),
    "bunny": (8192, 8),
    "corridor": (131072, 2),
    "corridor_3bounce": (131072, 2),
    "cube": (2048, 16),
    "cube_standard": (8192, 16),
    "figure1": (8192, 16),
    "height_field": (4096, 8),  # with fewer, differences miss the edges of single vertices, and state errors that are too small
    "height_field_steady": (4096, 8),
    "sofa": (131072, 6, "shape[8]"),
    "tree": (16384, 16),
    "validation/figure8_boxcar": (4096, 12),
    "validation/figure8_gaussian": (4096, 12),
    "validation/figure8_truncated_gaussian": (4096, 12),
    "validation/figure9": (2048, 16),
}


def check(program, name, samples, pixels, parameter=None):
    """The check's rows, numbers by column. Fails where the program does."""
    only = ["--parameter", parameter] if parameter else []
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [program, "check", ROOT / f"experiments/{name}.yaml", "--samples", str(samples),
             "--set", f"resolution=[{pixels}, {pixels}]", "-o", folder, "--quiet", *only], capture_output=True, text=True)
        if done.returncode > 1:
            raise RuntimeError(done.stderr)
        with open(pathlib.Path(folder) / "check.csv", encoding="ascii", newline="") as file:
            return [{k: float(v) for k, v in row.items() if k != "parameter"} for row in csv.DictReader(file)]


def largest_z(rows):
    return max(abs(row["z"]) for row in rows)


def errors(row):
    return abs(row["total"]) / math.hypot(row["standard_error"], row["finite_difference_error"])


def clearest(rows):
    return max(errors(row) for row in rows if row["total"] != 0)


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    factor = float(sys.argv[2]) if len(sys.argv) == 3 else 1
    with open(sys.argv[1], "w", encoding="ascii", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["experiment", "samples", "pixels", "rows", "largest_z", "rms_z", "beyond_limit", "clearest"])
        for name, (samples, pixels, *parameter) in EXPERIMENTS.items():
            samples = max(2, round(factor * samples))
            rows = check(ROOT / "build/isochron", name, samples, pixels, *parameter)
            rms = math.sqrt(sum(row["z"] ** 2 for row in rows) / len(rows))
            beyond = sum(abs(row["z"]) > row["limit"] for row in rows)
            table.writerow([name, samples, pixels * pixels, len(rows), f"{largest_z(rows):.2f}", f"{rms:.2f}", beyond,
                            f"{clearest(rows):.1f}"])
            file.flush()


if __name__ == "__main__":
    main()
