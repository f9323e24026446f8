"""Arrays of counts over a grid of points: those of the light-cone transform, of f-k migration, and any others."""

import numpy as np
from captures.measurement import LEAD_PS, CaptureError, Measurement, on_grid
from captures.reading import open_arrays


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
        self.grid = options.grid
        if self.grid and ("Y" in self.axes or shape[self.axes.index("X")] != np.prod(self.grid)):
            raise CaptureError(f"{arrays.path}: {self.name} does not have {self.grid[0]} x {self.grid[1]} points along one axis")
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
    if layout.grid:
        counts = layout.oriented(arrays.read(layout.name), layout.axes)[:, :, 0]
        counts = counts.reshape(len(counts), *layout.grid[::-1]).swapaxes(1, 2)[:, ::stride, ::stride]
    else:
        counts = layout.oriented(arrays.read(layout.name, slices), layout.axes)
    if counts.size == 0:
        raise CaptureError(f"{arrays.path}: {layout.name} is empty")
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
    sizes = dict(zip("XY", layout.grid) if layout.grid else zip(layout.axes, arrays.shape(layout.name)))
    points = np.zeros((*shape, 3))
    points[..., 0] = places(-width, width, sizes["X"], options.stride, "x" in layout.flip)[:, np.newaxis]
    points[..., 1] = places(width, -width, sizes.get("Y", 1), options.stride, "y" in layout.flip)
    return points


def read_grid_of_counts(arrays, options):
    """A Measurement of an array of counts, its points by the options or by what its layout is known to have."""
    layout = Layout(arrays, options)
    counts, lead = read_counts(arrays, layout, options.stride), 0
    if layout.tof:
        counts, lead = aligned(counts, layout, options.stride)
    points = wall(arrays, layout, options, counts.shape[1:])
    if options.points and layout.tof is None:
        counts, points = on_grid(counts, points)
    normal = np.asarray(options.normal) / np.linalg.norm(options.normal)
    laser = None if options.laser is None else np.reshape(options.laser, (1, 1, 3))
    return Measurement(layout.format, layout.name, counts, layout.bin_ps, options.t_start_ps, points, normal, laser=laser, lead=lead)
