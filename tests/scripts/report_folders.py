"""Folders such as runs leave behind, for the tests of reports; and a reader of pages that finds what is wrong with them."""

import html.parser
import json
import pathlib
import shutil
import struct
import sys

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
sys.path[:0] = [str(SCRIPTS), str(SCRIPTS.parent / "app/python")]
import numpy as np
from isochron import exr
from isochron.captures import write_capture
from seeds import generator

METRES_PER_PS = 299792458e-12
SCENE = """camera: {position: [0, 1, 4], look_at: [0, 0.3, 0], up: [0, 1, 0], fov: 40, resolution: [8, 6]}
shapes:
  - {name: floor, file: floor.obj}
  - {name: box, file: box.obj}
lights:
  - {name: flash, type: point, position: [0, 2, 0], intensity: 1}
"""
EXPERIMENT = """version: "0.3.0"
name: NAME
scene: "inputs/scene/scene.yaml"
gates: {kind: gaussian, centers: [5, 6, 7], sigma: 0.1, unit: scene}
max_bounces: 2
target: {samples: 64, seed: 7}
parameters:
  - {name: height, type: translation, shape: box, direction: [0, 1, 0], initial: 0.3, target: 0}
  - {name: colour, type: albedo, material: white, initial: [0.5, 0.5, 0.5], target: [0.7, 0.3, 0.2]}
samples: {primal: 16, interior: 16, visibility: 8, path_length: 0}
loss: {kind: squared}
optimizer: {method: adam, learning_rate: 0.03, iterations: 20}
seed: 1
"""
SUMMARY = """status: STATUS
iterations: 20
seconds: 10
rejected_steps: 0
final: last
loss_initial: 0.5
loss_final: 0.01
param_rmse_initial: 0.3
param_rmse_final: 0.01
last_call: {first_iteration: 0, seconds: 12.5, rays: 1000000, peak_memory_bytes: 25000000,
            passes: {target: 1.5, scene: 0.5, primal: 2, interior: 4, edges: 0.25, visibility: 3, path_length: 0}}
parameters:
  height: 0.01
  colour: [0.69, 0.31, 1e-05]
"""
COLUMNS = ["height", "colour[0]", "colour[1]", "colour[2]"]
TRIANGLES = [(0, 1, 2), (0, 2, 3)]


def write_ply(path, points, triangles, **values):
    """values: of the vertices, by the property's name."""
    properties = "".join(f"property double {name}\n" for name in ("x", "y", "z", *values))
    head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{properties}"
            f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    points = np.column_stack([points, *values.values()])
    faces = b"".join(struct.pack("<B3i", 3, *t) for t in triangles)
    path.write_bytes(head.encode() + np.asarray(points, "<f8").tobytes() + faces)


def images(value, gates=3, channels="Y", height=6, width=8, component=""):
    rise = np.linspace(0, 1, height * width).reshape(height, width)
    return {f"{component}gate{g:03d}.{c}": value * (g + 1) * rise for g in range(gates) for c in channels}


def write_log(folder, rows):
    lines = ["iteration,seconds,loss,image_rmse,param_rmse,gradient_norm," + ",".join(COLUMNS)
             + ",height.rmse,colour.rmse," + ",".join(f"{c}.gradient" for c in COLUMNS) + ",loss_noise"]
    for i in range(rows):
        fall = 0.8**i
        values = [i, 0.5 * (i + 1), -0.01 if i == 7 else fall, fall, 0.3 * fall, fall, 0.3 * fall, 0.7, 0.3, 0.2, 0.3 * fall,
                  0.1, 1, 1, 1, 1, 0.05]
        lines.append(",".join(map(str, values)))
    (folder / "log.csv").write_text("\n".join(lines) + "\n")


