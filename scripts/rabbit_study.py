#!/usr/bin/python3
"""How far from the hidden rabbit (scenes/rabbit) three methods come with the same photons: the reconstruction, back-projection, and the
light-cone transform (light_cone.py). Each sweep writes a table, experiments/measured/rabbit_SWEEP.csv, after every capture:

    method                        fit, back_projection or light_cone
    photons, points, limit, seed  per point, along each side of the wall, --seconds of the reconstruction, of all random numbers
    median_mm, within_80_mm       of the differences in depth, where method and truth see something
    shared_..._mm                 the same where back-projection sees something, too
    silhouette                    intersection over union of what is seen
    seconds                       wall, of the whole method
    verdict                       of the fit
    covered                       share of the true depths within three standard errors of the fit's

Sweep `verdicts` has photons as values, and reconstructions alone, of less work each: how often they explain, and what is covered then.

The transform has two settings, its filter's ratio of signal to noise and how bright a surface has to be. They are chosen by the truth, in
its favour: of all whose silhouette is within a tenth of the best, those with the least 80 % error.
"""

import argparse
import itertools
import pathlib
import shutil
import sys
import tempfile
import time

import numpy as np

import light_cone
import rabbit_capture
import rabbit_errors
from isochron.back_projection import METRES
from isochron.captures import read_capture
from isochron.mesh_files import read_mesh
from reproduction.measure import ROOT, Failure, program, summary
from reproduction.tables import markdown, read_rows, write_rows

RESPONSE = rabbit_errors.SCENE / "response.csv"
REACH = 0.7  # metres: beyond the rabbit as seen from the wall's corners
RATIOS, BRIGHTNESSES = (0.1, 1, 10, 100), (0.1, 0.15, 0.2, 0.25, 0.3)
METHODS = ("fit", "back_projection", "light_cone")
USUAL = {"photons": 2000, "points": 64, "seconds": 300}
SWEEPS = (*USUAL, "verdicts")
VERDICT_SECONDS = 60
COLUMNS = ("method", "photons", "points", "limit", "seed", "median_mm", "within_80_mm", "shared_median_mm", "shared_within_80_mm",
           "silhouette", "seconds", "verdict", "covered")


def by_light_cone(capture):
    """Vertices and triangles, and the seconds that one setting takes."""
    offsets, values = np.loadtxt(RESPONSE, delimiter=",", skiprows=1).T
    start, seconds, tried = time.monotonic(), None, []
    for volume in light_cone.volumes(capture, offsets[values.argmax()] * METRES["ps"], REACH, RATIOS):
        surfaces = [light_cone.surface(volume, least) for least in BRIGHTNESSES]
        seconds = seconds or time.monotonic() - start
        tried += [(rabbit_errors.errors(*surface), surface) for surface in surfaces]
    best = max(errors["silhouette"] for errors, _ in tried)
    good = [(errors["within_80_mm"], i) for i, (errors, _) in enumerate(tried) if errors["silhouette"] >= 0.9 * best]
    return tried[min(good)[1]][1], seconds


def by_fit(path, limit, seed, folder):
    """Vertices and triangles, or None where there is no signal; the verdict, and what is covered."""
    shutil.rmtree(folder, ignore_errors=True)  # nothing of another run may be taken for this one's
    try:
        program("reconstruct", path, "-o", folder, "--response", RESPONSE, "--seconds", limit, "--seed", seed)
    except Failure:
        if not (folder / "summary.yaml").exists() or summary(folder)["fit"]["verdict"] != "no_signal":
            raise
        return None, "no_signal", ""
    surface, true = folder / "geometry/final_surface.ply", rabbit_errors.depths(*read_mesh(rabbit_errors.SCENE / "rabbit.obj"))
    return read_mesh(surface), summary(folder)["fit"]["verdict"], f"{rabbit_errors.covered(surface, true, rabbit_errors.LINES):.3f}"


def row_of(found, seen, seconds, verdict="", covered=""):
    """The last columns; `seen`: depths of back-projection."""
    if found is None or not len(found[1]):
        return ("",) * 5 + (f"{seconds:.3g}", verdict, covered)
    depths, true = rabbit_errors.depths(*found), rabbit_errors.depths(*read_mesh(rabbit_errors.SCENE / "rabbit.obj"))
    errors, off = rabbit_errors.compared(depths, true), 1000 * (depths - true)
    shared = rabbit_errors.errors_of_depths(off[np.isfinite(off) & np.isfinite(seen)])
    numbers = (errors["median_mm"], errors["within_80_mm"], shared["median_mm"], shared["within_80_mm"], errors["silhouette"], seconds)
    return (*(f"{value:.3g}" for value in numbers), verdict, covered)


