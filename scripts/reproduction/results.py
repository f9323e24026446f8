"""experiments/RESULTS.md: a table of the measured runs beside the paper's Table 2, and the pictures."""

import os
import statistics

from .catalogue import PAPER_CORES, RECONSTRUCTIONS
from .measure import load

HEADER = f"""\
# Reconstructions

Written by `scripts/reproduce`, which repeats the runs below and draws the pictures. The paper only describes its scenes in words; ours are
built after them (`scripts/scenes`). Its times are those of its Table 2 and captions, on {PAPER_CORES} vCPU; ours were measured on two
cores, and core-seconds are CPU time. `ratio` compares processors, scenes, resolutions and numbers of samples that are not the same: read
it as an order of magnitude. [Speed against accuracy](MEASURED.md#speed-against-accuracy) compares methods on one machine. Errors are the
distance of the parameters to their targets at the end, in % of that at the start, a run per seed; times are medians over the seeds.
`limit` is the time that we allow a run on two idle cores.
"""

TABLE = """
| | figure | unknowns | iterations, paper | s / iteration, paper | core-s / iteration, paper | ratio | error, % | run, s | limit, s | run, core-s | MiB |
|---|---|---|---|---|---|---|---|---|---|---|---|
"""

PICTURE = """
From the left: images through four gates (path length at the centre) at the start, halfway, at the end and at the target;
derivatives by one unknown, red above zero; RMSE. A gate has one exposure in all states. Pictures are of the first seed,
rendered again with more pixels and samples than the optimisation takes.
"""


def _row(name, entry, runs):
    middle = lambda field: statistics.median([getattr(r, field) for r in runs])
    cores, paper = middle("iteration_cpu_seconds"), entry.paper_core_seconds
    ends = {r: "" if r.status == "iterations_reached" else f" ({r.status})" for r in runs}
    errors = ", ".join(f"{r.error_percent:.2g}{end}" for r, end in ends.items())
    cells = [f"`{name}`", entry.figure, runs[0].unknowns, f"{runs[0].iterations}, {entry.paper_iterations}",
             f"{middle('iteration_seconds'):.2g}, {entry.paper_seconds:.3g}", f"{cores:.2g}, {paper:.3g}",
             f"1/{float(f'{paper / cores:.1g}'):.0f}", errors, f"{middle('seconds'):.0f}", f"{entry.most_seconds:.0f}" if entry.most_seconds else "",
             f"{middle('cpu_seconds'):.0f}", f"{max(r.peak_mib for r in runs):.0f}"]
    return "| " + " | ".join(map(str, cells)) + " |\n"


def _notes(runs):
    """What the counterparts' table does not say by itself."""
    notes = []
    if runs["corridor_fd"] and runs["corridor"]:
        cost = runs["corridor_fd"][0].iteration_cpu_seconds / runs["corridor"][0].iteration_cpu_seconds
        failed = sum(r.error_percent > 25 for r in runs["corridor_fd"])
        notes.append(
            f"`corridor_fd`: the images of a difference are independent. {failed} of {len(runs['corridor_fd'])} seeds end above 25 %, at "
            f"{cost:.2g} times the time per iteration of `corridor`. Two unknowns are fair to finite differences; every further one "
            "would add two images to an iteration, where the cost of our gradient does not grow with their number. Other steps: "
            "`experiments/corridor_fd.yaml`.")
    if runs["cube_standard"]:
        failed = sum(r.error_percent > 25 for r in runs["cube_standard"])
        notes.append(f"`cube_standard` fails by noise: {failed} of {len(runs['cube_standard'])} seeds end above 25 %.")
    return "".join(f"\n{note}\n" for note in notes)


def write(experiments):
    """From what experiments/measured/reconstructions and experiments/figures hold."""
    runs = {name: load(experiments / f"measured/reconstructions/{name}.csv") for name in RECONSTRUCTIONS}
    text = HEADER
    for title, counterparts in (("", False), ("\n## Counterparts\n\nOne setting is changed, and they should end far from the target.\n", True)):
        rows = [_row(n, e, runs[n]) for n, e in RECONSTRUCTIONS.items() if runs[n] and bool(e.counterpart_of) == counterparts]
        text += title + TABLE + "".join(rows) if rows else ""
    text += _notes(runs)
    drawn = [n for n in RECONSTRUCTIONS if (experiments / f"figures/{n}.png").exists()]
    text += "\n## Pictures\n" + PICTURE + "".join(f"\n`{n}`\n\n![{n}](figures/{n}.png)\n" for n in drawn) if drawn else ""
    temporary = experiments / "RESULTS.md.tmp"
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, experiments / "RESULTS.md")
