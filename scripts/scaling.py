#!/usr/bin/python3
"""How an iteration scales with cores: measured on two, modelled up to 10 000.

    scripts/scaling.py measure CSV        half an hour on two idle cores
    scripts/scaling.py plot CSV PNG
    scripts/scaling.py page CSV PAGE.md   rewrites what stands between <!-- scaling --> and <!-- /scaling -->

An iteration is one image with its gradient. Measured are its wall seconds with some multiples of the experiment's samples, on
one core, as two threads and as two ranks, and the messages between two ranks, which Open MPI itself counts. They depend on
where ranks cut the row of partitions, which is where the work of both is even: a mean of four iterations.

The model: T = S + W / c + M. A line through the times on one core, as a function of samples, gives S, which every core does
for itself, and W, which they share. With K partitions in a pass the busiest of n cores has ceil(K / n) of them, so
c = K / ceil(K / n). M is what messages take: partial sums go up a binary tree of ranks, one after the other on its
longest branch, and the whole sum comes back; both take log2 of the number of ranks in steps.
"""

import collections
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

import matplotlib
import numpy as np
import yaml

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from reproduction.measure import PROGRAM, ROOT
from reproduction.tables import read_rows, run_action, write_rows

# Partitions: Passes::partitions_for of an image of so many pixels.
PARTITIONS = {"corridor": 32, "cube": 256, "letter": 128}
MULTIPLES = (0.25, 0.5, 1, 2)
SHARINGS = {"1 core": (0, 1), "2 threads": (0, 2), "2 ranks": (2, 1)}
ITERATIONS = 6
ROUNDS = 7
COLUMNS = ("experiment", "sharing", "samples", "round", "seconds", "bytes", "messages")

# Assumptions: a network as makers of InfiniBand and Omni-Path publish; sums cost what partition_count takes for them.
LATENCY = 1.5e-6  # seconds of a message
BANDWIDTH = 1e10  # bytes per second
ADDING = 1e-9 / 8  # seconds per byte: a nanosecond for a double
RANK_CORES = 32  # threads of a rank, which needs no messages among them
CORES = tuple(2**k for k in range(14))


def run(folder, name, sharing, multiple, iterations, *mca):
    ranks, threads = SHARINGS[sharing]
    file = ROOT / f"experiments/{name}.yaml"
    experiment = yaml.safe_load(file.read_text(encoding="utf-8"))
    samples = {kind: round(multiple * count) for kind, count in experiment["samples"].items()}
    settings = ("optimizer={method: adam, learning_rate: 0.001, iterations: %d}" % iterations, "target.samples=64",
                "samples={%s}" % ", ".join(f"{k}: {v}" for k, v in samples.items()))
    words = [*(["mpirun", *mca, "-n", str(ranks)] if ranks else []), str(PROGRAM), "run", str(file), "-o", str(folder),
             "--force", "--quiet", "--no-plots", "--threads", str(threads), *(w for s in settings for w in ("--set", s))]
    environment = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    subprocess.run(words, check=True, env=environment)


def iteration_seconds(folder):
    """Median, without the first iteration, which makes what is made once."""
    return statistics.median(np.diff([float(row["seconds"]) for row in read_rows(folder / "log.csv")]))


def messages(folder, name):
    """Bytes and number of messages of one iteration between two ranks, in both directions."""
    totals = []
    for iterations in (2, 6):
        counts = folder / f"messages{iterations}"
        run(folder / "run", name, "2 ranks", 1, iterations, "--mca", "pml_monitoring_enable", "2", "--mca",
            "pml_monitoring_enable_output", "3", "--mca", "pml_monitoring_filename", str(counts))
        total = np.zeros(2)
        for file in folder.glob(f"messages{iterations}.*.prof"):
            for line in file.read_text().split("# OSC")[0].splitlines()[1:]:
                words = line.split()
                total += [int(words[3]), int(words[5])]
        totals.append(total)
    return (totals[1] - totals[0]) / 4


def measure(file):
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        counted = {name: messages(folder, name) for name in PARTITIONS}
        for turn in range(1, ROUNDS + 1):
            for name in PARTITIONS:
                for multiple in MULTIPLES:
                    for sharing in SHARINGS:
                        run(folder / "run", name, sharing, multiple, ITERATIONS)
                        sent = counted[name] if sharing == "2 ranks" else (0, 0)
                        rows.append((name, sharing, multiple, turn, f"{iteration_seconds(folder / 'run'):.5g}",
                                     *(f"{x:g}" for x in sent)))
            print(f"round {turn} of {ROUNDS}", flush=True)
            write_rows(file, COLUMNS, rows)


class Measured:
    """Medians over rounds: seconds[sharing][multiple]; bytes and messages of an iteration."""

    def __init__(self, rows):
        times = collections.defaultdict(lambda: collections.defaultdict(list))
        for row in rows:
            times[row["sharing"]][float(row["samples"])].append(float(row["seconds"]))
        self.seconds = {s: {m: statistics.median(t) for m, t in by.items()} for s, by in times.items()}
        self.bytes, self.messages = (max(float(row[key]) for row in rows) for key in ("bytes", "messages"))

    def ratio(self, left, right):
        """Median over multiples of samples of seconds as `left` over seconds as `right`."""
        return statistics.median(self.seconds[left][m] / self.seconds[right][m] for m in self.seconds[right])


