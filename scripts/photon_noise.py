#!/usr/bin/python3
"""What photon noise in the target does to reconstructions: error at the end against the number of photons.

    scripts/photon_noise.py measure CSV [NAME...]   a quarter of an hour; rows of other experiments stay
    scripts/photon_noise.py plot CSV PNG

For every experiment, count and draw of the noise: a run shortened as `SHORT` says, and its error at the end in % of the
initial one. Photons are counted per pixel and colour, on average over the brightest gate; 0 stands for no noise.
"""

import pathlib
import statistics
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import use_package
from isochron.pictures import sheets
from reproduction.measure import ROOT, program, summary
from reproduction.tables import Usage, read_rows, run_action, write_rows

PHOTONS = (1, 10, 100, 1000, 10_000, 100_000, 1_000_000, 0)
DRAWS = 3
SHORT = {
    "corridor": ("optimizer={method: adam, learning_rate: 0.015, iterations: 80, decay: {start: 45, half_life: 12}}",
                 "samples={primal: 4096, interior: 2048, visibility: 1536, path_length: 0}", "target.samples=524288"),
    "sofa": ("samples={primal: 256, interior: 256, visibility: 128, path_length: 64}", "target.samples=16384"),
}
COLUMNS = ("experiment", "photons", "draw", "error_percent")


def measure(file, *names):
    if not set(names) <= set(SHORT):
        raise Usage
    names = names or tuple(SHORT)
    rows = []
    if pathlib.Path(file).exists():
        rows = [tuple(r[c] for c in COLUMNS) for r in read_rows(file) if r["experiment"] not in names]
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary) / "run"
        for name in names:
            for draw in range(1, DRAWS + 1):
                for photons in PHOTONS:
                    # The target's seed draws the photons; the optimisation has other random numbers each time, too.
                    settings = [*SHORT[name], f"target.seed={100 + draw}"] + [f"target.noise.photons={photons}"] * (photons > 0)
                    words = [word for setting in settings for word in ("--set", setting)]
                    program("run", ROOT / f"experiments/{name}.yaml", "-o", folder, "--force", "--seed", draw, *words)
                    end = summary(folder)
                    error = 100 * end["param_rmse_final"] / end["param_rmse_initial"]
                    rows.append((name, photons, draw, f"{error:.4g}"))
                    print(*rows[-1], flush=True)
                    write_rows(file, COLUMNS, sorted(rows, key=lambda r: r[0]))


def plot(file, picture):
    rows = read_rows(file)
    figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
    for color, name in zip(("C0", "C3"), dict.fromkeys(r["experiment"] for r in rows)):
        points = [(int(r["photons"]), float(r["error_percent"])) for r in rows if r["experiment"] == name]
        counts = sorted({p for p, _ in points if p})
        middle = [statistics.median(e for p, e in points if p == count) for count in counts]
        axes.loglog(*zip(*(q for q in points if q[0])), ".", color=color, alpha=0.5)
        axes.loglog(counts, middle, "-", color=color, label=f"{name}, median")
        if clean := [e for p, e in points if not p]:
            axes.axhline(statistics.median(clean), color=color, ls=":", lw=1, label=f"{name}, no noise")
    axes.set_title("Reconstructions from counted photons")
    axes.set_xlabel("photons per pixel and colour in the brightest gate")
    axes.set_ylabel("error at the end, % of the initial one")
    axes.grid(True, which="both", lw=0.4, alpha=0.4)
    axes.legend(fontsize=8)
    sheets.save(figure, pathlib.Path(picture))


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, plot))
