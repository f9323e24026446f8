"""Perspective cameras, films and integrators: the image, its gates and how often light reflects."""

from dataclasses import dataclass

import numpy as np

from .writing import vector_text

LIGHT = ("path", "direct", "volpath", "prb", "bdpt", "ptracer", "transient")  # how their names begin
WITHOUT_EFFECT = ("rr_depth", "block_size", "samples_per_pass", "temporal_filter", "gaussian_stddev", "emitter_samples",
                  "bsdf_samples", "shading_samples", "timeout")
METRES_PER_NS = 0.299792458
FILMS = ("hdrfilm", "ldrfilm", "tiledhdrfilm", "mfilm", "transient_hdr_film")


@dataclass
class Film:
    width: int
    height: int
    bins: tuple | None = None  # start, width, count
    pulse: float = 0  # length of a flash of constant power, as path length
    counted_by: str = ""  # the renderer whose values are ours times the bins' width


def film_of(sensor, report):
    node = sensor.only("film")
    sensor.objects("sampler")
    if node is None:
        return Film(768, 576)
    node.ignore("pixel_format", "component_format", "file_format", "compensate", "banner", "high_quality_edges", "gamma",
                "tonemap_method", "exposure", "attach_log", "channel_names")
    if node.type not in FILMS:
        node.fail("no such film here (allowed: " + ", ".join(FILMS) + ")")
    for _, filter_node in node.objects("rfilter"):
        if filter_node.type != "box":
            report.note(filter_node.place, f"{filter_node}: pixels are boxes here")
    film = Film(node.integer("width", 768), node.integer("height", 576))
    if node.boolean("sample_border"):
        node.fail("sample_border", "sample_border")
    if node.type == "transient_hdr_film":
        film.bins = node.number("start_opl", 0.0), node.number("bin_width_opl", 0.003), node.integer("temporal_bins", 2048)
        film.counted_by = "mitransient"
    else:
        take_bins_of_peers(node, film)
    if film.bins and not (film.bins[1] > 0 and film.bins[2] > 0):
        node.fail("has no bins")
    if min(film.width, film.height) < 1:
        node.fail("has no pixels")
    return film


def take_bins_of_peers(node, film):
    """Bins in the films of MitsubaToF (path lengths) and of dtransient (nanoseconds, a scene unit being a metre)."""
    if node.text("decomposition", "none").lower().startswith("transient"):
        film.bins = bins_between(*(node.number(name, 0.0) for name in ("min_bound", "max_bound", "bin_width")))
        return
    node.ignore("min_bound", "max_bound", "bin_width")
    if node.boolean("transient"):
        film.bins = bins_between(*(node.number(name, 0.0) for name in ("path_min", "path_max", "path_sample")))
    elif "tresolution" in node.values:
        start, width = (METRES_PER_NS * node.number(name, 0.0) for name in ("tstart", "tresolution"))
        film.bins = start, width, node.integer("duration", 1)
        film.pulse = METRES_PER_NS * max(node.number("tresolution_light", 0.0), 0)
        film.counted_by = "dtransient"


def bins_between(start, end, width):
    return start, width, round((end - start) / width) if width > 0 else 0


def crop_of(sensor, film, report):
    """How much of the width is kept. Films are cut around their middle or not at all."""
    node = sensor.only("film")
    if node is None:
        return 1.0
    width, height = node.integer("crop_width", film.width), node.integer("crop_height", film.height)
    left, top = node.integer("crop_offset_x", 0), node.integer("crop_offset_y", 0)
    if 2 * left + width != film.width or 2 * top + height != film.height or min(width, height) < 1:
        report.attempt(node.fail, "its crop is not around its middle", "crop_width")
        return 1.0
    share = width / film.width
    film.width, film.height = width, height
    return share


