#!/usr/bin/python3
"""What one evaluation of a capture's fit takes: expected counts and gradient, 64 samples per point each, of the albedos of
40 x 40 vertices and their board's depth and tilts, over numbers of points and of bins within the same 3.84 ns.

    scripts/capture_cost.py measure CSV   some minutes
    scripts/capture_cost.py table CSV     prints CPU seconds, in Markdown
"""

import pathlib
import statistics
import sys
import tempfile

import numpy as np

from reproduction.measure import ROOT, program
from reproduction.tables import markdown, read_rows, run_action, write_rows

POINTS = (16, 32, 64)  # along each side
BINS = (128, 256, 512, 1024)
WINDOW = 3840  # ps
FEW, MANY = 2, 8  # iterations: their difference leaves out what is made once
ROUNDS = 3
THREADS = 2
COLUMNS = ("points", "bins", "round", "wall_seconds", "cpu_seconds")

SCENE = """\
capture:
  sensor: {{corner: [-0.35, 0.35, 0], across: [0.7, 0, 0], down: [0, -0.7, 0], size: [{points}, {points}]}}
  normal: [0, 0, 1]
  laser: confocal
materials:
  paper: {{type: diffuse, albedo: 0.5, two_sided: true}}
shapes:
  - {{name: board, file: {plane}, material: paper, transform: {{translate: [0, 0, 0.5]}}}}
"""

EXPERIMENT = """\
name: cost
scene: scene.yaml
max_bounces: 1
gates: {{kind: bins, unit: ps, scene_unit_m: 1, start: 2880, width: {width}, count: {bins}, response: {response}}}
parameters:
  - {{name: depth, type: translation, shape: board, direction: [0, 0, 1], initial: -0.01, target: 0}}
  - {{name: tilt_x, type: rotation, shape: board, axis: [1, 0, 0], pivot: center, initial: 0, target: 1}}
  - {{name: tilt_y, type: rotation, shape: board, axis: [0, 1, 0], pivot: center, initial: 0, target: 1}}
  - {{name: albedo, type: albedo, shape: board, per: vertex, initial: 0.4, target: 0.5}}
target: {{samples: 64}}
samples: {{primal: 64, interior: 64, visibility: 0, path_length: 0}}
optimizer: {{method: adam, learning_rate: 0.001, iterations: {iterations}}}
"""


def run(folder, points, bins, iterations):
    """CPU seconds of the whole run, and the least wall seconds of an iteration but the first."""
    values = {"points": points, "bins": bins, "iterations": iterations, "width": WINDOW / bins,
              "plane": ROOT / "scenes/hidden_s/plane.obj", "response": ROOT / "scenes/letter/response.csv"}
    (folder / "scene.yaml").write_text(SCENE.format(**values), encoding="utf-8")
    (folder / "cost.yaml").write_text(EXPERIMENT.format(**values), encoding="utf-8")
    usage = program("run", folder / "cost.yaml", "-o", folder / "run", "--force", "--threads", THREADS)
    wall = np.diff([float(row["seconds"]) for row in read_rows(folder / "run/log.csv")])
    return usage.cpu_seconds, min(wall)


def measure(file):
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        for turn in range(1, ROUNDS + 1):
            for points in POINTS:
                for bins in BINS:
                    few, _ = run(folder, points, bins, FEW)
                    many, wall = run(folder, points, bins, MANY)
                    rows.append((points, bins, turn, f"{wall:.4g}", f"{(many - few) / (MANY - FEW):.4g}"))
            write_rows(file, COLUMNS, rows)


def table_of(rows):
    def entry(points, bins):
        own = [row for row in rows if (int(row["points"]), int(row["bins"])) == (points, bins)]
        return f"{statistics.median(float(row['cpu_seconds']) for row in own):.2g}"

    return markdown(["points", *(f"{bins} bins" for bins in BINS)],
                    [[f"{points} x {points}", *(entry(points, bins) for bins in BINS)] for points in POINTS])


def table(file):
    print(table_of(read_rows(file)))


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, table))
