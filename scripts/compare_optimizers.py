#!/usr/bin/python3
"""CPU seconds that each optimiser needs on experiments/cube.yaml until the parameter's error is 1 % of the initial one.

    scripts/compare_optimizers.py OUT.csv [SEEDS]

For every seed: a run of as many iterations as `METHODS` says; the first iteration from which the error stays below 1 % for
the rest of the run, or `never`; the CPU seconds of a run that ends there (less those of a run without iterations); and the
error at the end of the whole run, in % of the initial one. The target is rendered once for all.
"""

import csv
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
METHODS = {
    "adam": "{method: adam, learning_rate: 0.02, iterations: 100}",
    "lbfgs": "{method: lbfgs, learning_rate: 0.01, inner_iterations: 5, iterations: 15}",
    "levenberg_marquardt": "{method: levenberg_marquardt, iterations: 20}",
}


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(folder, seed, optimizer, *more):
    """Runs the cube; returns CPU seconds and the errors of the rows of its log."""
    before = cpu_seconds()
    command = [ROOT / "build/isochron", "run", ROOT / "experiments/cube.yaml", "-o", folder, "--force", "--quiet", "--no-plots",
               "--seed", str(seed), "--set", f"optimizer={optimizer}", *more]
    subprocess.run(command, check=True)
    with open(folder / "log.csv", encoding="utf-8") as file:
        errors = [float(row["param_rmse"]) for row in csv.DictReader(file)]
    return cpu_seconds() - before, errors


def main():
    seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 8
    rows = [("method", "seed", "iterations_to_1_percent", "cpu_seconds", "final_error_percent")]
    with tempfile.TemporaryDirectory() as temporary:
        out = pathlib.Path(temporary) / "run"
        run(out, 1, "{iterations: 0}")
        target = pathlib.Path(temporary) / "target.exr"
        target.write_bytes((out / "target.exr").read_bytes())
        images = ("--set", f"target={{images: {target}}}")
        for method, optimizer in METHODS.items():
            times = []
            for seed in range(1, seeds + 1):
                _, errors = run(out, seed, optimizer, *images)
                limit = 0.01 * errors[0]
                above = [i for i, error in enumerate(errors) if error > limit]
                reached = above[-1] + 1
                final = 100 * errors[-1] / errors[0]
                if reached == len(errors):
                    rows.append((method, seed, "never", "", f"{final:.3f}"))
                    continue
                stop = ("--set", f"optimizer.iterations={reached}")
                seconds = run(out, seed, optimizer, *images, *stop)[0] - run(out, seed, "{iterations: 0}", *images)[0]
                times.append(seconds)
                rows.append((method, seed, reached, f"{seconds:.3f}", f"{final:.3f}"))
            middle = f"{statistics.median(times):.3f} s" if times else "-"
            print(f"{method}: {len(times)} of {seeds} seeds, median {middle}", flush=True)
    with open(sys.argv[1], "w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    main()