def write_run(folder, status="iterations_reached", name="box", channels="Y", frames=(0, 4, 8, 12, 16)):
    """A run of a camera. No status: it has not ended."""
    (folder / "inputs/scene").mkdir(parents=True)
    (folder / "frames").mkdir()
    (folder / "geometry").mkdir()
    (folder / "experiment.yaml").write_text(EXPERIMENT.replace("NAME", json.dumps(name)))
    (folder / "inputs/experiment.yaml").write_text("# as it was written\n" + EXPERIMENT.replace("NAME", json.dumps(name)))
    (folder / "inputs/scene/scene.yaml").write_text(SCENE)
    (folder / "inputs/scene/floor.obj").write_text("v -2 0 -2\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nf 1 2 3 4\n")
    exr.write(folder / "target.exr", images(1.0, channels=channels))
    exr.write(folder / "initial.exr", images(0.5, channels=channels))
    for i in frames:
        exr.write(folder / f"frames/{i:06d}.exr", images(1 - 0.5 * 0.8**i, channels=channels))
    square = np.array([[0, 0.5, 0], [1, 0.5, 0], [1, 0.5, 1], [0, 0.5, 1]])
    write_ply(folder / "geometry/initial_box.ply", square + [0, 0.3, 0], TRIANGLES)
    write_ply(folder / "geometry/target_box.ply", square, TRIANGLES)
    write_log(folder, 21 if status else 9)
    if status:
        (folder / "summary.yaml").write_text(SUMMARY.replace("STATUS", status))
        exr.write(folder / "final.exr", images(0.99, channels=channels))
        write_ply(folder / "geometry/final_box.ply", square + [0, 0.01, 0], TRIANGLES)
    else:
        write_ply(folder / "geometry/current_box.ply", square + [0, 0.1, 0], TRIANGLES)
    values = ("height", [0.05]), ("colour", [0.6, 0.4, 0.3])
    entries = "".join(f"  - name: {name}\n    value: {value}\n" for name, value in values)
    (folder / "checkpoint.yaml").write_text("iteration: 8\nparameters:\n" + entries)
    return folder


def write_capture_run(folder, bins=40, columns=6, rows=5, shape="board"):
    (folder / "inputs/scene").mkdir(parents=True)
    (folder / "frames").mkdir()
    (folder / "geometry").mkdir()
    (folder / "inputs/scene/s.yaml").write_text(
        "capture:\n  sensor: {corner: [-0.3, 0.3, 0], across: [0.6, 0, 0], down: [0, -0.6, 0], size: [6, 5]}\n"
        "  normal: [0, 0, 1]\n")
    (folder / "experiment.yaml").write_text(
        "name: small\nscene: inputs/scene/s.yaml\ngates: {kind: bins, unit: ps, scene_unit_m: 1}\nloss: {kind: poisson}\n"
        "optimizer: {method: quasi_newton, iterations: 2}\ntarget: {samples: 64}\nparameters:\n"
        f"  - {{name: z, type: translation, shape: {shape}, direction: [0, 0, 1], initial: 0, target: 0.02}}\n"
        f"  - {{name: paint, type: albedo, per: vertex, shape: {shape}, initial: 0.5}}\n")
    (folder / "summary.yaml").write_text(
        "status: iterations_reached\niterations: 2\nstandard_errors_from: gauss_newton_products\nstandard_errors:\n"
        "  z: 0.0005\n  paint: [0.1, 0.1, 0.2, .inf]\nundetermined: [paint]\nsteps_left:\n  z: 0.25\ncombinations:\n"
        "  gain * paint:\n    mean: 12.5\n    mean_standard_error: 0.75\nparameters:\n  z: 0.019\n  paint: [0.2, 0.4, 0.6, 0.8]\n")
    points = np.zeros((columns, rows, 3))
    points[..., 0] = np.linspace(-0.3, 0.3, columns)[:, np.newaxis]
    points[..., 1] = np.linspace(0.3, -0.3, rows)
    way = 2 * np.linalg.norm(points - [0.1, -0.1, 0.5], axis=-1)
    lengths = (2900 + 40 * (np.arange(bins) + 0.5)) * METRES_PER_PS
    fit = 2 + 30 * np.exp(-0.5 * ((lengths[:, np.newaxis, np.newaxis] - way) / 0.02) ** 2)
    write_capture(folder / "final.h5", fit, 40 * METRES_PER_PS, 2900 * METRES_PER_PS, points, (0, 0, 1), None, "isochron")
    counts = generator(5).poisson(fit)
    notes = {"isochron.gateCenters": " ".join(f"{2920 + 40 * g}" for g in range(bins)), "isochron.gateUnit": "ps",
             "isochron.quantity": "radiance per scene unit of path length"}
    for name, light in (("target", counts), ("initial", fit * 0.5), ("final", fit), ("frames/000000", fit * 0.5),
                        ("frames/000001", fit * 0.9)):
        exr.write(folder / f"{name}.exr", {f"gate{g:03d}.Y": layer.T for g, layer in enumerate(light)}, notes)
    square = np.array([[-0.2, 0.2, 0.5], [0.2, 0.2, 0.5], [0.2, -0.2, 0.5], [-0.2, -0.2, 0.5]])
    for moment, z in (("initial", 0), ("final", 0.019), ("target", 0.02)):
        write_ply(folder / f"geometry/{moment}_{shape}.ply", square + [0, 0, z], TRIANGLES)
    (folder / "log.csv").write_text("iteration,seconds,loss,z,paint[0],loss_noise\n"
                                    "0,1,2,0,0.5,0.1\n1,2,1,0.01,0.4,0.1\n2,3,0.6,0.019,0.2,0.1\n")
    return folder