def read(file):
    """Of the experiments that the file has."""
    rows = read_rows(file)
    names = dict.fromkeys(r["experiment"] for r in rows)
    return {name: Measured([r for r in rows if r["experiment"] == name]) for name in names}


class Model:
    """Seconds of an iteration as a function of cores and of the multiple of samples."""

    def __init__(self, measured, partitions):
        samples, seconds = zip(*sorted(measured.seconds["1 core"].items()))
        # Relative errors are alike, so small times weigh more.
        self.shared, self.serial = np.polyfit(samples, seconds, 1, w=1 / np.array(seconds))
        self.serial = max(0.0, float(self.serial))
        self.partitions = partitions
        self.bytes, self.messages = measured.bytes, measured.messages

    def speed_up_of_work(self, cores):
        return self.partitions / math.ceil(self.partitions / min(cores, self.partitions))

    def exchange(self, cores, rank_cores=RANK_CORES):
        """Seconds of the messages of one iteration: what two ranks exchange is one step of the tree, there and back, and
        every byte counts as added, which those on the way back are not."""
        steps = math.log2(max(1, math.ceil(cores / rank_cores)))
        return steps * (self.messages * LATENCY + self.bytes / BANDWIDTH + self.bytes * ADDING)

    def seconds(self, cores, multiple=1, rank_cores=RANK_CORES):
        return self.serial + multiple * self.shared / self.speed_up_of_work(cores) + self.exchange(cores, rank_cores)


def models(measured):
    return {name: Model(each, PARTITIONS[name]) for name, each in measured.items()}


def plot(file, picture):
    measured = read(file)
    figure, all_axes = plt.subplots(1, len(measured), figsize=(1 + 4.5 * len(measured), 3.9), layout="constrained", sharey=True)
    for axes, (name, model) in zip(all_axes, models(measured).items()):
        for multiple, colour in ((1, "C0"), (16, "C1")):
            alone = model.seconds(1, multiple)
            axes.plot(CORES, [alone / model.seconds(n, multiple) for n in CORES], "-", color=colour,
                      label=f"model, {multiple} x the samples")
        axes.plot(CORES, CORES, ":", color="0.6", label="ideal")
        one = measured[name].seconds["1 core"][1]
        for sharing, marker in (("2 threads", "o"), ("2 ranks", "x")):
            axes.plot([2], [one / measured[name].seconds[sharing][1]], marker, color="k", label=f"measured, {sharing}")
        axes.axvline(model.partitions, color="0.8", linewidth=1, zorder=0)
        axes.annotate(f"{model.partitions} partitions", (model.partitions, 1.1), fontsize=8, rotation=90, ha="right")
        axes.set_xscale("log", base=2)
        axes.set_yscale("log", base=2)
        axes.set_ylim(0.9, 512)
        axes.set_xlabel("cores")
        axes.set_title(name)
    all_axes[0].set_ylabel("times as fast as on one core")
    all_axes[0].legend(fontsize=8)
    figure.suptitle("An iteration on many cores: measured on two, a model beyond")
    figure.savefig(picture, dpi=100)


def table(measured):
    """Markdown."""
    out = ["| | one core | two threads | two ranks | ranks / threads | serial | messages | bytes |", "|" + "---|" * 8]
    for name, model in models(measured).items():
        m = measured[name]
        times = " | ".join(f"{m.seconds[sharing][1]:.3g} s" for sharing in SHARINGS)
        out.append(f"| `{name}` | {times} | {m.ratio('2 ranks', '2 threads'):.2f} | {1000 * model.serial:.2g} ms "
                   f"| {model.messages:.0f} | {model.bytes / 1000:.3g} kB |")
    cores = (2, 8, 32, 128, 1024, 8192)
    out += ["", "Modelled speed-up over one core, with the experiment's samples and with 16 times as many:", "",
            "| cores | " + " | ".join(map(str, cores)) + " |", "|---" * (1 + len(cores)) + "|"]
    for name, model in models(measured).items():
        for multiple in (1, 16):
            factors = (model.seconds(1, multiple) / model.seconds(n, multiple) for n in cores)
            out.append(f"| `{name}`, x {multiple} | " + " | ".join(f"{x:.3g}" for x in factors) + " |")
    return "\n".join(out)


def page(file, markdown):
    markdown = pathlib.Path(markdown)
    before, rest = markdown.read_text(encoding="utf-8").split("<!-- scaling -->\n")
    after = rest.split("<!-- /scaling -->")[1]
    text = f"{before}<!-- scaling -->\n{table(read(file))}\n<!-- /scaling -->{after}"
    partial = markdown.with_name(markdown.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(markdown)


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, plot, page))
