"""Runs an experiment under measurement and keeps the numbers of every run."""

import os
import pathlib
import resource
import subprocess
import time
from dataclasses import asdict, dataclass, fields

import yaml

from reproduction.tables import read_rows, write_rows

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("ISOCHRON_PROGRAM", ROOT / "build/isochron")


class Failure(Exception):
    """Why an experiment could not be run, in one line."""


@dataclass(frozen=True)
class Run:
    """One row of experiments/measured/reconstructions/NAME.csv."""

    seed: int
    status: str  # see optim/README.md
    unknowns: int
    iterations: int
    error_percent: float  # distance of the parameters to their targets at the end, in % of that at the start
    image_rmse_initial: float
    image_rmse_final: float
    seconds: float  # wall, of the whole run, the target's images included
    cpu_seconds: float  # user and system, the same
    iteration_seconds: float  # wall, of one iteration
    iteration_cpu_seconds: float
    peak_mib: float  # resident memory


@dataclass(frozen=True)
class Usage:
    """What processes took, one after the other."""

    seconds: float = 0
    cpu_seconds: float = 0
    peak_mib: float = 0

    def __add__(self, other):
        return Usage(self.seconds + other.seconds, self.cpu_seconds + other.cpu_seconds, max(self.peak_mib, other.peak_mib))


def children_cpu_seconds():
    """User and system, of all children that have ended, to microseconds: `time` has hundredths, which small runs round to zero."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def program(*arguments, pictures=False):
    """Runs PROGRAM, with the pictures that it draws by other processes or without, and returns its Usage. A run that diverges fails,
    but leaves its summary: that is a result. The peak of memory is told by `time`: a child of this process would begin with this
    one's memory as its peak."""
    words = [*map(str, arguments), "--quiet", *([] if pictures else ["--no-plots"])]
    start, cpu_before = time.perf_counter(), children_cpu_seconds()
    result = subprocess.run(["/usr/bin/time", "--quiet", "--format", "%M", str(PROGRAM), *words], stderr=subprocess.PIPE, text=True,
                            check=False)
    wall, cpu = time.perf_counter() - start, children_cpu_seconds() - cpu_before
    complaint, _, kibibytes = result.stderr.rstrip().rpartition("\n")
    if result.returncode != 0 and "the run diverged" not in complaint:
        raise Failure(f"isochron {' '.join(words)}: {complaint.strip() or f'status {result.returncode}'}")
    return Usage(wall, cpu, float(kibibytes) / 1024)


def summary(folder):
    return yaml.safe_load((folder / "summary.yaml").read_text(encoding="utf-8"))


def values(folder):
    """Unknown -> value, as the folder's summary has them."""
    out = {}
    for name, value in summary(folder)["parameters"].items():
        out.update({f"{name}[{i}]": v for i, v in enumerate(value)} if isinstance(value, list) else {name: value})
    return out


def go_on(folder, iterations):
    """Resumes a run up to so many iterations in all."""
    file = folder / "experiment.yaml"
    experiment = yaml.safe_load(file.read_text(encoding="utf-8"))
    experiment["optimizer"]["iterations"] = iterations
    file.write_text(yaml.safe_dump(experiment, sort_keys=False), encoding="utf-8")
    return program("resume", folder)


def run(name, seed, folder, iterations=None, samples=None):
    """Runs an experiment in three stages, each going on from the one before: the target's images, half of the
    iterations, the other half; the result is that of a run in one piece, bit for bit. `iterations` and `samples` take the
    place of the experiment's own. Returns the Run and the parameters halfway."""
    file = ROOT / f"experiments/{name}.yaml"
    iterations = iterations or yaml.safe_load(file.read_text(encoding="utf-8"))["optimizer"]["iterations"]
    folder.parent.mkdir(parents=True, exist_ok=True)
    fewer = ("--samples", samples, "--set", f"target.samples={4 * samples}") if samples else ()
    before = program("run", file, "-o", folder, "--force", "--seed", seed, "--set", "optimizer.iterations=0", *fewer)
    optimisation = go_on(folder, iterations // 2)
    halfway = values(folder)
    optimisation += go_on(folder, iterations)
    whole, end = before + optimisation, summary(folder)
    done = max(end["iterations"], 1)
    result = Run(seed, end["status"], len(halfway), end["iterations"],
                 100 * end["param_rmse_final"] / end["param_rmse_initial"], end["image_rmse_initial"],
                 end["image_rmse_final"], whole.seconds, whole.cpu_seconds, optimisation.seconds / done,
                 optimisation.cpu_seconds / done, whole.peak_mib)
    return result, halfway


def load(file):
    """The runs of a CSV; none where there is no such file."""
    return [Run(**{f.name: f.type(row[f.name]) for f in fields(Run)}) for row in read_rows(file)] if file.exists() else []


def store(file, runs):
    """Times are rounded to what a noisy machine can tell."""
    file.parent.mkdir(parents=True, exist_ok=True)
    write_rows(file, [f.name for f in fields(Run)],
               [[f"{x:.5g}" if isinstance(x, float) else x for x in asdict(run_).values()] for run_ in runs])
