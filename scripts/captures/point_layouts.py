"""Captures whose files say where the points are."""

import numpy as np
from captures.measurement import METRES_PER_PS, CaptureError, Measurement, on_grid
from isochron.captures import read_capture

SURFACE_BIN_M = 1.2e-3  # of nlos_surface_optimization's own programs, where the file has no bin_width


def read_surface_data(arrays, options):
    """nlos_surface_optimization: transient [points, bins], lighting [points, 3]."""
    name = next(n for n in ("transient", "gt_transient") if n in arrays)
    counts, points = arrays.read(name), np.asarray(arrays.read("lighting"), float)
    if points.ndim != 2 or points.shape[1] != 3 or counts.ndim != 2 or len(counts) != len(points):
        raise CaptureError(f"{arrays.path}: {name} and lighting are not [points, bins] and [points, 3]")
    normals = np.asarray(arrays.read("lighting_normal"), float) if "lighting_normal" in arrays else None
    bin_m = arrays.number("bin_width") if "bin_width" in arrays else SURFACE_BIN_M
    bin_ps = bin_m / METRES_PER_PS if options.bin_ps is None else options.bin_ps
    if normals is not None and (normals.shape != points.shape or np.ptp(normals, axis=0).max() > 0):
        raise CaptureError(f"{arrays.path}: lighting_normal is not one normal for all points")
    normal = np.asarray(options.normal if normals is None else normals[0], float)
    counts, points = on_grid(counts.T[:, :, np.newaxis], points[:, np.newaxis])
    said = [] if "bin_width" in arrays or options.bin_ps else [
        f"bins are taken to be {SURFACE_BIN_M * 1e3:g} mm long, as that project's programs have them (--bin-ps says otherwise)"]
    stride = options.stride
    return Measurement("nlos_surface_optimization", name, counts[:, ::stride, ::stride], bin_ps, options.t_start_ps,
                       points[::stride, ::stride], normal / np.linalg.norm(normal), said=said)


class ZaragozaArrays:
    """Arrays of the Zaragoza data set with axes as MATLAB has them, the coordinates of points last: files of other programs have
    all axes the other way round."""

    def __init__(self, arrays):
        self.arrays = arrays
        shape = arrays.shape("cameraGridPositions")
        self.reversed = len(shape) > 1 and shape[-1] != 3 and shape[0] == 3

    def read(self, name):
        array = np.asarray(self.arrays.read(name))
        return array.transpose() if self.reversed else array

    def points(self, name, shape):
        """[y, x, 3] of a grid; `shape` is that of the counts where the points are a list, in which x runs fastest."""
        points = np.asarray(self.read(name), float)
        if points.size == 3:
            return points.reshape(1, 1, 3)
        if points.ndim == 2 and shape is not None and len(points) == np.prod(shape):
            points = points.reshape(*shape, 3)
        if points.ndim != 3 or points.shape[2] != 3:
            raise CaptureError(f"{self.arrays.path}: {name} is not a grid of points")
        return points


def read_zaragoza_data(arrays, options):
    """The Zaragoza NLOS data set: data (y, x, bounce, time), with several spots (y, x of the laser, y, x of the sensor, bounce,
    time), colours as a further axis; bounces and colours are added up."""
    found = ZaragozaArrays(arrays)
    data = found.read("data")
    if data.ndim in (5, 7):
        data = data.sum(axis=-1)
    if data.ndim in (4, 6):
        data = data.sum(axis=-2)
    if data.ndim not in (3, 5):
        raise CaptureError(f"{arrays.path}: data has {data.ndim} axes, which are not those of the Zaragoza data set")
    points = found.points("cameraGridPositions", data.shape[-3:-1])
    laser = found.points("laserGridPositions", data.shape[:2]) if "laserGridPositions" in arrays else None
    if data.ndim == 5 and data.shape[2:4] != points.shape[:2] and data.shape[:2] == points.shape[:2]:
        data = data.transpose(2, 3, 0, 1, 4)  # the sensor's axes came first
    if data.shape[-3:-1] != points.shape[:2] or (data.ndim == 5 and data.shape[:2] != laser.shape[:2]):
        raise CaptureError(f"{arrays.path}: data of {' x '.join(map(str, data.shape))} does not fit the grids of points")
    confocal = data.ndim == 3 and (laser is None or (laser.shape == points.shape and np.allclose(laser, points, atol=1e-6)))
    if data.ndim == 3 and not confocal and laser.size != 3:
        raise CaptureError(f"{arrays.path}: laserGridPositions are neither one spot nor the points of the sensor")
    sensor_normals = found.points("cameraGridNormals", points.shape[:2])
    counts = np.moveaxis(data, -1, 0).swapaxes(-1, -2)
    if data.ndim == 5:
        counts = counts.swapaxes(1, 2)
    stride = options.stride
    origins = None
    if "laserPosition" in arrays and "cameraPosition" in arrays:
        origins = tuple(np.asarray(arrays.read(name), float).reshape(3) for name in ("laserPosition", "cameraPosition"))
    start_m = arrays.number("t0") if "t0" in arrays else 0.0
    sensor_normals = np.broadcast_to(sensor_normals, points.shape)
    measured = Measurement("Zaragoza", "data", counts[..., ::stride, ::stride], arrays.number("deltaT") / METRES_PER_PS,
                           start_m / METRES_PER_PS, points.swapaxes(0, 1)[::stride, ::stride],
                           sensor_normals.swapaxes(0, 1)[::stride, ::stride], origins=origins)
    if not confocal:
        normals = found.points("laserGridNormals", laser.shape[:2])
        measured.laser = laser.swapaxes(0, 1)
        measured.laser_normals = np.broadcast_to(normals, laser.shape).swapaxes(0, 1)
    return measured


def read_tal_data(arrays, options):
    """A file that the program reads as it is, to be thinned or masked."""
    capture = read_capture(arrays.path)
    stride = options.stride
    if capture.points.ndim != 3:
        raise CaptureError(f"{arrays.path}: points in no order cannot be imported; the program reads the file as it is")
    confocal = capture.laser is None or (capture.counts.ndim == 3 and np.shape(capture.laser) == np.shape(capture.points))
    return Measurement("tal", "H", capture.counts[..., ::stride, ::stride], capture.delta_t / METRES_PER_PS,
                       capture.t_start / METRES_PER_PS, capture.points[::stride, ::stride], capture.normals[::stride, ::stride],
                       None if confocal else capture.laser, None if confocal else capture.laser_normals, capture.origins)


def reader_of(arrays):
    """The function that reads these arrays; None where they are a grid of counts without points."""
    if "lighting" in arrays and ("transient" in arrays or "gt_transient" in arrays):
        return read_surface_data
    if "data" in arrays and "cameraGridPositions" in arrays:
        return read_zaragoza_data
    if "H" in arrays and "sensor_grid_xyz" in arrays:
        return read_tal_data
    return None
