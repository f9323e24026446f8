#!/usr/bin/python3
"""Photon counts of the hidden rabbit (scenes/rabbit), as a single-photon detector would count them.

512 bins of 16 ps, from the time that light leaves the wall; expected counts are rendered, with the detector's response, and Poisson
numbers of these means and of the background are drawn.
"""

import argparse
import functools
import pathlib
import sys
import tempfile

import numpy as np

import use_package
from isochron import captures
from reproduction.measure import ROOT, program

SCENE = ROOT / "scenes/rabbit"
GRID = "size: [64, 64]"  # in scene.yaml
CONFOCAL = "laser: confocal"
FUR = "{type: diffuse, albedo: 0.75}"

EXPERIMENT = """\
name: rabbit
scene: scene.yaml
max_bounces: {bounces}
gates: {{kind: bins, unit: ps, scene_unit_m: 1, start: 0, width: 16, count: 512, response: response.csv}}
parameters:
  - {{name: z, type: translation, shape: rabbit, direction: [0, 0, 1], initial: 0, target: 0}}
target: {{samples: 1}}
samples: {{primal: {samples}, interior: 1, visibility: 0, path_length: 0}}
"""


def scene(options):
    """The scene's text, for other points of the wall and another laser."""
    text = (SCENE / "scene.yaml").read_text(encoding="ascii").replace("file: rabbit.obj", f"file: {SCENE / 'rabbit.obj'}")
    text = text.replace(GRID, f"size: [{options.points}, {options.points}]").replace(FUR, options.material)
    if options.spot:
        text = text.replace(CONFOCAL, f"laser: {{points: {[[x, y, 0.0] for x, y in options.spot]}}}")
    return text


def expected(folder, scene, settings, seed):
    """Of one photon per unit of gain, as a capture; the scene's other files are in the folder."""
    (folder / "scene.yaml").write_text(scene, encoding="utf-8")
    (folder / "response.csv").write_bytes((SCENE / "response.csv").read_bytes())
    (folder / "experiment.yaml").write_text(settings, encoding="utf-8")
    program("render", folder / "experiment.yaml", "-o", folder / "render", "--seed", seed)
    return captures.read_capture(folder / "render/render.h5")


@functools.lru_cache(maxsize=1)  # studies draw several numbers of photons of one seed
def expected_alone(scene, settings, seed):
    """The same where the scene needs no other file."""
    with tempfile.TemporaryDirectory() as temporary:
        return expected(pathlib.Path(temporary), scene, settings, seed)


def write(path, light, counts, laser):
    captures.write_capture(path, counts, light.delta_t, light.t_start, light.points, [0, 0, 1], laser, "simulated")


def means(light, photons, background):
    """So many photons per histogram on average, and per bin beside them."""
    return light.counts * (photons / light.counts.sum(axis=0, dtype=float).mean()) + background


def parser():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("output", type=pathlib.Path, nargs="?", default=SCENE / "capture.h5", help="default: scenes/rabbit/capture.h5")
    parser.add_argument("--points", type=int, default=64, help="of the wall along each side (default 64)")
    parser.add_argument("--counts", type=float, default=2000, help="photons from the rabbit per point, on average (default 2000)")
    parser.add_argument("--background", type=float, default=0.5, help="photons per bin beside them (default 0.5)")
    parser.add_argument("--spot", type=float, nargs=2, action="append", metavar=("X", "Y"),
                        help="a spot of the laser, in metres from the wall's middle; may be repeated; without: confocal")
    parser.add_argument("--bounces", type=int, default=1, help="on the rabbit (default 1)")
    parser.add_argument("--material", default=FUR, help=f"of the rabbit, as a scene has it (default {FUR})")
    parser.add_argument("--samples", type=int, default=32768, help="per point, of the expected counts (default 32768)")
    parser.add_argument("--seed", type=int, default=1, help="of all random numbers (default 1)")
    parser.add_argument("--no-noise", action="store_true", help="expected counts in place of Poisson numbers")
    return parser


def main(arguments=None):
    """Of the command line where there are no arguments."""
    options = parser().parse_args(None if arguments is None else list(map(str, arguments)))
    light = expected_alone(scene(options), EXPERIMENT.format(samples=options.samples, bounces=options.bounces), options.seed)
    counts = means(light, options.counts, options.background)
    if not options.no_noise:
        counts = np.random.default_rng(options.seed).poisson(counts)
    write(options.output, light, counts, light.laser if options.spot else None)
    return 0


if __name__ == "__main__":
    sys.exit(main())