def slope(sensor, film, report):
    """Half the image's width at the distance 1. Fails where the camera is none of ours."""
    if sensor.type == "thinlens":
        sensor.ignore("aperture_radius")
        report.attempt(sensor.fail, "cameras are pinholes here (--skip makes it one)")
    elif sensor.type != "perspective":
        sensor.fail("no such sensor here (allowed: perspective, or an nlos_capture_meter on a rectangle)")
    axes = sensor.transform()[:3, :3]
    sensor.ignore("near_clip", "far_clip", "focus_distance", "shutter_open", "shutter_close")
    axes = axes / np.linalg.norm(axes, axis=0)[2]  # a scale in all directions leaves the rays as they are
    if not np.allclose(axes.T @ axes, np.eye(3), atol=1e-5):
        sensor.fail("its to_world scales", "to_world")
    if np.linalg.det(axes) < 0:
        report.attempt(sensor.fail, "its to_world mirrors the image", "to_world")
    if sensor.number("principal_point_offset_x", 0) or sensor.number("principal_point_offset_y", 0):
        report.attempt(sensor.fail, "its principal point is not in the middle")
    result = np.tan(np.radians(field_of_view(sensor, film)) / 2) * crop_of(sensor, film, report)
    report.refuse_rest(sensor)
    return result


def camera(sensor, film, report):
    """Our camera's lines."""
    if film.counted_by == "mitransient":
        near = sensor.number("near_clip", 0.01)
        report.note(sensor.place, f"{sensor}: paths begin at the pinhole here; mitransient itself counts from the near "
                    f"plane, {near:g} less in the middle of the image")
    fov = 2 * np.degrees(np.arctan(slope(sensor, film, report)))
    to_world = sensor.transform()
    position, axes = to_world[:3, 3], to_world[:3, :3] / np.linalg.norm(to_world[:3, 2])
    return [f"  position: {vector_text(position)}", f"  look_at: {vector_text(position + axes[:, 2])}",
            f"  up: {vector_text(axes[:, 1])}", f"  fov: {fov:.10g}", f"  resolution: [{film.width}, {film.height}]"]


def field_of_view(sensor, film):
    """Degrees across the width of the whole film."""
    aspect = film.width / film.height
    if "fov" in sensor.values:
        fov, axis = sensor.number("fov"), sensor.text("fov_axis", "x").lower()
        axis = {"smaller": "y" if aspect > 1 else "x", "larger": "x" if aspect > 1 else "y"}.get(axis, axis)
        if axis not in ("x", "y", "diagonal"):
            sensor.fail(f"no axis {axis}", "fov_axis")
    else:
        text = sensor.text("focal_length", "50mm")
        try:  # of the diagonal of 35 mm film
            focal_length = float(text.removesuffix("mm"))
            fov, axis = 2 * np.degrees(np.arctan(np.hypot(36, 24) / 2 / focal_length)), "diagonal"
        except (ValueError, ZeroDivisionError):
            sensor.fail(f"'{text}' is no focal length", "focal_length")
    sensor.ignore("fov_axis")
    if not 0 < fov < 180:
        sensor.fail(f"fov {fov:g} is not between 0 and 180 degrees", "fov")
    half = np.tan(np.radians(fov) / 2)
    half *= {"x": 1, "y": aspect, "diagonal": aspect / np.hypot(1, aspect)}[axis]
    return 2 * np.degrees(np.arctan(half))


def bounces(integrator, report, most):
    """Scattering vertices on a path, at most: all that an integrator says here."""
    if integrator is None:
        return most
    if integrator.boolean("hide_emitters"):
        report.attempt(integrator.fail, "the camera sees the emitters here", "hide_emitters")
    if integrator.boolean("camera_unwarp"):
        report.attempt(integrator.fail, "no camera_unwarp: paths begin at the pinhole here", "camera_unwarp")
    if integrator.boolean("discard_direct_light"):
        report.attempt(integrator.fail, "light that comes straight from a lamp counts here", "discard_direct_light")
    if not integrator.type.startswith(LIGHT):
        report.note(integrator.place, f"{integrator}: its depth alone is taken; images are of light here")
    own = "max_depth" in integrator.values
    depth = integrator.integer("max_depth", 6 if integrator.type.startswith(("transient", "prb")) else -1)
    inside = [node for _, node in integrator.objects("integrator")]
    if integrator.type.startswith("direct"):
        return 1
    if inside and not own:
        return max(bounces(node, report, most) for node in inside)
    return limited(integrator, report, depth - 1 if depth >= 0 else None, most)


def limited(integrator, report, count, most):
    if count is None:
        report.note(integrator.place, f"{integrator}: any number of bounces; here {most} at most (--max-bounces)")
        return most
    if count < 0:
        integrator.fail("sees no light", "max_depth")
    return count
