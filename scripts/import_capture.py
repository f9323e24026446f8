#!/usr/bin/python3
"""Turns measurements of pulsed lasers and single-photon detectors into the HDF5 files that the program reads.

Knows, by the names of their arrays, in MATLAB 5 and 7.3 files (also sparse ones), in HDF5 and in NumPy's .npz:

  rect_data, width  the light-cone transform's data, [X, Y, T]: bins of 4 ps, `width` half the wall's side in metres,
                    time zero when light is at the wall
  meas, tofgrid     f-k migration's data, [Y, X, T]: bins of 32 ps, a wall of 2 m x 2 m; tofgrid [Y, X] (here or in
                    --tof FILE) is when, in ps, each point's direct light arrives, which becomes time zero

  transient, lighting
                    nlos_surface_optimization's, [points, bins] and [points, 3] (also gt_transient), with bin_width in metres
                    (else 1.2 mm) and lighting_normal, where it has them: points that form a grid become one
  data, cameraGridPositions, ...
                    the Zaragoza data set's, confocal, of one spot or of several: bounces and colours are added up; deltaT and t0
                    in metres, times with the ways from laserPosition and to cameraPosition
  H, sensor_grid_xyz, ...
                    tal's, which the program reads as it is: to be thinned, cut or masked

and any array of counts (--variable, --axes, --bin-ps, and --width or --points). Arrays without points are taken as confocal, unless there
is one --laser spot; their times leave out the ways from the laser to the wall and from the wall to the detector.

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
from captures import faulty_points, response
from captures.layouts import read_grid_of_counts
from captures.measurement import METRES_PER_PS, CaptureError
from captures.point_layouts import reader_of
from captures.reading import open_arrays
from isochron.captures import write_array, write_capture, write_response
from isochron.command_line import Parser

START_ALBEDO = 0.01  # small: what is hidden may be a small part of the plane that a fit begins with
MOST_NAMED = 8  # points, in a line


def rebinned(counts, first, last, width):
    """Bins [first, last) as 32-bit floats, `width` of them added up into one; what is left over at the end is cut."""
    bins = (last - first) // width
    result = np.zeros((bins, *counts.shape[1:]), np.float32)
    for part in range(width):
        result += counts[first + part : first + bins * width : width]
    return result


def named(points):
    """Columns and rows of the first of [Sx, Sy]."""
    places = [f"({x}, {y})" for x, y in np.argwhere(points)]
    return ", ".join(places[:MOST_NAMED]) + (", ..." if len(places) > MOST_NAMED else "")


def require_readable(path, measured, faults, options):
    """Without a mask, values that a fit cannot use are refused."""
    for points, what, ways in ((faults.not_finite, "values that are not finite", "--mask OUT.npy leaves these points out"),
                               (faults.negative, "negative counts", "--mask OUT.npy leaves these points out; --dark-subtracted keeps "
                                "them, for loss: {kind: squared}")):
        if points.any() and not options.mask:
            raise CaptureError(f"{path}: {measured.name} has {what} at {points.sum()} of {points.size} points, {named(points)} ({ways})")
    if (faults.dead | (faults.hot & bool(options.mask_hot))).all():
        why = "; --dark-subtracted keeps those with negative counts" if faults.negative.any() else ""
        raise CaptureError(f"{path}: the mask would leave no point{why}")


def masked(path, measured, options):
    """The mask [Sx, Sy] of the points to be used, and what there is to say of the others, whose counts become zero where they
    are none."""
    faults = faulty_points.find(measured.counts, options.dark_subtracted)
    require_readable(path, measured, faults, options)
    said = []
    for points, what in ((faults.not_finite, "not finite"), (faults.negative, "negative"), (faults.silent, "zero where others are not")):
        if points.any():
            said.append(f"dead: {points.sum()} points are {what}: {named(points)}"
                        + ("" if options.mask else " (--mask OUT.npy leaves them out)"))
    if faults.hot.any():
        way = "" if options.mask_hot else " (--mask OUT.npy --mask-hot leaves them out)"
        said.append(f"hot: {faults.hot.sum()} points count {faults.dark_counts[faults.hot].min():.4g} to "
                    f"{faults.dark_counts[faults.hot].max():.4g} in the darkest bins, half of all {faults.dark_median:.4g} or less: "
                    f"{named(faults.hot)}{way}")
    use = ~(faults.dead | (faults.hot if options.mask_hot else False)) if options.mask else np.ones(faults.hot.shape, bool)
    if not use.all():
        measured.counts = np.where(np.isfinite(measured.counts), measured.counts, 0)
        if not options.dark_subtracted:
            measured.counts = np.maximum(measured.counts, 0)
    if options.mask:
        write_array(options.mask, use.astype(np.uint8))
        said.append(f"target: {{capture: {options.output}, mask: {options.mask}}}   # {use.size - use.sum()} of {use.size} points masked")
    return use, said


def measured_response(path, measured, options, counts):
    if measured.laser is not None:
        raise CaptureError("--response needs a confocal capture: without --laser")
    start = measured.start_ps - measured.lead * measured.bin_ps
    found = response.measure(counts, measured.bin_ps, start, options.response_end)
    if found is None:
        raise CaptureError(f"{path}: {measured.name} has no direct light")
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
    own = None if options.variable else reader_of(arrays)
    measured = own(arrays, options) if own else read_grid_of_counts(arrays, options)
    use, said = masked(arrays.path, measured, options)
    lead = measured.lead
    first, last = options.bins or (0, len(measured.counts) - lead)
    if not -lead <= first < last <= len(measured.counts) - lead or last - first < options.rebin:
        raise CaptureError(f"{arrays.path}: no bins {first} to {last} by {options.rebin} "
                           f"in {-lead} to {len(measured.counts) - lead}")
    if options.response:
        said.insert(0, measured_response(arrays.path, measured, options, measured.counts[..., use][..., np.newaxis]))
    counts = rebinned(measured.counts, lead + first, lead + last, options.rebin)
    width, start = measured.bin_ps * options.rebin, measured.start_ps + first * measured.bin_ps
    write_capture(options.output, counts, width * METRES_PER_PS, start * METRES_PER_PS, measured.points, measured.normals,
                  measured.laser, measured.format, laser_normal=measured.laser_normals, origins=measured.origins)
    live = counts[..., use]
    mean = live.mean(dtype=float) * len(counts)
    spots = "" if measured.laser is None or measured.laser.size == 3 else f"{measured.laser.size // 3} spots, "
    about = (f"{options.output}: {measured.format}, {spots}{counts.shape[-2]} x {counts.shape[-1]} points, {len(counts)} bins of "
             f"{width:g} ps from {start:g} ps, {mean:.4g} counts a point")
    fit = options.bins and measured.laser is None and measured.origins is None
    return [about] + measured.said + said + (start_of_fit(live[..., np.newaxis], width * METRES_PER_PS) if fit else [])


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
    add("input", metavar="IN", type=pathlib.Path, help="the measurement: a .mat, .hdf5, .h5, .npy or .npz file")
    add("output", metavar="OUT.h5", type=pathlib.Path)
    add("--rebin", metavar="N", type=at_least_one, default=1, help="sum every N bins into one")
    add("--stride", metavar="N", type=at_least_one, default=1, help="keep every N-th point along each axis")
    add("--bins", metavar=("FIRST", "LAST"), type=int, nargs=2,
        help="only these bins, LAST excluded: bins of the file, or, if there is a tofgrid, counted from time zero. Without the "
        "wall's own light among them, what is said at the end is where the fit of a plane may begin")
    add("--bin-ps", metavar="PS", type=positive, help="width of a bin")
    add("--t-start-ps", metavar="PS", type=number, default=0.0,
        help="when the first bin begins; 0 is when light is at the wall (default: 0)")
    add("--tof", metavar="FILE", type=pathlib.Path, help="the file with tofgrid")
    add("--variable", metavar="NAME", help="the array of counts")
    add("--axes", choices=["XYT", "YXT", "TXY", "TYX", "XTY", "YTX", "XT", "TX"], help="of the array (default: XYT)")
    add("--grid", metavar=("NX", "NY"), type=at_least_one, nargs=2,
        help="the points of an array XT or TX as a grid, X running fastest")
    add("--flip", choices=["none", "x", "y", "xy"], help="axes to be reversed (default: x for meas)")
    add("--width", metavar="M", type=positive, help="half the wall's side, metres")
    add("--points", metavar="FILE", type=pathlib.Path, help="the points, metres: an array [X, Y, 3] or [N, 3]")
    add("--normal", metavar=("X", "Y", "Z"), type=number, nargs=3, default=(0.0, 0.0, 1.0),
        help="of the wall (default: 0 0 1)")
    add("--laser", metavar=("X", "Y", "Z"), type=number, nargs=3, help="the laser's one spot, metres; else confocal")
    add("--mask", metavar="OUT.npy", type=pathlib.Path,
        help="writes the mask of an experiment's target, which leaves out dead points, and prints the line for the experiment. Dead: "
             "values that are not finite or negative, or all zero where, by the counts of the others, less than one capture of 1000 had "
             "such a point. Hot points are named in any case: those that count so much in the darkest sixteenth of the time that this "
             "happens by chance in one capture of 1000, if expectations differ from point to point as the quartiles show")
    add("--mask-hot", action="store_true", help="leaves hot points out, too")
    add("--dark-subtracted", action="store_true", help="keeps negative values, for loss: {kind: squared}")
    add("--response", metavar="OUT.csv", type=pathlib.Path,
        help="writes the detector's response, measured on the capture's direct light: the average over all points, aligned to each "
             "other if the file has the pulse's rise, without the background, until it is below a thousandth of its peak or lost in noise. "
             "Offsets are in ps from time zero, when light is at the wall. If the file has the whole pulse, depths are unbiased even if its "
             "time zero is wrong; otherwise they are as right as that")
    add("--response-end", metavar="PS", type=number, help="the response's last offset, instead of where it is faint")
    options = parser.parse_args(arguments)
    if not np.linalg.norm(options.normal) > 0:
        parser.error("--normal has no direction")
    if options.mask_hot and not options.mask:
        parser.error("--mask-hot needs --mask")
    return options


def main(arguments):
    try:
        print("\n".join(import_capture(parse(arguments))))
        return 0
    except CaptureError as error:
        print(f"import_capture.py: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
