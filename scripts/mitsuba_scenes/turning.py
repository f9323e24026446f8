"""A scene of Mitsuba as the files of ours: their names and texts."""

import io
import re

import numpy as np

from . import materials, meshes, relay, sensors, shapes, spectra, walls
from .document import Document
from .lights import lights
from .writing import quoted


def turned(path, options, report):
    """Files by name: texts or bytes."""
    document = Document(path, options.define)
    try:
        return files_of(document, path, options, report)
    finally:
        for error in document.missing:
            report.refuse(error)


def files_of(document, path, options, report):
    for name in document.unused_definitions(options.define):
        report.note(path, f"-D {name}: no ${name} here")
    scene = document.root
    scene.objects("bsdf", "medium", "texture", "sampler", "film", "rfilter")  # what shapes and sensors refer to
    colours = spectra.Colours(report, options.mean_textures)
    found = shapes.Shapes(report, materials.Materials(report, colours, options.smooth), colours, options.fineness)
    found.add_all(scene)
    if not found.found and (options.skip or not report.refused):
        scene.fail("has no shape that could be turned")
    sensor = chosen_sensor(scene, found, options, report)
    film = sensors.film_of(sensor, report)
    title = f"from {path.name} of Mitsuba by scripts/import_scene.py"
    if is_capture(scene, sensor):
        view, most, comments, more = captured(scene, sensor, film, found, report, colours, options)
        shining = []
    else:
        view = ["camera:", *sensors.camera(sensor, film, report)]
        most = sensors.bounces(scene.only("integrator"), report, options.max_bounces)
        more, shining = {}, lights(scene, report, colours, found.lamps)
        if not shining and not any(shape.emission for shape in found.found):
            report.note(scene.place, f"{scene}: nothing lights it")
        comments = []
        if film.counted_by:
            comments.append(f"Times {film.bins[1]:.10g}, the bins' width, these are {film.counted_by}'s values.")
    report.refuse_rest(sensor)
    report.refuse_rest(sensor.only("film")) if sensor.only("film") else None
    report.refuse_rest(scene)
    return {**mesh_files(found.found, title), **more, "scene.yaml": scene_text(title, view, found, shining),
            "experiment.yaml": experiment_text(path, title, film, most, comments)}


def is_capture(scene, sensor):
    integrator = scene.only("integrator")
    around_corners = integrator is not None and integrator.type == "transient_nlos_path"
    if sensor.type == "nlos_capture_meter" and not around_corners:
        (integrator or sensor).fail("a capture's integrator is a transient_nlos_path")
    return around_corners


def captured(scene, sensor, film, found, report, colours, options):
    """The capture's lines, its bounces, comments and files. The wall is taken away unless it reflects in between."""
    if not film.bins:
        sensor.fail("the film of a capture is a transient_hdr_film")
    if sensor.type == "nlos_capture_meter":
        wall = walls.RectangleWall(*next(wall for wall in found.walls if wall[1] is sensor), film)
    else:
        wall = walls.SeenWall(found.found, sensor, film, sensors.slope(sensor, film, report), report)
    capture = relay.Capture(scene, sensor, wall, film, report, colours, options)
    if not capture.reflects:
        found.found.remove(wall.shape)
        if not found.found:
            sensor.fail("there is nothing but its wall")
    emitters = [node for _, node in scene.objects("emitter") if node.type != "projector"]
    for node in emitters + [shape.node for shape in found.found if shape.emission]:
        report.attempt(node.fail, "nothing but the laser lights a capture")
    for shape in found.found:
        shape.emission = ""
    factors = "the bins' width x albedo of the wall^2 x pi x irradiance x cos / r^2"
    comments = [f"Times {capture.scale} these are mitransient's values: {factors}."] if capture.scale else []
    if capture.mask is None:
        return ["capture:", *capture.lines], capture.max_bounces, comments, {}
    comments.append("Pixels that do not see the wall are to be masked: target: {..., mask: mask.npy}.")
    return ["capture:", *capture.lines], capture.max_bounces, comments, {"mask.npy": array_file(capture.mask)}


def chosen_sensor(scene, found, options, report):
    sensors_found = [node for _, node in scene.objects("sensor")] + [meter for _, meter, _ in found.walls]
    if not sensors_found:
        scene.fail("has no sensor that could be turned")
    if options.sensor is None:
        if len(sensors_found) > 1:
            first = sensors_found[0]
            report.note(first.place, f"{first}: the first of {len(sensors_found)} sensors (--sensor ID)")
        return sensors_found[0]
    for node in sensors_found:
        if node.id == options.sensor:
            return node
    return scene.fail(f"no sensor has the id '{options.sensor}'")


def mesh_files(found, title):
    return {file_name(shape): meshes.obj_text(shape.mesh, f"{shape.name}, {title}") for shape in found}


def file_name(shape):
    return re.sub(r"[^A-Za-z0-9_.-]", "_", shape.name) + ".obj"


def scene_text(title, view, found, shining):
    used = {shape.material for shape in found.found}
    lines = [f"# Made {title}.", *view, "materials:"]
    lines += [f"  {quoted(name)}: {text}" for name, text in found.materials.written.items() if name in used]
    lines.append("shapes:")
    for shape in found.found:
        emission = f", emission: {shape.emission}" if shape.emission else ""
        name, material = quoted(shape.name), quoted(shape.material)
        lines.append(f"  - {{name: {name}, file: {file_name(shape)}, material: {material}{emission}}}")
    if shining:
        lines += ["lights:", *(f"  - {light}" for light in shining)]
    return "\n".join(lines) + "\n"


def array_file(array):
    """As NumPy writes it."""
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def experiment_text(path, title, film, most, comments):
    name = re.sub(r"[^A-Za-z0-9_-]", "_", path.stem).lstrip("-") or "scene"
    gates = "{kind: steady}"
    if film.bins:
        start, width, count = film.bins
        pulse = f", response: {{offsets: [0, {film.pulse:.10g}], values: [1, 1]}}" if film.pulse else ""
        gates = f"{{kind: bins, start: {start:.10g}, width: {width:.10g}, count: {count}{pulse}}}"
    lines = [f"# Made {title}. Nothing is unknown yet: add `parameters`, see experiments/README.md."]
    lines += [f"# {comment}" for comment in comments]
    lines += [f"name: {name}", "scene: scene.yaml", f"max_bounces: {most}", f"gates: {gates}"]
    return "\n".join(lines) + "\n"
