#!/usr/bin/python3
"""What many time bins take: `render` and `derive` (one unknown) of the cube, 256 x 256 pixels and 16 samples, with 10 bins and with
1000 over the same lengths, grey and in colour.

    scripts/cube_cost.py measure CSV   some minutes: CPU seconds, those of the pictures with them, and peak memory
    scripts/cube_cost.py table CSV     a table in Markdown
"""

import pathlib
import re
import subprocess
import sys
import tempfile

from reproduction.measure import PROGRAM, ROOT
from reproduction.tables import read_rows, run_action, write_rows

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


def usage(command, experiment, folder, *options):
    """CPU seconds of the program and its pictures, and the most memory that one process had, in bytes."""
    time = ["/usr/bin/env", "time", "-f", "%U %S %M"]
    arguments = [str(PROGRAM), command, str(experiment), "-o", str(folder / "out"), "--quiet", "--threads", "1", *options]
    least = None
    for _ in range(RUNS):
        result = subprocess.run(time + arguments, capture_output=True, text=True, check=True)
        user, system, kilobytes = map(float, result.stderr.strip().splitlines()[-1].split())
        if least is None or user + system < least[0]:
            least = (user + system, 1024 * kilobytes)
    return least


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
                for pictures in ("yes", "no"):
                    options = [] if pictures == "yes" else ["--no-plots"]
                    (few, _), (many, memory) = (usage(command, experiments[count], folder, *options) for count in BINS)
                    rows.append((command, 3 if colour else 1, pictures, f"{few:.3f}", f"{many:.3f}", f"{memory:.0f}"))
                    write_rows(file, COLUMNS, rows)


def table_of(rows):
    lines = ["| | pictures | 10 bins | 1000 bins | ratio | memory | of the result |", "|---|---|---|---|---|---|---|"]
    for row in rows:
        few, many, memory = (float(row[key]) for key in ("seconds_10_bins", "seconds_1000_bins", "peak_bytes"))
        result = 4 * 256 * 256 * BINS[1] * int(row["channels"])
        lines.append(f"| `{row['command']}`, {'colour' if row['channels'] == '3' else 'grey'} | {row['pictures']} | {few:.2f} s "
                     f"| {many:.2f} s | {many / few:.2f} | {memory / 1e6:.0f} MB | {memory / result:.2f} |")
    return "\n".join(lines)


def table(file):
    print(table_of(read_rows(file)))


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, table))
