"""Draws what the program wrote into a folder: a false-colour PNG beside every EXR, residual.png (final - target), and
rmse.png from log.csv; of the run of a capture also capture.png (plot_capture.py), and of a reconstruction surface.png. With
--pixel or --row, instead of these, one pixel's or one row's light over the gates.

usage: plot.py DIR [--pixel COLUMN,ROW] [--row ROW]

  --pixel COLUMN,ROW  NAME_pixel_COLUMN_ROW.png for every EXR: intensity over the gates' centres
  --row ROW           NAME_row_ROW.png for every EXR: columns to the right, the gates' centres upwards

Columns count from the left, rows from the top, both from 0.
"""

import argparse
import csv
import pathlib
import re
import sys

import matplotlib
import numpy as np

matplotlib.use("Agg")
from isochron.command_line import Parser
from isochron.errors import InputError
from isochron.pictures.curves import plot_log, plot_pixel, plot_row
from isochron.pictures.reading import Folder, peaks, read_stack
from isochron.pictures.scales import pick_by_peaks, scale_of
from isochron.pictures.sheets import MOST_CHOSEN, MOST_COLUMNS, MOST_IMAGES, plot_derivatives, plot_images, plot_signed

RUN_IMAGES = ["target", "initial", "final"]  # share one scale, to be compared


class Pictures:
    """Pictures of one folder; what goes wrong with one of them is kept, a line each, and does not stop the others."""

    def __init__(self, directory, choose):
        """`choose`: of images of very many gates only those that sheets show are read."""
        self.directory, self.failures, self.stacks, self.gates = directory, [], {}, {}
        if not directory.is_dir():
            self.failures.append(f"{directory}: no such folder")
            return
        paths = sorted(directory.glob("*.exr"))
        self.log = directory / "log.csv"
        if not paths and not self.log.exists():
            self.failures.append(f"{directory}: neither *.exr nor log.csv")
            return
        self.folder = self.attempt(Folder, directory / "experiment.yaml", directory)
        if self.folder is None:
            return
        largest = {path: peaks(path) for path in paths} if choose else {}
        for path in paths:
            chosen = self.choice(path, largest) if largest.get(path) else None
            stacks = self.attempt(read_stack, path, path, chosen)
            if stacks is None:
                continue
            gates = self.attempt(self.folder.gates, path, path, max(len(s) for s in stacks.values()))
            if gates is not None:
                gates.read = chosen
                self.stacks[path], self.gates[path] = stacks, gates

    @staticmethod
    def choice(path, largest):
        """Gates of one file, by the largest values of all. The images of a run show the same."""
        own = largest[path]
        count = max(map(len, own.values()))
        most = MOST_COLUMNS if set(own) != {""} else MOST_IMAGES if count <= MOST_IMAGES else MOST_CHOSEN
        together = list(own.values())
        if path.stem in RUN_IMAGES:
            together += [p[""] for other, p in largest.items() if other.stem in RUN_IMAGES and "" in p]
        return pick_by_peaks(most, *(p for p in together if len(p) == len(together[0])))

    def attempt(self, action, path, *arguments):
        try:
            return action(*arguments)
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            self.failures.append(f"{path}: {error}")
        except InputError as error:
            self.failures.append(str(error))
        return None

    def title(self, what):
        name = self.folder.experiment
        return name if what == name else f"{name}: {what}"

    def draw(self):
        together = [self.gates[p].known(s[""]) for p, s in self.stacks.items() if p.stem in RUN_IMAGES and set(s) == {""}]
        for path, stacks in self.stacks.items():
            png, gates = path.with_suffix(".png"), self.gates[path]
            if set(stacks) == {""}:
                scale = scale_of(*together) if path.stem in RUN_IMAGES else scale_of(gates.known(stacks[""]))
                self.attempt(plot_images, path, png, self.title(path.stem), stacks[""], scale, gates)
            else:
                title = self.title(f"derivative by {path.stem}")
                self.attempt(plot_derivatives, path, png, title, stacks, path.stem, gates)
        self.draw_residual()
        if self.log.exists():
            quantity = next((g.quantity for g in self.gates.values()), self.folder.quantity)
            self.attempt(plot_log, self.log, self.log, self.folder.experiment, quantity)
        if (self.directory / "final.h5").exists():  # only captures have it
            self.attempt(self.draw_capture, self.directory / "capture.png")
        if (self.directory / "back_projection.ply").exists():  # only reconstructions have it
            self.attempt(self.draw_surface, self.directory / "surface.png")

    def draw_capture(self):
        # Imported here as h5py and SciPy take longer to load than most folders to be drawn.
        from isochron.pictures.capture_run import CaptureRun
        from isochron.pictures.capture_sheet import draw_sheet

        draw_sheet(CaptureRun(self.directory), self.directory / "capture.png")

    def draw_surface(self):
        from isochron.pictures.found_surface import FoundSurface
        from isochron.pictures.surface_sheet import draw_surface_sheet

        draw_surface_sheet(FoundSurface(self.directory), self.directory / "surface.png")

    def draw_residual(self):
        final, target = (self.stacks.get(self.directory / f"{name}.exr", {}).get("") for name in ("final", "target"))
        if final is None or target is None or final.shape != target.shape:
            return
        path = self.directory / "final.exr"
        gates = self.gates[path]
        difference = np.zeros(final.shape)
        read = slice(None) if gates.read is None else gates.read
        difference[read] = final[read] - target[read]
        rows = {"": difference}
        self.attempt(plot_signed, path, self.directory / "residual.png", self.title("final - target"), rows,
                     f"difference of {gates.quantity}", gates)

    def draw_slices(self, pixel, row):
        for path, stacks in self.stacks.items():
            arguments = (self.folder.experiment, stacks, self.gates[path])
            if pixel is not None:
                png = path.with_name(f"{path.stem}_pixel_{pixel[0]}_{pixel[1]}.png")
                self.attempt(plot_pixel, path, path, png, *arguments, pixel)
            if row is not None:
                self.attempt(plot_row, path, path, path.with_name(f"{path.stem}_row_{row}.png"), *arguments, row)


def pixel_of(text):
    match = re.fullmatch(r"(\d+),(\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"'{text}' is not COLUMN,ROW")
    return int(match[1]), int(match[2])


def main(arguments):
    if arguments in (["-h"], ["--help"]):
        print(__doc__.strip())
        return 0
    parser = Parser(prog="plot.py", usage="plot.py DIR [--pixel COLUMN,ROW] [--row ROW]", add_help=False)
    parser.add_argument("directory", type=pathlib.Path)
    parser.add_argument("--pixel", type=pixel_of)
    parser.add_argument("--row", type=int)
    options = parser.parse_args(arguments)
    pictures = Pictures(options.directory, choose=options.pixel is None and options.row is None)
    if not pictures.failures or pictures.stacks:
        if options.pixel is None and options.row is None:
            pictures.draw()
        else:
            pictures.draw_slices(options.pixel, options.row)
    failures = pictures.failures
    if failures:
        more = f" (and {len(failures) - 1} more)" if len(failures) > 1 else ""
        print(f"plot.py: {failures[0]}{more}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