def measure(options, photons, points, limits, seed, folder):
    """Rows of one capture."""
    path = folder / "capture.h5"
    rabbit_capture.main([path, "--points", points, "--counts", photons, "--seed", seed])
    *projected, spent = rabbit_errors.surface(path)
    seen = rabbit_errors.depths(*projected)
    start = f"{photons:g}", points, "", seed
    if "back_projection" in options.methods:
        yield "back_projection", *start, *row_of(projected, seen, spent["seconds"])
    if "light_cone" in options.methods:
        found, seconds = by_light_cone(read_capture(path))
        yield "light_cone", *start, *row_of(found, seen, seconds)
    for limit in limits if "fit" in options.methods else ():
        began = time.monotonic()
        found, *verdict = by_fit(path, limit, seed, folder / "run")
        yield "fit", f"{photons:g}", points, f"{limit:g}", seed, *row_of(found, seen, time.monotonic() - began, *verdict)


def sweep(options, name):
    values = {**{key: [value] for key, value in USUAL.items()}, name: getattr(options, name)}
    if name == "verdicts":
        values.update(photons=options.verdicts, seconds=[VERDICT_SECONDS])
        options = argparse.Namespace(**{**vars(options), "methods": ["fit"]})
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        for seed, photons, points in itertools.product(range(options.first, options.first + options.seeds), values["photons"], values["points"]):
            for row in measure(options, photons, points, values["seconds"], seed, pathlib.Path(temporary)):
                rows.append(row)
                print(*row, flush=True)
            write_rows(options.output / f"rabbit_{name}.csv", COLUMNS, rows)


def spread(rows, key, factor=1.0, unit=""):
    """Of the draws that found something: the number, or the least and the most."""
    texts = [f"{factor * value:.3g}" for value in sorted(float(row[key]) for row in rows if row[key])]
    return " to ".join(dict.fromkeys((texts[0], texts[-1]))) + unit if texts else ""


def table_of_verdicts(rows):
    """For experiments/README.md: a line for each number of photons, with the least that is covered of an explained fit."""
    table = []
    for photons in dict.fromkeys(row["photons"] for row in rows):
        own = [row for row in rows if row["photons"] == photons]
        explained = [row for row in own if row["verdict"] == "explained"]
        least = min((float(row["covered"]) for row in explained), default=None)
        table.append([photons, f"{len(explained)} of {len(own)}", "" if least is None else f"{100 * least:.3g} %",
                      *(spread(own, key) for key in ("median_mm", "within_80_mm", "silhouette"))])
    return markdown(["photons", "explained", "least within 3 errors, explained", "median, mm", "80 %, mm", "silhouette"], table)


def table_of(rows, name):
    """For experiments/README.md: a line for each value of a sweep; the light-cone transform is in the figure alone."""
    column = {"seconds": "limit"}.get(name, name)
    fits, others = ([row for row in rows if row["method"] == method] for method in METHODS[:2])
    table = []
    for value in dict.fromkeys(row[column] for row in fits):
        own, same = ([row for row in of if row[column] in (value, "")] for of in (fits, others))
        explained = sum(row["verdict"] == "explained" for row in own)
        table.append([value, f"{explained} of {len(own)}", *(spread(own, key) for key in ("median_mm", "within_80_mm", "silhouette")),
                      spread(own, "covered", 100, " %"), *(spread(same, key) for key in ("median_mm", "within_80_mm", "silhouette"))])
    return markdown([{"seconds": "`--seconds`"}.get(name, name), "explained", "median, mm", "80 %, mm", "silhouette", "within 3 errors",
                     "back-projection: median, mm", "80 %, mm", "silhouette"], table)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--photons", type=float, nargs="+", help="sweep: 20 63 200 630 2000 6300 20000, for example")
    parser.add_argument("--points", type=int, nargs="+", help="sweep: 8 16 32 64")
    parser.add_argument("--seconds", type=float, nargs="+", help="sweep: 30 60 120 300")
    parser.add_argument("--verdicts", type=float, nargs="+", help=f"sweep: 20 200 2000; reconstructions of {VERDICT_SECONDS} s")
    parser.add_argument("--seeds", type=int, default=1, help="captures of each kind (default 1)")
    parser.add_argument("--first", type=int, default=1, help="seed of the first of them (default 1)")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=METHODS, help="default: all")
    parser.add_argument("--output", type=pathlib.Path, default=ROOT / "experiments/measured", help="default: experiments/measured")
    parser.add_argument("--table", choices=SWEEPS, help="print the table of a sweep that was measured before, as a page has it")
    options = parser.parse_args()
    if options.table:
        rows = read_rows(options.output / f"rabbit_{options.table}.csv")
        print(table_of_verdicts(rows) if options.table == "verdicts" else table_of(rows, options.table))
        return 0
    names = [name for name in SWEEPS if getattr(options, name)]
    if not names:
        parser.error(f"no sweep: give one of {', '.join(f'--{name}' for name in SWEEPS)}")
    for name in names:
        sweep(options, name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
