#!/usr/bin/python3
"""How good the smoothing is that `isochron reconstruct` chooses by evidence, against ten other weights of bending: the rabbit, and the
blob and the bust of shape_study.py, from three numbers of photons a point. The last level of each reconstruction is fitted again
with every weight, from the same start. Writes smoothing.csv after every reconstruction:

    shape, photons          per point
    factor, bending         of the weight over the chosen one, and the weight
    median_mm, within_80_mm of the differences in depth, where surface and truth are seen
    silhouette              intersection over union of what is seen
    loss                    at the end
"""

import argparse
import itertools
import pathlib
import subprocess
import sys
import tempfile
from types import SimpleNamespace

import numpy as np
import yaml

import rabbit_errors
import shape_study
from isochron.mesh_files import read_mesh
from reproduction.measure import ROOT, program, summary
from reproduction.tables import markdown, read_rows, write_rows

COLUMNS = "shape", "photons", "factor", "bending", "median_mm", "within_80_mm", "silhouette", "loss"
SHAPES, PHOTONS = ("rabbit", "blob", "bust"), (20, 200, 2000)
FACTORS = tuple(10 ** (half / 2) for half in range(-5, 6))  # the chosen weight among them
ITERATIONS = 4
STUDY = SimpleNamespace(background=0.5, samples=2**28, seed=1)


def capture(shape, photons, path):
    if shape != "rabbit":
        shape_study.capture(shape_study.shapes()[shape], SimpleNamespace(photons=photons, **vars(STUDY)), path)
        return
    subprocess.run([sys.executable, ROOT / "scripts/rabbit_capture.py", path, "--counts", str(photons), "--seed", str(STUDY.seed)], check=True)


def depths(shape, mesh):
    """On lines at right angles to the wall; mesh: None for the truth."""
    if shape == "rabbit":
        return rabbit_errors.depths(*(mesh or read_mesh(rabbit_errors.SCENE / "rabbit.obj")))
    study = shape_study.shapes()[shape]
    return shape_study.seen(mesh or shape_study.together(study.parts), study)


def errors(shape, path):
    """The columns behind the weight, but the loss."""
    found, true = depths(shape, read_mesh(path)), depths(shape, None)
    off, either = 1000 * (found - true), np.isfinite(found) | np.isfinite(true)
    return *rabbit_errors.errors_of_depths(off[np.isfinite(off)]).values(), np.isfinite(off).sum() / either.sum()


def reconstruction(shape, photons, folder):
    """The folder of a run, made unless it is there."""
    run = folder / f"{shape}-{photons}"
    if not (run / "geometry/final_surface.ply").exists():
        path = folder / f"{shape}-{photons}.h5"
        capture(shape, photons, path)
        program("reconstruct", path, "-o", run, "--response", rabbit_errors.SCENE / "response.csv", "--seed", STUDY.seed, "--force")
    return run


def grid(shape, photons, folder):
    run = reconstruction(shape, photons, folder)
    last = max((run / "levels").iterdir(), key=lambda level: int(level.name)) / "experiment.yaml"
    chosen = yaml.safe_load(last.read_text(encoding="utf-8"))["parameters"][0]["smoothing"]["bending"]
    again = folder / "again"
    for factor in FACTORS:
        program("run", last, "-o", again, "--force", "--set", f"parameters.shape.smoothing.bending={factor * chosen!r}", "--set",
                f"optimizer.iterations={ITERATIONS}")
        numbers = factor, factor * chosen, *errors(shape, again / "geometry/final_surface.ply"), summary(again)["loss_final"]
        yield shape, photons, *(f"{number:.4g}" for number in numbers)


def table_of(rows):
    """For optim/README.md: errors by the chosen weight, and over the least of all weights."""
    table = []
    for (shape, photons), own in itertools.groupby(rows, key=lambda row: (row["shape"], row["photons"])):
        own = list(own)
        chosen = next(row for row in own if float(row["factor"]) == 1)
        cells = []
        for error in "median_mm", "within_80_mm":
            best = min(own, key=lambda row: float(row[error]))
            cells += [chosen[error], f"{float(chosen[error]) / float(best[error]):.2f} ({float(best['factor']):.2g})"]
        table.append([shape, photons, chosen["bending"], *cells])
    return markdown(["shape", "photons", "weight", "median, mm", "over the best (its factor)", "80 %, mm", "over the best (its factor)"], table)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shapes", nargs="+", choices=SHAPES, default=SHAPES, help="default: all")
    parser.add_argument("--photons", type=int, nargs="+", default=PHOTONS, help="per point (default 20 200 2000)")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for captures and runs, which are taken if they are there")
    parser.add_argument("--output", type=pathlib.Path, default=ROOT / "experiments/measured", help="default: experiments/measured")
    parser.add_argument("--table", action="store_true", help="print the table of what was measured before, as a page has it")
    options = parser.parse_args()
    if options.table:
        print(table_of(read_rows(options.output / "smoothing.csv")))
        return 0
    table = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for shape, photons in itertools.product(options.shapes, options.photons):
            for row in grid(shape, photons, folder):
                table.append(row)
                print(*row, flush=True)
            write_rows(options.output / "smoothing.csv", COLUMNS, table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
