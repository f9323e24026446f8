#!/usr/bin/python3
"""Turns measurements of pulsed lasers and single-photon detectors into the HDF5 files that the program reads.

Knows, by the names of their arrays, in MATLAB 5 and 7.3 files and in NumPy's .npz:

  rect_data, width  the light-cone transform's data, [X, Y, T]: bins of 4 ps, `width` half the wall's side in metres,
                    time zero when light is at the wall
  meas, tofgrid     f-k migration's data, [Y, X, T]: bins of 32 ps, a wall of 2 m x 2 m; tofgrid [Y, X] (here or in
                    --tof FILE) is when, in ps, each point's direct light arrives, which becomes time zero

and any array of counts (--variable, --axes, --bin-ps, and --width or --points). All are taken as confocal, unless there
is one --laser spot. Times leave out the ways from the laser to the wall and from the wall to the detector.

Axes: H is [time, column, row]. The wall is at z = 0, its normal +z points to the hidden scene; columns run along +x
from -width, rows along -y from +width, the outermost points at the corners. So who looks at the wall from the hidden
scene sees columns run to the right; seen from the wall, +x is to the left. rect_data has X as it is here: with it, the
hidden letter S is an S seen from the wall. meas is taken to show the scene as seen from the wall: its X is reversed.
--flip x (or y, xy, none) says what to reverse instead.
"""

import argparse
import pathlib
import sys

import numpy as np
import use_package
from captures import response
from captures.reading import CaptureError, open_arrays
from isochron.captures import write_capture, write_response

METRES_PER_PS = 299792458e-12
START_ALBEDO = 0.01  # small: what is hidden may be a small part of the plane that a fit begins with
LEAD_PS = 500  # kept before time zero where bins are aligned: the pulse's rise belongs to the response


class Layout:
    """How a file's counts are to be understood, options applied."""

    def __init__(self, arrays, options):
        self.tof = None
        self.half_width, bin_ps, axes, flip = options.width, None, "XYT", ""
        if options.variable:
            self.name, self.format = options.variable, "array"
        elif "rect_data" in arrays:
            self.name, self.format, bin_ps = "rect_data", "light-cone transform", 4
            if self.half_width is None and options.points is None and "width" in arrays:
                self.half_width = arrays.number("width")
        elif "meas" in arrays:
            self.name, self.format, bin_ps, axes, flip = "meas", "f-k migration", 32, "YXT", "x"
            self.half_width = 1.0 if self.half_width is None else self.half_width
        else:
            self.name, self.format = arrays.only_counts(), "array"
        if self.name not in arrays:
            raise CaptureError(f"{arrays.path}: there is no array {self.name}")
        if len(arrays.shape(self.name)) == 2:
            axes = "XT"
        self.axes = options.axes or axes
        self.flip = flip if options.flip is None else options.flip.replace("none", "")
        self.bin_ps = bin_ps if options.bin_ps is None else options.bin_ps
        shape = arrays.shape(self.name)
        if len(self.axes) != len(shape):
            sizes = " x ".join(map(str, shape))
            raise CaptureError(f"{arrays.path}: {self.name} is {sizes}, not one size for each axis of {self.axes}")
        if self.bin_ps is None:
            raise CaptureError(f"{arrays.path}: how long is a bin of {self.name}? (--bin-ps)")
        if options.tof:
            self.tof = open_arrays(options.tof), "tofgrid"
            if "tofgrid" not in self.tof[0]:
                self.tof = self.tof[0], self.tof[0].only_counts()
        elif self.name == "meas" and "tofgrid" in arrays:
            self.tof = arrays, "tofgrid"

    def oriented(self, array, axes):
        """With axes [T, X, Y], or [X, Y] where there is no time; X and Y reversed where they are to be."""
        if "Y" not in axes:
            array, axes = array[..., np.newaxis], axes + "Y"
        array = array.transpose([axes.index(a) for a in "TXY" if a in axes])
        for axis, letter in ((-2, "x"), (-1, "y")):
            if letter in self.flip:
                array = np.flip(array, axis)
        return array


def read_counts(arrays, layout, stride):
    slices = tuple(slice(None, None, 1 if axis == "T" else stride) for axis in layout.axes)
    counts = layout.oriented(arrays.read(layout.name, slices), layout.axes)
    if counts.size == 0:
        raise CaptureError(f"{arrays.path}: {layout.name} is empty")
    if not np.isfinite(counts).all():
        raise CaptureError(f"{arrays.path}: {layout.name} has values that are not finite")
    if counts.min() < 0:
        raise CaptureError(f"{arrays.path}: {layout.name} has negative counts")
    return counts


