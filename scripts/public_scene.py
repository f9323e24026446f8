#!/usr/bin/python3
"""What images and derivatives of a transient scene of Mitsuba's formats take, and how precise they are. The scene is imported as it is.
One unknown moves some of its shapes together.

    scripts/public_scene.py measure SCENE.xml SHAPE[,SHAPE...] X,Y,Z CSV PNG   the shapes' names (scripts/import_scene.py writes them into
                                                                              scene.yaml) and their motion per unit of the unknown
    scripts/public_scene.py table CSV                                          prints the measurement, in Markdown
"""

import pathlib
import re
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import yaml
from matplotlib import colors

import import_scene
from isochron import exr
from isochron.pictures import sheets
from isochron.pictures.scales import PERCENTILE, scale_of, srgb
from reproduction.measure import Failure, program
from reproduction.tables import Usage as WrongUsage
from reproduction.tables import markdown, read_rows, run_action, write_rows

SAMPLES = {"image": (16, 256), "derivative": (16, 64)}  # per pixel, for all frames together; the last make the reference
SEEDS = 3  # images that noise is estimated from
LIT = 0.9  # of the light, or of the magnitudes of the derivative: what the frames hold that errors are taken in
METRES_PER_NS = 0.299792458
WINDOWS, CELLS = 6, 128  # of time, and of an image's width, in the picture
COLUMNS = ("what", "samples", "seeds", "wall_seconds", "cpu_seconds", "peak_mib", "lit_frames", "pixel_error", "mean_error")
WORDS = {"image": "images", "derivative": "derivative"}


def numbers(text):
    try:
        found = [float(word) for word in text.split(",")]
    except ValueError:
        found = []
    if len(found) != 3:
        raise WrongUsage
    return found


def imported(scene, shapes, along, folder):
    """The experiment's file: as imported, with a parameter for each of the shapes."""
    options = import_scene.parse([str(scene), "-o", str(folder / "scene")])
    if import_scene.import_scene(options) != 0:
        raise Failure(f"{scene}: not imported")
    file = folder / "scene/experiment.yaml"
    experiment = yaml.safe_load(file.read_text(encoding="utf-8"))
    if experiment["gates"]["kind"] != "bins":
        raise Failure(f"{scene}: its film has no bins")
    # For frames so much wider than light takes to cross a pixel the program chooses it by itself, but reserves memory for the others.
    experiment["estimator"] = {"sampling": "standard"}
    experiment["parameters"] = [{"name": f"move_{i}", "type": "translation", "shape": shape, "direction": along, "initial": 0}
                                for i, shape in enumerate(shapes)]
    file.write_text(yaml.safe_dump(experiment, sort_keys=False), encoding="utf-8")
    return file


def stack(file, component=""):
    """[frame, row, column, channel] of one component alone: derivatives have four, and each can have a gigabyte."""
    name = re.compile(re.escape(component + "." if component else "") + r"gate(\d+)\.([RGBY])")
    found = [(int(match[1]), match[2], channel) for channel in exr.channel_names(file) if (match := name.fullmatch(channel))]
    images = exr.read(file, {channel for _, _, channel in found})
    order = "Y" if found[0][1] == "Y" else "RGB"
    shape = next(iter(images.values())).shape
    result = np.zeros((1 + max(gate for gate, _, _ in found), *shape, len(order)), np.float32)
    for gate, colour, channel in found:
        result[gate, ..., order.index(colour)] = images.pop(channel)
    return result


def render(experiment, count, seed, folder, _):
    usage = program("render", experiment, "-o", folder, "--samples", count, "--seed", seed)
    return usage, stack(folder / "render.exr"), [read_rows(folder / "render.csv")]


def derive(experiment, count, seed, folder, shapes):
    """The sum over the shapes that move, whose derivatives share their random numbers."""
    usage = program("derive", experiment, "-o", folder, "--samples", count, "--seed", seed)
    total = 0
    for i in range(shapes):
        total = total + stack(folder / f"move_{i}.exr", "total")
    rows = [row for row in read_rows(folder / "derive.csv") if row["component"] == "total"]
    return usage, total, [[row for row in rows if row["parameter"] == f"move_{i}"] for i in range(shapes)]


def mean_errors(parts):
    """[frame]: relative standard error that the program states of the frame's mean; of a sum of parts as if they were independent."""
    mean, variance = 0, 0
    for rows in parts:
        mean = mean + np.array([float(row["mean"]) for row in rows])
        variance = variance + np.array([float(row["standard_error"]) for row in rows]) ** 2
    return np.sqrt(variance) / np.maximum(np.abs(mean), np.finfo(float).tiny)


def brightest(values):
    """Which hold the LIT part of the sum."""
    order = np.sort(values)[::-1]
    sums = np.cumsum(order)
    return (values > 0) & (values >= order[np.searchsorted(sums, LIT * sums[-1])])


def by_frame(values):
    return values.sum(axis=(1, 2), dtype=np.float64)


