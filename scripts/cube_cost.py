#!/usr/bin/python3
"""What many time bins take: `render` and `derive` (one unknown) of the cube, 256 x 256 pixels and 16 samples, with 10 bins and with
1000 over the same lengths, grey and in colour.

    scripts/cube_cost.py measure CSV   some minutes: CPU seconds, those of the pictures with them, and peak memory
    scripts/cube_cost.py table CSV     a table in Markdown
"""

import pathlib
import re
import sys
import tempfile

from reproduction.measure import ROOT, program
from reproduction.tables import markdown, read_rows, run_action, write_rows

BINS = (10, 1000)
FROM, TO = 4, 10  # path lengths
RUNS = 3  # the least counts
COLUMNS = ("command", "channels", "pictures", "seconds_10_bins", "seconds_1000_bins", "peak_bytes")

EXPERIMENT = """\
name: bins
scene: {scene}
max_bounces: 1
gates: {{kind: bins, start: {start}, width: {width}, count: {count}}}
parameters:
  - {{name: height, type: translation, shape: cube, direction: [0, 1, 0], initial: 0.3, target: 0}}
target: {{samples: 16}}
samples: {{primal: 16, interior: 16, visibility: 16, path_length: 16}}
seed: 1
"""


def write_scene(folder, colour):
    text = (ROOT / "scenes/cube/scene.yaml").read_text()
    text = re.sub(r"resolution: \[\d+, \d+\]", "resolution: [256, 256]", text)
    text = re.sub(r"file: (\w+\.obj)", rf"file: {ROOT}/scenes/cube/\1", text)
    if colour:
        text = re.sub(r"(white: {type: diffuse, albedo: )[\d.]+", r"\1[0.6, 0.5, 0.3]", text)
    path = folder / f"scene{colour:d}.yaml"
    path.write_text(text)
    return path


def usage(command, experiment, folder, pictures):
    """Of the run that takes the fewest CPU seconds, those of its pictures with them."""
    runs = (program(command, experiment, "-o", folder / "out", "--threads", 1, pictures=pictures) for _ in range(RUNS))
    return min(runs, key=lambda run: run.cpu_seconds)


def measure(file):
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for colour in (False, True):
            scene = write_scene(folder, colour)
            experiments = {}
            for count in BINS:
                experiments[count] = folder / f"bins{colour:d}_{count}.yaml"
                experiments[count].write_text(
                    EXPERIMENT.format(scene=scene, start=FROM, width=(TO - FROM) / count, count=count))
            for command in ("render", "derive"):
                for pictures in (True, False):
                    few, many = (usage(command, experiments[count], folder, pictures) for count in BINS)
                    rows.append((command, 3 if colour else 1, "yes" if pictures else "no", f"{few.cpu_seconds:.3f}",
                                 f"{many.cpu_seconds:.3f}", f"{2**20 * many.peak_mib:.0f}"))
                    write_rows(file, COLUMNS, rows)


def table_of(rows):
    def cells(row):
        few, many, memory = (float(row[key]) for key in ("seconds_10_bins", "seconds_1000_bins", "peak_bytes"))
        result = 4 * 256 * 256 * BINS[1] * int(row["channels"])
        return (f"`{row['command']}`, {'colour' if row['channels'] == '3' else 'grey'}", row["pictures"], f"{few:.2f} s",
                f"{many:.2f} s", f"{many / few:.2f}", f"{memory / 1e6:.0f} MB", f"{memory / result:.2f}")

    return markdown(["", "pictures", "10 bins", "1000 bins", "ratio", "memory", "of the result"], map(cells, rows))


def table(file):
    print(table_of(read_rows(file)))


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, table))