def aligned(counts, layout, stride):
    """The counts with each point's first bins left out, so that its direct light arrives at the same bin as that of all
    others; and the number of that bin."""
    arrays, name = layout.tof
    axes = layout.axes.replace("T", "")
    if len(arrays.shape(name)) != len(axes):
        raise CaptureError(f"{arrays.path}: {name} does not have the axes {axes}")
    times = layout.oriented(arrays.read(name, (slice(None, None, stride),) * len(axes)), axes)
    if times.shape != counts.shape[1:]:
        raise CaptureError(f"{arrays.path}: {name} is of {times.shape[0]} x {times.shape[1]} points, "
                           f"the counts of {counts.shape[1]} x {counts.shape[2]}")
    # Rounded to the nearest, shifts are wrong by half a bin at most and by nothing on average.
    shifts = np.rint(times / layout.bin_ps) if np.isfinite(times).all() else np.full(times.shape, -1)
    if shifts.min() < 0 or shifts.max() >= len(counts):
        length = len(counts) * layout.bin_ps
        raise CaptureError(f"{arrays.path}: {name} has times outside the {length:g} ps of the bins")
    lead = min(int(shifts.min()), int(LEAD_PS / layout.bin_ps))
    shifts = shifts.astype(int) - lead
    bins = len(counts) - shifts.max()
    result = np.empty((bins, *times.shape), counts.dtype)
    for x, y in np.ndindex(times.shape):
        result[:, x, y] = counts[shifts[x, y] : shifts[x, y] + bins, x, y]
    return result, lead


def read_points(path, layout, stride):
    arrays = open_arrays(path)
    name = arrays.only_counts()
    points = np.asarray(arrays.read(name), float)
    points = points[:, np.newaxis] if points.ndim == 2 else points
    if points.shape[2] != 3 or not np.isfinite(points).all():
        raise CaptureError(f"{path}: {name} is not [X, Y, 3] or [N, 3] points")
    points = points[::stride, ::stride]
    return np.flip(points, ["xy".index(axis) for axis in layout.flip])


def places(first, last, count, stride, is_reversed):
    """Coordinates along an axis of the wall, thinned from where the array begins."""
    places = np.linspace(first, last, count) if count > 1 else np.zeros(1)
    return places[::-1][::stride][::-1] if is_reversed else places[::stride]


def wall(arrays, layout, options, shape):
    """The points of the wall, [X, Y, 3]."""
    if options.points:
        points = read_points(options.points, layout, options.stride)
        if points.shape[:2] != shape:
            raise CaptureError(f"{options.points}: {points.shape[0]} x {points.shape[1]} points, "
                               f"the counts are of {shape[0]} x {shape[1]}")
        return points
    width = layout.half_width
    if width is None:
        raise CaptureError(f"{arrays.path}: where are the points of {layout.name}? (--width or --points)")
    if not width > 0:
        raise CaptureError(f"{arrays.path}: the width {width:g} is not positive")
    sizes = dict(zip(layout.axes, arrays.shape(layout.name)))
    points = np.zeros((*shape, 3))
    points[..., 0] = places(-width, width, sizes["X"], options.stride, "x" in layout.flip)[:, np.newaxis]
    points[..., 1] = places(width, -width, sizes.get("Y", 1), options.stride, "y" in layout.flip)
    return points


def rebinned(counts, first, last, width):
    """Bins [first, last) as 32-bit floats, `width` of them added up into one; what is left over at the end is cut."""
    bins = (last - first) // width
    result = np.zeros((bins, *counts.shape[1:]), np.float32)
    for part in range(width):
        result += counts[first + part : first + bins * width : width]
    return result


def measured_response(arrays, layout, options, counts, start_ps):
    if options.laser:
        raise CaptureError("--response needs a confocal capture: without --laser")
    found = response.measure(counts, layout.bin_ps, start_ps, options.response_end)
    if found is None:
        raise CaptureError(f"{arrays.path}: {layout.name} has no direct light")
    offsets, values = found
    write_response(options.response, offsets, values)
    mean = np.average(offsets[1:-1], weights=values[1:-1])
    return f"{options.response}: {offsets[0]:g} to {offsets[-1]:g} ps, {mean:.1f} ps on average"


def start_of_fit(counts, bin_m):
    """What a fit of a plane may begin with. In a plane at depth z the light of a confocal point, over all lengths, is
    albedo / (3 pi^2 z^2); counts are gain times its density over length."""
    level = response.background(counts)
    light = counts.mean(axis=(1, 2), dtype=float).sum() - level * len(counts)
    if light <= 0:
        return []
    gain = light * bin_m * 3 * np.pi**2 / START_ALBEDO
    return [f"to begin a fit with: albedo {START_ALBEDO:g}, gain {gain:.2g} z^2 (z: depth, metres), background {level:.2g}"]


