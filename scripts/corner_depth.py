#!/usr/bin/python3
"""Depths of the corner: what the phases alone say, and what was fitted through all reflections, beside the truth.

usage: corner_depth.py RUN [PNG]           errors of both over the pixels that see nothing but the corner; draws them
       corner_depth.py --table CSV RUN...  a line of errors for each run
       corner_depth.py --start RENDER FILE the depths of the phases as offsets of the vertices, to start from

RUN is a folder of `isochron run experiments/corner.yaml`, RENDER one of `isochron render experiments/corner.yaml --at target`.
A depth is the distance from the camera, which lights the scene itself. The phases alone take all light for light
that was reflected once: d = c / (4 pi f) atan2(I90 - I270, I0 - I180).
"""

import pathlib
import sys

import numpy as np
import yaml
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

from mitsuba_scenes.walls import distances
from reproduction.tables import write_rows
import use_package
from isochron import exr
from isochron.mesh_files import read_mesh

ROOT = pathlib.Path(__file__).resolve().parents[1]
SPEED_OF_LIGHT = 299792458
RAYS = 5  # across a pixel; its depth is the mean of theirs, as its value is of all that it sees
DIMMEST = 0.02  # of the brightest pixel: what is darker has no phase


class Camera:
    def __init__(self, description, resolution):
        self.size = resolution
        self.position, self.up = (np.array(description[k], dtype=float) for k in ("position", "up"))
        forward = np.array(description["look_at"]) - self.position
        self.forward = forward / np.linalg.norm(forward)
        right = np.cross(self.forward, self.up)
        self.right = right / np.linalg.norm(right)
        self.up = np.cross(self.right, self.forward)
        self.pixel = 2 * np.tan(np.radians(description["fov"]) / 2) / self.size[0]

    def rays(self, across=1):
        """Unit directions through a grid within each pixel: rows x columns x across^2 x 3."""
        width, height = self.size
        offsets = (np.arange(across) + 0.5) / across
        x = (np.arange(width)[:, None] + offsets - width / 2) * self.pixel
        y = (height / 2 - np.arange(height)[:, None] - offsets) * self.pixel
        d = (self.forward + x[None, :, None, :, None] * self.right + y[:, None, :, None, None] * self.up)
        return (d / np.linalg.norm(d, axis=-1, keepdims=True)).reshape(height, width, across * across, 3)

    def pixels(self, points):
        """Columns and rows where points are seen; the middle of the first pixel is at 0.5."""
        d = points - self.position
        depth = d @ self.forward * self.pixel
        return np.stack([self.size[0] / 2 + d @ self.right / depth, self.size[1] / 2 - d @ self.up / depth], 1)


def cast(origin, rays, mesh):
    """Distance along each ray to the mesh; infinite where it is missed."""
    vertices, triangles = mesh
    flat = rays.reshape(-1, 3)
    nearest = np.full(len(flat), np.inf)
    for a, b, c in vertices[triangles]:
        nearest = np.minimum(nearest, distances(origin - a, flat, b - a, c - a))
    return nearest.reshape(rays.shape[:-1])


def read_folder(folder):
    """The experiment, its camera and the images by phase of a run or of a render."""
    run = (folder / "target.exr").exists()
    file = folder / "experiment.yaml" if run else ROOT / "experiments/corner.yaml"
    experiment = yaml.safe_load(file.read_text(encoding="utf-8"))
    images = exr.read(folder / ("target.exr" if run else "render.exr"))
    phases = experiment["gates"]["phases"]
    by_phase = {phase: images[f"gate{i:03d}.Y"] for i, phase in enumerate(phases)}
    scene = yaml.safe_load((file.parent / experiment["scene"]).read_text(encoding="utf-8"))
    height, width = by_phase[0].shape
    return experiment, Camera(scene["camera"], (width, height)), by_phase


def phase_depth(experiment, images):
    """Depth of the phases alone, NaN where there is no light, and the amplitude."""
    real, imaginary = images[0] - images[180], images[90] - images[270]
    amplitude = 0.5 * np.hypot(real, imaginary)
    wavelength = SPEED_OF_LIGHT / (1e6 * experiment["gates"]["frequency_mhz"] * experiment["gates"]["scene_unit_m"])
    depth = np.mod(np.arctan2(imaginary, real), 2 * np.pi) * wavelength / (4 * np.pi)
    return np.where(amplitude > DIMMEST * amplitude.max(), depth, np.nan), amplitude


