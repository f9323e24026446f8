"""Cost of the loss gradient by two programs on the same experiments. Called by scripts/compare.

Both take the experiments as they are here, at the initial values, each on one thread and at the same time, so that whatever
else the machine does strikes both. `isochron gradient` makes repeats of the gradient with the experiment's own samples;
variance times seconds of a gradient does not depend on their number and is what is compared. Up to commit 90f82c3 a sample
of the visibility term tried all its techniques, so programs up to there are given a quarter of these samples
(`--visibility 0.25`).
"""

import argparse
import csv
import subprocess
import sys
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parent.parent
NAMES = ["cube", "branches", "corridor", "tree", "height_field", "bunny", "sofa"]
TERMS = ["primal", "interior", "visibility", "path_length"]
REPEATS = 32  # the most that `isochron gradient` makes
MOST_TARGET_SAMPLES = 131072  # what the target's noise adds to the residual is then a small part of it


def start(program, name, experiment, visibility, seed, folder):
    samples = experiment["samples"] | {"visibility": experiment["samples"]["visibility"] * visibility}
    target = min(experiment["target"]["samples"], MOST_TARGET_SAMPLES)
    spec = ", ".join(f"{term}: {round(REPEATS * samples[term])}" for term in TERMS)
    return subprocess.Popen(
        [program, "gradient", ROOT / "experiments" / f"{name}.yaml", "-o", folder, "--threads", "1", "--quiet",
         "--seed", str(seed), "--set", f"target.samples={target}", "--set", f"samples={{{spec}}}"])


def read(folder):
    """Gradient, sum of the squared standard errors of one repeat, seconds of one repeat."""
    with open(folder / "gradient.csv") as file:
        rows = list(csv.DictReader(file))
    cost = yaml.safe_load((folder / "gradient.yaml").read_text())
    gradient = [float(row["gradient"]) for row in rows]
    variance = cost["repeats"] * sum(float(row["standard_error"]) ** 2 for row in rows)
    return gradient, variance, cost["seconds"] / cost["repeats"]


def store(rows):
    """Rows of experiments that were not measured now stay."""
    file = ROOT / "experiments" / "measured" / "compare.csv"
    table = {name: None for name in NAMES}
    if file.exists():
        with open(file) as old:
            table |= {row[0]: row for row in list(csv.reader(old))[1:]}
    table |= {row[0]: row[:2] + [f"{value:.4g}" for value in row[2:]] for row in rows}
    temporary = file.with_suffix(".tmp")
    with open(temporary, "w", newline="") as new:
        writer = csv.writer(new, lineterminator="\n")
        writer.writerow(["experiment", "commit", "seconds_before", "seconds_now", "error_before", "error_now", "gain"])
        writer.writerows(row for row in table.values() if row)
    temporary.replace(file)


def main():
    parser = argparse.ArgumentParser(prog="scripts/compare", description=__doc__.splitlines()[0])
    parser.add_argument("commit")
    parser.add_argument("program")
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--visibility", type=float, default=1, metavar="X",
                        help="the other program's visibility samples over those of the experiment")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in NAMES]
    if unknown:
        parser.error(f"unknown name '{unknown[0]}' ({' '.join(NAMES)})")
    programs = {options.commit: options.program, "now": ROOT / "build" / "isochron"}
    rows = []
    print(f"{'':14}{'seconds of a gradient':>24}{'relative error':>24}{'variance x time':>18}")
    print(f"{'':14}{options.commit:>14}{'now':>10}{options.commit:>14}{'now':>10}{'before / now':>18}")
    for name in options.names or NAMES:
        experiment = yaml.safe_load((ROOT / "experiments" / f"{name}.yaml").read_text())
        sums = {label: [0.0, 0.0] for label in programs}
        norm2 = 0.0
        for seed in range(1, options.rounds + 1):
            folders = {label: ROOT / "runs" / "compare" / f"{name}.{label}.{seed}" for label in programs}
            running = {
                label: start(program, name, experiment, options.visibility if label != "now" else 1, seed,
                             folders[label])
                for label, program in programs.items()
            }
            if any([process.wait() for process in running.values()]):
                sys.exit(f"scripts/compare: {name}: a program failed")
            for label in programs:
                gradient, variance, seconds = read(folders[label])
                sums[label][0] += variance / options.rounds
                sums[label][1] += seconds / options.rounds
                norm2 += sum(g * g for g in gradient) / (2 * options.rounds)
        before, now = sums[options.commit], sums["now"]
        error = {label: (sums[label][0] / norm2) ** 0.5 for label in programs}
        gain = before[0] * before[1] / (now[0] * now[1])
        print(f"{name:14}{before[1]:14.3g}{now[1]:10.3g}{error[options.commit]:14.3g}{error['now']:10.3g}{gain:18.3g}",
              flush=True)
        rows.append([name, options.commit, before[1], now[1], error[options.commit], error["now"], gain])
    store(rows)


if __name__ == "__main__":
    main()