def import_capture(options):
    """Returns what there is to say about the files written."""
    arrays = open_arrays(options.input)
    layout = Layout(arrays, options)
    counts, lead = read_counts(arrays, layout, options.stride), 0
    if layout.tof:
        counts, lead = aligned(counts, layout, options.stride)
    points = wall(arrays, layout, options, counts.shape[1:])
    first, last = options.bins or (0, len(counts) - lead)
    if not -lead <= first < last <= len(counts) - lead or last - first < options.rebin:
        raise CaptureError(f"{arrays.path}: no bins {first} to {last} by {options.rebin} "
                           f"in {-lead} to {len(counts) - lead}")
    said = []
    if options.response:
        start = options.t_start_ps - lead * layout.bin_ps
        said.append(measured_response(arrays, layout, options, counts, start))
    counts = rebinned(counts, lead + first, lead + last, options.rebin)
    width, start = layout.bin_ps * options.rebin, options.t_start_ps + first * layout.bin_ps
    write_capture(options.output, counts, width * METRES_PER_PS, start * METRES_PER_PS, points,
                  np.asarray(options.normal) / np.linalg.norm(options.normal), options.laser, layout.format)
    mean = counts.mean(dtype=float) * len(counts)
    return [f"{options.output}: {layout.format}, {counts.shape[1]} x {counts.shape[2]} points, {len(counts)} bins of "
            f"{width:g} ps from {start:g} ps, {mean:.4g} counts a point"] + said + (
                start_of_fit(counts, width * METRES_PER_PS) if options.bins and not options.laser else [])


class Parser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(2, f"{self.prog}: {message}\n")


def at_least_one(text):
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value} is less than 1")
    return value


def number(text):
    value = float(text)
    if not np.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not finite")
    return value


def positive(text):
    value = number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"{text} is not positive")
    return value


def parse(arguments):
    parser = Parser(prog="import_capture.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("input", metavar="IN", type=pathlib.Path, help="a .mat, .npy or .npz file")
    add("output", metavar="OUT.h5", type=pathlib.Path)
    add("--rebin", metavar="N", type=at_least_one, default=1, help="add N bins up into one")
    add("--stride", metavar="N", type=at_least_one, default=1, help="every N-th point along either axis")
    add("--bins", metavar=("FIRST", "LAST"), type=int, nargs=2,
        help="these bins alone, LAST excluded: bins of the file, where there is a tofgrid counted from time zero. Without the "
        "wall's own light among them, what is said at the end is where the fit of a plane may begin")
    add("--bin-ps", metavar="PS", type=positive, help="length of a bin")
    add("--t-start-ps", metavar="PS", type=number, default=0.0,
        help="when the first bin begins, 0 being when light is at the wall (default: 0)")
    add("--tof", metavar="FILE", type=pathlib.Path, help="the file with tofgrid")
    add("--variable", metavar="NAME", help="the array of counts")
    add("--axes", choices=["XYT", "YXT", "TXY", "TYX", "XTY", "YTX", "XT", "TX"], help="of the array (default: XYT)")
    add("--flip", choices=["none", "x", "y", "xy"], help="axes to be reversed (default: x for meas)")
    add("--width", metavar="M", type=positive, help="half the wall's side, metres")
    add("--points", metavar="FILE", type=pathlib.Path, help="the points, metres: an array [X, Y, 3] or [N, 3]")
    add("--normal", metavar=("X", "Y", "Z"), type=number, nargs=3, default=(0.0, 0.0, 1.0),
        help="of the wall (default: 0 0 1)")
    add("--laser", metavar=("X", "Y", "Z"), type=number, nargs=3, help="the laser's one spot, metres; else confocal")
    add("--response", metavar="OUT.csv", type=pathlib.Path,
        help="writes the capture's direct light, which is the instrument's response: the average over all points, "
        "aligned to each other where the file has the pulse's rise, without the background, until it is below a "
        "thousandth of its peak or lost in noise. Offsets are in ps from time zero, when light is at the wall; so "
        "where the file has the whole pulse, depths are unbiased even if its time zero is wrong, and else as far as it "
        "is right")
    add("--response-end", metavar="PS", type=number, help="the response's last offset, instead of where it is faint")
    options = parser.parse_args(arguments)
    if not np.linalg.norm(options.normal) > 0:
        parser.error("--normal has no direction")
    return options


def main():
    try:
        print("\n".join(import_capture(parse(sys.argv[1:]))))
        return 0
    except CaptureError as error:
        print(f"import_capture.py: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
