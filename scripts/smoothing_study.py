#!/usr/bin/python3
"""How good the smoothing is that `isochron reconstruct` chooses by evidence, against ten other weights of variation: the rabbit, and the
blob and the bust of shape_study.py, from three numbers of photons a point. The last level of each reconstruction is fitted again
with every weight, from the same start. Writes smoothing.csv after every reconstruction:

    shape, photons          per point
    factor, weight          the weight over the chosen one, and the weight
    median_mm, within_80_mm of the differences in depth, where surface and truth are seen
    silhouette              intersection over union of what is seen
    loss                    at the end
"""

import argparse
import itertools
import pathlib
import sys
from types import SimpleNamespace

import yaml

import rabbit_capture
import rabbit_errors
import shape_study
from isochron.mesh_files import read_mesh
from reproduction.measure import program, summary
from reproduction.study import study
from reproduction.tables import markdown

COLUMNS = "shape", "photons", "factor", "weight", "median_mm", "within_80_mm", "silhouette", "loss"
SHAPES, PHOTONS = ("rabbit", "blob", "bust"), (20, 200, 2000)
FACTORS = tuple(10 ** (half / 2) for half in range(-5, 6))  # the chosen weight among them
ITERATIONS = 4
STUDY = SimpleNamespace(background=0.5, samples=2**28, seed=1)


def capture(shape, photons, path):
    if shape != "rabbit":
        shape_study.capture(shape_study.shapes()[shape], SimpleNamespace(photons=photons, **vars(STUDY)), path)
        return
    rabbit_capture.main([path, "--counts", photons, "--seed", STUDY.seed])


def depths(shape, mesh):
    """On lines at right angles to the wall; mesh: None for the truth."""
    if shape == "rabbit":
        return rabbit_errors.depths(*(mesh or read_mesh(rabbit_errors.SCENE / "rabbit.obj")))
    study = shape_study.shapes()[shape]
    return shape_study.seen(mesh or shape_study.together(study.parts), study)


def errors(shape, path):
    """The columns behind the weight, but the loss."""
    found = rabbit_errors.compared(depths(shape, read_mesh(path)), depths(shape, None))
    return tuple(found[column] for column in COLUMNS[4:7])


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
    chosen = yaml.safe_load(last.read_text(encoding="utf-8"))["parameters"][0]["smoothing"]["variation"]
    again = folder / "again"
    for factor in FACTORS:
        program("run", last, "-o", again, "--force", "--set", f"parameters.shape.smoothing.variation={factor * chosen!r}", "--set",
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
        table.append([shape, photons, chosen["weight"], *cells])
    return markdown(["shape", "photons", "weight", "median, mm", "over the best (its factor)", "80 %, mm", "over the best (its factor)"], table)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shapes", nargs="+", choices=SHAPES, default=SHAPES, help="default: all")
    parser.add_argument("--photons", type=int, nargs="+", default=PHOTONS, help="per point (default 20 200 2000)")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for captures and runs, which are taken if they are there")
    return study(parser, "smoothing.csv", COLUMNS,
                 lambda options, folder: (grid(*case, folder) for case in itertools.product(options.shapes, options.photons)), table_of)


if __name__ == "__main__":
    sys.exit(main())