def write_reconstruction(folder):
    """A run in one level, whose fit is a square, and what is seen of it by back-projection: two triangles that do not touch."""
    level = write_capture_run(folder / "levels/1", shape="surface")
    shutil.copytree(level, folder, dirs_exist_ok=True)
    with open(folder / "summary.yaml", "a") as summary:
        summary.write("fit: {deviance: 1234.5, degrees_of_freedom: 1000, floor: 1200, p_value: 0.3, verdict: explained}\n"
                      "start: {method: back_projection, seconds: 2.5, significance: 41.75}\n"
                      "levels:\n  - {edge_length: 0.01, vertices: 4, iterations: 2, loss: 0.5, seconds: 3.5, status: converged}\n")
    square = np.array([[-0.2, 0.2, 0.5], [0.2, 0.2, 0.5], [0.2, -0.2, 0.6], [-0.2, -0.2, 0.6]])
    write_ply(folder / "geometry/final_surface.ply", square, [t[::-1] for t in TRIANGLES], albedo=[0.2, 0.4, 0.6, 0.8],
              standard_error=[0.001, 0.002, 0.003, np.nan])
    parts = np.array([[-0.2, 0.2, 0.51], [-0.05, 0.2, 0.51], [-0.2, 0, 0.51], [0.05, -0.2, 0.62], [0.2, 0, 0.62], [0.2, -0.2, 0.62]])
    write_ply(folder / "back_projection.ply", parts, [(0, 1, 2), (3, 4, 5)], albedo=[1, 2, 3, 4, 5, 6])
    return folder


class Page(html.parser.HTMLParser):
    """What a page holds; `faults` are what a reader without sight, mouse or network would stumble over."""

    VOID = {"img", "input", "meta", "link", "br"}

    def __init__(self, text):
        super().__init__()
        self.faults, self.open, self.elements, self.texts, self.headings = [], [], [], [], []
        if not text.startswith("<!DOCTYPE html>\n<html lang="):
            self.faults.append("no document type or language")
        self.feed(text)
        self.close()
        self.faults += [f"<{tag}> is not closed" for tag in self.open]
        self._check()

    def handle_starttag(self, tag, attributes):
        if len({key for key, _ in attributes}) < len(attributes):
            self.faults.append(f"<{tag}> has an attribute twice")
        self.elements.append((tag, dict(attributes), "label" in self.open))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.elements.append((tag, dict(attributes), "label" in self.open))

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"</{tag}> closes nothing")

    def handle_data(self, data):
        self.texts.append((self.open[-1] if self.open else "", data))
        if self.open and self.open[-1] in ("h1", "h2", "h3"):
            self.headings.append((int(self.open[-1][1]), data))

    def all(self, tag, **attributes):
        return [a for t, a, _ in self.elements if t == tag and all(a.get(k) == v for k, v in attributes.items())]

    @property
    def words(self):
        return " ".join(data for tag, data in self.texts if tag not in ("script", "style"))

    def _check(self):
        names = [a["id"] for _, a, _ in self.elements if "id" in a]
        self.faults += [f"id {name} stands twice" for name in set(names) if names.count(name) > 1]
        for tag, attributes, in_label in self.elements:
            for key in ("aria-labelledby", "aria-describedby"):
                self.faults += [f"{key}: no {name}" for name in attributes.get(key, "").split() if name not in names]
            for key in ("src", "href", "srcset", "data", "action", "poster", "xlink:href"):
                value = attributes.get(key)
                if value is None or value.startswith("data:"):
                    continue
                if key != "href" or not value.startswith("#") or value[1:] not in names:
                    self.faults.append(f"<{tag} {key}={value[:60]}> leads out of the page")
            if tag == "img" and not attributes.get("alt", "").strip():
                self.faults.append("a picture without words")
            if tag == "input" and not in_label and not attributes.get("aria-label"):
                self.faults.append("an input without a label")
            if tag == "input" and attributes.get("type") == "range" and not attributes.get("aria-valuetext"):
                self.faults.append("a slider that says no value")
            if any(key.startswith("on") for key in attributes):
                self.faults.append(f"<{tag}> runs a script")
        levels = [level for level, _ in self.headings]
        if levels[:1] != [1] or levels.count(1) != 1:
            self.faults.append("not one first heading")
        self.faults += [f"a heading of level {b} after one of {a}" for a, b in zip(levels, levels[1:]) if b > a + 1]
        for tag in ("main", "nav", "header"):
            if len(self.all(tag)) != 1:
                self.faults.append(f"not one <{tag}>")
        code = "".join(data for tag, data in self.texts if tag in ("script", "style"))
        for word in ("url(", "@import", "fetch(", "XMLHttpRequest", "import("):
            self.faults += [f"{word} in the code"] if word in code else []
