#!/usr/bin/python3
"""How far `isochron reconstruct` and back-projection come from hidden shapes other than the rabbit's, with the same photons: a blob with horns
and a handle, a bust, two tilted plates of different albedos, the blob from one spot and from 8 x 8 spots of the laser, and before a
wall of 2 m with bins of 32 ps. Writes experiments/measured/shapes.csv after every capture:

    shape                         see above
    method                        fit or back_projection
    median_mm, within_80_mm       of the differences in depth, where back-projection and truth see something
    silhouette                    intersection over union of what is seen
    seconds                       wall, of the whole method, of the reconstruction with its pictures and report
    verdict, deviance_over_floor  of the fit
    covered                       share of the true depths within three standard errors of the fit's
"""

import argparse
import dataclasses
import pathlib
import sys
import tempfile
import time

import numpy as np

import rabbit_capture
import rabbit_errors
from isochron.mesh_files import read_mesh
from isochron.pictures.raster import Seen
from reproduction.measure import program, summary
from reproduction.study import study
from reproduction.tables import markdown
from scenes import mesh
from scenes.implicit import Blobs, polygonise

COLUMNS = "shape", "method", "median_mm", "within_80_mm", "silhouette", "seconds", "verdict", "deviance_over_floor", "covered"


def blobs(parts, low, high, cell=0.006):
    field = Blobs()
    for part in parts:
        field.add(*part)
    vertices, triangles = polygonise(field, low, high, cell)
    return mesh.rounded((vertices, triangles))


def horned():
    """0.3 m high, from 0.37 m of the wall on."""
    ring = [(0.105 + 0.055 * np.cos(a), -0.02 + 0.06 * np.sin(a), 0.46) for a in np.linspace(-1.9, 1.9, 12)]
    return blobs([((0, -0.02, 0.47), (0.085, 0.1, 0.08)), ((-0.05, 0.09, 0.46), (0.022, 0.06, 0.022), 20),
                  ((0.05, 0.09, 0.46), (0.022, 0.06, 0.022), -20)] + [(centre, (0.022, 0.022, 0.022)) for centre in ring],
                 (-0.2, -0.2, 0.3), (0.25, 0.25, 0.65))


def bust():
    return blobs([((0, 0.06, 0.47), (0.058, 0.075, 0.065)), ((0, 0.045, 0.4), (0.012, 0.02, 0.02)), ((0, -0.03, 0.49), (0.035, 0.05, 0.035)),
                  ((0, -0.11, 0.5), (0.13, 0.05, 0.06))], (-0.25, -0.25, 0.3), (0.25, 0.25, 0.65))


def plate(centre, size, turn, nod):
    """A rectangle that faces the wall, turned about y and then about x, in degrees."""
    x, y = 0.5 * np.array(size)
    vertices = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
    for degrees, (i, j) in ((turn, (2, 0)), (nod, (1, 2))):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        vertices[:, [i, j]] = vertices[:, [i, j]] @ np.array([[c, s], [-s, c]])
    return vertices + centre, np.array([[0, 2, 1], [0, 3, 2]])


@dataclasses.dataclass
class Shape:
    parts: list  # (vertices, triangles, albedo)
    points: int = 64  # of the wall along each side
    spots: int = 0  # along each side; 0: confocal
    side: float = 0.5  # of the wall, metres
    bin: float = 16  # picoseconds
    bins: int = 512

    def histograms(self):
        return self.points**2 * max(1, self.spots) ** 2


def shapes():
    blob = [(*horned(), 0.75)]
    vertices, triangles = horned()
    return {
        "blob": Shape(blob),
        "bust": Shape([(*bust(), 0.75)]),
        "plates": Shape([(*plate((-0.09, 0.02, 0.42), (0.14, 0.2), 20, 0), 0.8), (*plate((0.1, -0.02, 0.5), (0.15, 0.16), -10, 15), 0.4)]),
        "one_spot": Shape(blob, spots=1),
        "spots": Shape(blob, points=16, spots=8),
        "wide": Shape([(vertices * 4, triangles, 0.75)], side=2, bin=32, bins=1024),
    }


def seen(surface, shape):
    """Depths on 301 x 301 lines at right angles to the wall, over a fifth more than its width."""
    return Seen(*surface, lines(shape), lines(shape)).depth


def lines(shape):
    return np.linspace(-0.6 * shape.side, 0.6 * shape.side, 301)


def together(parts):
    vertices, triangles, before = [], [], 0
    for v, t, _ in parts:
        vertices.append(v)
        triangles.append(np.asarray(t) + before)
        before += len(v)
    return np.concatenate(vertices), np.concatenate(triangles)