def write_start(folder, path):
    """Moves each vertex along its direction to where the phases see a surface."""
    experiment, camera, images = read_folder(folder)
    depth, _ = phase_depth(experiment, images)
    rows, columns = np.nonzero(np.isfinite(depth))
    seen = np.stack([columns, rows], 1) + 0.5
    between, outside = LinearNDInterpolator(seen, depth[rows, columns]), NearestNDInterpolator(seen, depth[rows, columns])
    parameter = experiment["parameters"][0]
    vertices, _ = read_mesh(ROOT / "scenes/corner/walls.obj")
    direction = np.array(parameter["direction"], dtype=float)
    offsets = np.zeros(len(vertices))
    for _ in range(20):  # a vertex that moves is seen elsewhere
        points = vertices + offsets[:, None] * direction
        pixels = camera.pixels(points)
        wanted = between(pixels)
        wanted = np.where(np.isnan(wanted), outside(pixels), wanted)
        away = points - camera.position
        distance = np.linalg.norm(away, axis=1)
        offsets += (wanted - distance) / (away @ direction / distance)
    path.write_text("".join(f"{x:.5f}\n" for x in offsets), encoding="ascii")
    print(f"{len(offsets)} offsets, {offsets.min():.3f} to {offsets.max():.3f} m, rms {rms(offsets):.3f} m")


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def evaluate(folder):
    """Everything that is printed and drawn; depths in metres, NaN where a pixel sees more than the corner."""
    experiment, camera, images = read_folder(folder)
    phases, amplitude = phase_depth(experiment, images)
    rays, shape = camera.rays(RAYS), experiment["parameters"][0]["shape"]
    depths = {}
    for state in ("target", "initial", "final"):
        t = cast(camera.position, rays, read_mesh(folder / f"geometry/{state}_{shape}.obj"))
        hits = np.isfinite(t)
        depths[state] = np.where(hits, t, 0).sum(-1) / np.maximum(hits.sum(-1), 1)
        if state == "target":
            whole = hits.all(-1)
        depths[state][~hits.any(-1)] = np.nan
    depths["phases"] = phases
    return {name: np.where(whole, depth, np.nan) for name, depth in depths.items()}, amplitude, whole


def errors_of(depths, whole, name):
    """Errors of all pixels that see nothing but the corner, and how many of these have no depth."""
    error = (depths[name] - depths["target"])[whole]
    return error[np.isfinite(error)], int((~np.isfinite(error)).sum())


def read_summary(folder):
    return yaml.safe_load((folder / "summary.yaml").read_text(encoding="utf-8"))


def report(folder, depths, whole):
    print(f"{whole.sum()} pixels see nothing but the corner, {np.nanmin(depths['target']):.2f} to "
          f"{np.nanmax(depths['target']):.2f} m away")
    size = {}
    for name, words in (("phases", "phases alone"), ("initial", "start"), ("final", "fit")):
        error, missed = errors_of(depths, whole, name)
        size[name] = rms(error)
        print(f"{words:13s} rms {1000 * rms(error):7.2f} mm, mean {1000 * error.mean():+7.2f} mm, largest "
              f"{1000 * np.abs(error).max():7.2f} mm" + (f", {missed} pixels without a depth" if missed else ""))
    summary = read_summary(folder)
    print(f"the fit's rms error is 1/{size['phases'] / size['final']:.1f} of that of the phases alone; "
          f"{summary['iterations']} iterations, {summary['seconds']:.0f} s")


def write_table(path, folders):
    rows = []
    for folder in folders:
        depths, _, whole = evaluate(folder)
        summary, (error, missed) = read_summary(folder), errors_of(depths, whole, "final")
        sizes = [rms(errors_of(depths, whole, name)[0]) for name in ("phases", "initial", "final")]
        sizes += [np.median(np.abs(error)), np.abs(error).max()]
        seed = yaml.safe_load((folder / "experiment.yaml").read_text(encoding="utf-8"))["seed"]
        rows.append([seed, summary["iterations"], f"{summary['seconds']:.0f}", whole.sum(), *(f"{1000 * x:.2f}" for x in sizes), missed])
    write_rows(path, ["seed", "iterations", "seconds", "pixels", "phases_rms_mm", "start_rms_mm", "fit_rms_mm", "fit_median_mm",
                      "fit_largest_mm", "fit_missed"], rows)


def draw(path, depths, amplitude, whole):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 4, figsize=(16, 3.9), constrained_layout=True)
    axes[0].imshow(amplitude, cmap="gray")
    axes[0].set_title("amplitude")
    row = whole.shape[0] // 2
    axes[0].axhline(row, color="C1", linewidth=0.8)
    for name, words, style in (("target", "truth", "k-"), ("phases", "phases alone", "C3-"), ("final", "fit", "C0--")):
        axes[1].plot(depths[name][row], style, label=words)
    axes[1].set_title("depth along the line")
    axes[1].set_xlabel("column")
    axes[1].set_ylabel("m")
    axes[1].legend()
    # One scale would show nothing of the fit's errors; each map has its own.
    for axis, name, words in ((axes[2], "phases", "phases alone"), (axes[3], "final", "fit")):
        error = 1000 * (depths[name] - depths["target"])
        largest = np.nanpercentile(np.abs(error), 99)
        picture = axis.imshow(error, cmap="RdBu_r", vmin=-largest, vmax=largest)
        figure.colorbar(picture, ax=axis, label="mm", shrink=0.85)
        axis.set_title(f"error, {words}: rms {rms(error[np.isfinite(error)]):.3g} mm")
    for axis in (axes[0], axes[2], axes[3]):
        axis.set_xticks([])
        axis.set_yticks([])
    figure.savefig(path, dpi=80)


def main(arguments):
    if len(arguments) == 3 and arguments[0] == "--start":
        write_start(pathlib.Path(arguments[1]), pathlib.Path(arguments[2]))
        return 0
    if len(arguments) >= 3 and arguments[0] == "--table":
        write_table(arguments[1], [pathlib.Path(a) for a in arguments[2:]])
        return 0
    if len(arguments) not in (1, 2) or arguments[0].startswith("-"):
        print(__doc__.strip())
        return 0 if arguments in (["-h"], ["--help"]) else 2
    folder = pathlib.Path(arguments[0])
    depths, amplitude, whole = evaluate(folder)
    report(folder, depths, whole)
    draw(arguments[1] if len(arguments) == 2 else folder / "corner.png", depths, amplitude, whole)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
