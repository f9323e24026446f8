"""Cost of images and the loss gradient by two programs on the same experiments. Called by scripts/compare.

Both take the experiments as they are here, at the initial values, each on one thread and at the same time, so that whatever
else the machine does strikes both. `isochron gradient` makes repeats of the gradient with the experiment's own samples;
variance times seconds of a gradient does not depend on their number and is what is compared. Up to commit 90f82c3 a sample
of the visibility term tried all its techniques, so programs up to there are given a quarter of these samples
(`--visibility 0.25`). Where variances are alike, as after a change that moves code, CPU times tell by themselves: their
ratio is the median over the rounds, for images too, and the values of both programs are compared one by one.
"""

import argparse
import csv
import os
import statistics
import subprocess
import sys
from pathlib import Path

import numpy as np
import yaml

import use_package
from isochron import exr

ROOT = Path(__file__).resolve().parent.parent
NAMES = ["cube", "branches", "corridor", "tree", "height_field", "bunny", "sofa"]
TERMS = ["primal", "interior", "visibility", "path_length"]
REPEATS = 32  # the most that `isochron gradient` makes
IMAGE_PIXEL_SAMPLES = 4e6  # of an image, so that it takes some seconds
MOST_TARGET_SAMPLES = 131072  # what the target's noise adds to the residual is then a small part of it


def both(commands):
    """Runs the programs at the same time; CPU seconds of each."""
    running = {label: subprocess.Popen(command) for label, command in commands.items()}
    seconds = {}
    for label, process in running.items():
        _, status, usage = os.wait4(process.pid, 0)
        if status:
            sys.exit(f"scripts/compare: {label}: the program failed")
        seconds[label] = usage.ru_utime + usage.ru_stime
    return seconds


def gradient_command(program, name, experiment, visibility, seed, options, folder):
    samples = experiment["samples"] | {"visibility": experiment["samples"]["visibility"] * visibility}
    target = min(experiment["target"]["samples"], options.target_samples)
    spec = ", ".join(f"{term}: {round(options.repeats * samples[term])}" for term in TERMS)
    return [program, "gradient", ROOT / "experiments" / f"{name}.yaml", "-o", folder, "--threads", "1", "--quiet",
            "--seed", str(seed), "--set", f"target.samples={target}", "--set", f"samples={{{spec}}}"]


def image_command(program, name, experiment, seed, folder):
    width, height = experiment.get("resolution") or yaml.safe_load(
        (ROOT / "experiments" / experiment["scene"]).read_text())["camera"]["resolution"]
    samples = max(1, round(IMAGE_PIXEL_SAMPLES / (width * height)))
    return [program, "render", ROOT / "experiments" / f"{name}.yaml", "-o", folder, "--threads", "1", "--quiet",
            "--no-plots", "--seed", str(seed), "--samples", str(samples)]


def pixels(folder):
    return np.stack(list(exr.read(folder / "render.exr").values()))


def difference(a, b):
    """The largest, over the largest value."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return float(np.abs(a - b).max() / max(np.abs(a).max(), np.abs(b).max(), 1e-300))


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
    file = ROOT / "build/compare/compare.csv"
    table = {name: None for name in NAMES}
    if file.exists():
        with open(file) as old:
            table |= {row[0]: row for row in list(csv.reader(old))[1:]}
    table |= {row[0]: row[:2] + [f"{value:.4g}" for value in row[2:]] for row in rows}
    temporary = file.with_suffix(".tmp")
    with open(temporary, "w", newline="") as new:
        writer = csv.writer(new, lineterminator="\n")
        writer.writerow(["experiment", "commit", "seconds_before", "seconds_now", "error_before", "error_now", "gain",
                         "cpu_gradient", "cpu_image", "difference_gradient", "difference_image"])
        writer.writerows(row for row in table.values() if row)
    temporary.replace(file)


def main():
    parser = argparse.ArgumentParser(prog="scripts/compare", description=__doc__.splitlines()[0])
    parser.add_argument("commit")
    parser.add_argument("program")
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=REPEATS, help="of the gradient in each round")
    parser.add_argument("--target-samples", type=int, default=MOST_TARGET_SAMPLES,
                        help="fewer are enough where variances are alike")
    parser.add_argument("--visibility", type=float, default=1, metavar="X",
                        help="the other program's visibility samples over those of the experiment")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in NAMES]
    if unknown:
        parser.error(f"unknown name '{unknown[0]}' ({' '.join(NAMES)})")
    programs = {options.commit: options.program, "now": ROOT / "build" / "isochron"}
    rows = []
    print(f"{'':14}{'seconds of a gradient':>24}{'relative error':>24}{'variance x time':>18}"
          f"{'CPU before / now':>22}{'differ by':>22}")
    print(f"{'':14}{options.commit:>14}{'now':>10}{options.commit:>14}{'now':>10}{'before / now':>18}"
          f"{'gradient':>12}{'image':>10}{'gradient':>12}{'image':>10}")
    for name in options.names or NAMES:
        experiment = yaml.safe_load((ROOT / "experiments" / f"{name}.yaml").read_text())
        sums = {label: [0.0, 0.0] for label in programs}
        norm2, apart, apart_image = 0.0, 0.0, 0.0
        ratios, image_ratios = [], []
        for seed in range(1, options.rounds + 1):
            folders = {label: ROOT / "runs" / "compare" / f"{name}.{label}.{seed}" for label in programs}
            images = {label: ROOT / "runs" / "compare" / f"{name}.{label}.image" for label in programs}
            both({label: gradient_command(program, name, experiment,
                                                options.visibility if label != "now" else 1, seed, options,
                                                folders[label]) for label, program in programs.items()})
            cpu = both({label: image_command(program, name, experiment, seed, images[label])
                        for label, program in programs.items()})
            image_ratios.append(cpu[options.commit] / cpu["now"])
            gradients, spent = {}, {}
            for label in programs:
                gradients[label], variance, spent[label] = read(folders[label])
                sums[label][0] += variance / options.rounds
                sums[label][1] += spent[label] / options.rounds
                norm2 += sum(g * g for g in gradients[label]) / (2 * options.rounds)
            ratios.append(spent[options.commit] / spent["now"])
            apart = max(apart, difference(*gradients.values()))
            apart_image = max(apart_image, difference(*(pixels(images[label]) for label in programs)))
        before, now = sums[options.commit], sums["now"]
        error = {label: (sums[label][0] / norm2) ** 0.5 for label in programs}
        gain = before[0] * before[1] / (now[0] * now[1])
        medians = [statistics.median(ratios), statistics.median(image_ratios)]
        print(f"{name:14}{before[1]:14.3g}{now[1]:10.3g}{error[options.commit]:14.3g}{error['now']:10.3g}{gain:18.3g}"
              f"{medians[0]:12.3f}{medians[1]:10.3f}{apart:12.2g}{apart_image:10.2g}", flush=True)
        rows.append([name, options.commit, before[1], now[1], error[options.commit], error["now"], gain, *medians, apart,
                     apart_image])
    store(rows)


if __name__ == "__main__":
    main()