def scene(shape, folder):
    half, n = 0.5 * shape.side, shape.points
    laser = "confocal"
    if shape.spots:
        at = half * (2 * (np.arange(shape.spots) + 0.5) / shape.spots - 1) if shape.spots > 1 else [0.2 * half]
        laser = f"{{points: {[[float(x), float(y), 0.0] for y in at for x in at]}}}"
    materials = shown = ""
    for i, (vertices, triangles, albedo) in enumerate(shape.parts):
        mesh.write_obj(folder / f"part{i}.obj", (vertices, triangles), "Part")
        materials += f"  m{i}: {{type: diffuse, albedo: {albedo}}}\n"
        shown += f"  - {{name: part{i}, file: part{i}.obj, material: m{i}}}\n"
    return (f"capture:\n  sensor: {{corner: [{-half}, {half}, 0], across: [{shape.side}, 0, 0], down: [0, {-shape.side}, 0], size: [{n}, {n}]}}\n"
            f"  normal: [0, 0, 1]\n  laser: {laser}\nmaterials:\n{materials}shapes:\n{shown}")


def capture(shape, options, path):
    """Writes the counts of a detector, as rabbit_capture.py does."""
    settings = rabbit_capture.EXPERIMENT.format(samples=options.samples // shape.histograms(), bounces=1).replace("shape: rabbit", "shape: part0")
    settings = settings.replace("width: 16, count: 512", f"width: {shape.bin}, count: {shape.bins}")
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        light = rabbit_capture.expected(folder, scene(shape, folder), settings, options.seed)
    counts = np.random.default_rng(options.seed).poisson(rabbit_capture.means(light, options.photons, options.background))
    rabbit_capture.write(path, light, counts, light.laser if shape.spots else None)


def rows(name, shape, options, folder):
    path = folder / f"{name}.h5"
    if not path.exists():
        capture(shape, options, path)
    true = seen(together(shape.parts), shape)
    *projected, spent = rabbit_errors.surface(path)
    shown = seen(projected, shape)
    start = time.monotonic()
    program("reconstruct", path, "-o", folder / name, "--response", rabbit_errors.SCENE / "response.csv", "--seconds", options.seconds,
            "--seed", options.seed, "--force", pictures=True)
    seconds = time.monotonic() - start
    surface, fit = folder / name / "geometry/final_surface.ply", summary(folder / name)["fit"]
    found, covered = seen(read_mesh(surface), shape), rabbit_errors.covered(surface, true, lines(shape))
    verdict_of_fit = fit["verdict"], f"{fit['deviance'] / fit['floor']:.4f}", f"{covered:.3f}"
    for method, depths, took, *verdict in (("back_projection", shown, spent["seconds"], "", "", ""),
                                           ("fit", found, seconds, *verdict_of_fit)):
        off = 1000 * (depths - true)
        errors = rabbit_errors.errors_of_depths(off[np.isfinite(off) & np.isfinite(shown)])
        numbers = (*errors.values(), rabbit_errors.compared(depths, true)["silhouette"], took)
        yield name, method, *(f"{value:.3g}" for value in numbers), *verdict


def table_of(rows):
    """For experiments/README.md: reconstruction / back-projection in each cell."""
    by = {(row["shape"], row["method"]): row for row in rows}
    table = []
    for shape in dict.fromkeys(shape for shape, _ in by):
        fit, other = by[shape, "fit"], by[shape, "back_projection"]
        cells = [f"{fit[key]} / {other[key]}" if fit[key] else "" for key in ("median_mm", "within_80_mm", "silhouette", "seconds")]
        table.append([shape.replace("_", " "), *cells, fit["verdict"], f"{100 * float(fit['covered']):.1f} %"])
    return markdown(["shape", "median, mm", "80 %, mm", "silhouette", "seconds", "verdict", "within 3 errors"], table)


def main():
    known = shapes()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shapes", nargs="+", choices=known, default=list(known), help="default: all")
    parser.add_argument("--photons", type=float, default=2000, help="per histogram, on average (default 2000)")
    parser.add_argument("--background", type=float, default=0.5, help="photons per bin beside them (default 0.5)")
    parser.add_argument("--samples", type=int, default=2**28,
                        help="of the expected counts in all: their noise has to be far below that of the photons (default 2^28)")
    parser.add_argument("--seconds", type=float, default=300, help="of each reconstruction (default 300)")
    parser.add_argument("--seed", type=int, default=1, help="of all random numbers (default 1)")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for runs, and for captures, which are taken as they are where they are there "
                        "(made with whatever options); default: a temporary one")
    return study(parser, "shapes.csv", COLUMNS,
                 lambda options, folder: (rows(name, known[name], options, folder) for name in options.shapes), table_of)


if __name__ == "__main__":
    sys.exit(main())
