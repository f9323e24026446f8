"""Lights without an extent. The projector is the laser of captures alone."""

import numpy as np

from . import matrices
from .writing import colour_text, quoted, vector_text

AROUND = ("constant", "envmap", "sky", "sun", "sunsky", "directional")


def lights(scene, report, colours, lamps):
    """Lines of our file. `lamps`: ids of emitters that shapes refer to."""
    lines = []
    for _, node in scene.objects("emitter"):
        if node.type == "area":
            if id(node) not in lamps:
                report.note(node.place, f"{node}: lights nothing, no shape refers to it")
            continue
        name = node.id or f"light_{len(lines) + 1}"
        text = report.attempt(light, node, report, colours)
        if text:
            lines.append(f"{{name: {quoted(name)}, {text}}}")
    return lines


def light(node, report, colours):
    if node.type in AROUND:
        node.fail("no light from all around here: its ways would have no length (--skip leaves it out)")
    if node.type not in ("point", "spot"):
        node.fail("no such emitter here (allowed: area, point, spot; in captures a projector)")
    matrix = node.transform()
    position = node.point("position") if node.type == "point" else None
    if position is None:
        position = matrix[:3, 3]
    text = f"type: {node.type}, position: {vector_text(position)}"
    if node.type == "spot":
        cutoff = node.number("cutoff_angle", 20.0)
        beam = node.number("beam_width", 0.75 * cutoff)
        if not 0 <= beam < cutoff <= 180:
            node.fail(f"beam_width {beam:g} and cutoff_angle {cutoff:g} make no cone")
        text += (f", direction: {vector_text(matrices.directions(matrix, (0, 0, 1)))}, cone: {cutoff:.9g}, "
                 f"blend: {1 - beam / cutoff:.9g}")
        report.note(node.place, f"{node}: fades by smoothstep, not linearly, from {beam:g} to {cutoff:g} degrees")
    intensity = colours.colour(node, "intensity", 1.0, emission=True)
    if intensity.min() < 0 or not intensity.max() > 0:
        node.fail(f"intensity {colour_text(intensity)} is not above 0", "intensity")
    node.ignore("sampling_weight")
    report.refuse_rest(node)
    return f"{text}, intensity: {colour_text(intensity)}"