class Noise:
    """Of images over seeds, in grey; their mean also in colour."""

    def __init__(self):
        self.count, self.sum, self.squares, self.colour = 0, 0, 0, 0
        self.usages, self.mean_errors = [], []

    def add(self, usage, image, parts):
        grey = image.mean(axis=-1)
        self.count += 1
        self.sum = self.sum + grey
        self.squares = self.squares + grey**2
        self.colour = self.colour + image
        self.usages.append(usage)
        self.mean_errors.append(mean_errors(parts))

    def variance(self):
        """[frame]: of one image, summed over pixels."""
        return (by_frame(self.squares) - by_frame(self.sum**2) / self.count) / (self.count - 1)

    def signal(self):
        """[frame]: square of the expected image, summed over pixels."""
        return by_frame((self.sum / self.count) ** 2) - self.variance() / self.count

    def light(self):
        """[frame]: magnitude of what all pixels sum up to."""
        return np.abs(by_frame(self.sum / self.count))

    def row(self, what, samples, reference):
        """Medians over lit frames, of one image: the noise of its pixels, relative to their root mean square, and the error of its
        mean. Times are the least of all seeds: others may use the machine, too."""
        lit = brightest(reference.light())
        pixels = np.sqrt(np.maximum(self.variance()[lit], 0) / np.maximum(reference.signal()[lit], np.finfo(float).tiny))
        usages = self.usages
        return (what, samples, self.count, f"{min(u.seconds for u in usages):.3g}", f"{min(u.cpu_seconds for u in usages):.3g}",
                f"{max(u.peak_mib for u in usages):.0f}", int(lit.sum()), f"{np.median(pixels):.3g}",
                f"{np.median(np.mean(self.mean_errors, axis=0)[lit]):.3g}")


def measure(scene, shapes, along, csv, picture):
    shapes, along, rows, pictures = shapes.split(","), numbers(along), [], {}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        try:
            experiment = imported(scene, shapes, along, folder)
            for what, act in (("image", render), ("derivative", derive)):
                found = {}
                for samples in SAMPLES[what]:
                    found[samples] = Noise()
                    for seed in range(1, SEEDS + 1):
                        found[samples].add(*act(experiment, samples, seed, folder / what, len(shapes)))
                rows += [noise.row(what, count, found[samples]) for count, noise in found.items()]
                pictures[what] = found[samples].colour / SEEDS
                write_rows(csv, COLUMNS, rows)
        except Failure as failure:
            sys.exit(f"public_scene.py: {failure}")
        gates = yaml.safe_load(experiment.read_text(encoding="utf-8"))["gates"]
    draw(pictures["image"], pictures["derivative"].mean(axis=-1), gates, picture)


def windows(images):
    """WINDOWS runs of frames, first and end, which hold equal parts of the light: most of it comes early, its tail is long."""
    light = np.cumsum(images.sum(axis=(1, 2, 3), dtype=np.float64))
    parts = np.linspace(1e-4, 1 - 1e-4, WINDOWS + 1)
    edges = np.unique(np.searchsorted(light, parts * light[-1]))
    edges[-1] += 1
    return list(zip(edges[:-1], edges[1:]))


def coarser(image):
    """Means of blocks of pixels, so that it has about CELLS columns: less noise, and a smaller file."""
    block = max(image.shape[1] // CELLS, 1)
    rows, columns = (length // block for length in image.shape[:2])
    cut = image[: rows * block, : columns * block]
    return cut.reshape(rows, block, columns, block, *image.shape[2:]).mean(axis=(1, 3))


def draw(images, slopes, gates, file):
    """Sums over runs of frames, each at its own exposure, above the derivative in them, all on one scale; at the left of all frames."""
    start, width = gates["start"] / METRES_PER_NS / 1000, gates["width"] / METRES_PER_NS / 1000
    columns = [(f"all {len(images)} frames\n", images.sum(axis=0), slopes.sum(axis=0))]
    for first, end in windows(images):
        title = f"frames {first} to {end - 1}\n{start + first * width:.2f} to {start + end * width:.2f} µs"
        columns.append((title, images[first:end].sum(axis=0), slopes[first:end].sum(axis=0)))
    side = 2.0
    figure, axes = plt.subplots(2, len(columns), figsize=(side * len(columns) + 0.4, 2 * side + 0.75), layout="constrained", squeeze=False)
    steepest = np.percentile(np.abs([coarser(slope) for _, _, slope in columns]), PERCENTILE) or 1
    for column, (title, image, slope) in zip(axes.T, columns):
        column[0].set_title(title, fontsize=8)
        image = coarser(image)
        shown = srgb(image / scale_of(image))
        column[0].imshow(shown[..., 0] if shown.shape[-1] == 1 else shown, cmap="gray", vmin=0, vmax=1, interpolation="nearest")
        column[1].imshow(coarser(slope), cmap="RdBu_r", norm=colors.Normalize(-steepest, steepest), interpolation="nearest")
    for row, words in zip(axes, ("light", "derivative")):
        row[0].set_ylabel(words, fontsize=9)
    for cell in axes.flat:
        cell.set(xticks=[], yticks=[])
    figure.suptitle("Light by its time of arrival, and its derivative by the unknown: red brighter, blue darker", fontsize=9)
    sheets.save(figure, pathlib.Path(file))


def table_of(rows):
    errors = lambda row: (f"{float(f'{100 * float(row[name]):.2g}'):g} %" for name in ("pixel_error", "mean_error"))
    return markdown(["", "samples per pixel, all frames", "CPU", "memory", "error of a frame's pixels", "of a frame's mean"],
                    [[WORDS[row["what"]], row["samples"], f"{row['cpu_seconds']} s", f"{row['peak_mib']} MiB", *errors(row)]
                     for row in rows])


def table(csv):
    print(table_of(read_rows(csv)))


if __name__ == "__main__":
    sys.exit(run_action(__doc__, sys.argv[1:], measure, table))
