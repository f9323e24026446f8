"""The values of Mitsuba's XML: numbers, points, colours and transforms, each from one element."""

import re
from dataclasses import dataclass

import numpy as np

from . import matrices


KINDS = ("float", "integer", "boolean", "string", "rgb", "srgb", "spectrum", "blackbody", "point", "vector")


class SceneError(Exception):
    """What cannot be turned, and where it stands."""

    def __init__(self, place, message):
        super().__init__(f"{place}: {message}")


@dataclass
class Value:
    kind: str  # float, integer, boolean, string, rgb, spectrum, blackbody, point, vector, transform
    value: object  # a SceneError: to be raised by who needs the value
    place: str


@dataclass
class BlackBody:
    temperature: float  # kelvins
    scale: float


def numbers(text, place, counts):
    """Numbers between commas or blanks, as many as one of `counts` says."""
    words = text.replace(",", " ").split()
    try:
        values = [float(word) for word in words]
    except ValueError:
        raise SceneError(place, f"'{text}' is not made of numbers") from None
    if len(values) not in counts or not np.isfinite(values).all():
        raise SceneError(place, f"'{text}' is not {' or '.join(map(str, counts))} finite numbers")
    return values


def required(attributes, name, tag, place):
    if name not in attributes:
        raise SceneError(place, f"<{tag}> without {name}")
    return attributes[name]


def value_of(tag, attributes, place):
    """Of an element that is no object and no transform: its kind and its value."""

    def needed(name):
        return required(attributes, name, tag, place)

    if tag not in KINDS:
        raise SceneError(place, f"<{tag}> is not understood")
    if tag in ("point", "vector"):
        if "value" in attributes:
            return tag, np.array(numbers(attributes["value"], place, (3,)))
        return tag, np.array([numbers(needed(axis), place, (1,))[0] for axis in "xyz"])
    if tag == "blackbody":
        temperature = needed("temperature").strip().lower().removesuffix("k")
        scale = numbers(attributes.get("scale", "1"), place, (1,))[0]
        return tag, BlackBody(numbers(temperature, place, (1,))[0], scale)
    if tag == "spectrum" and "filename" in attributes:
        raise SceneError(place, "files of spectra are not read (an <rgb> of the same colour is)")
    text = needed("value").strip()
    if tag == "spectrum":
        return spectrum(text, place)
    if tag in ("rgb", "srgb"):
        return "rgb", colour(tag, text, place)
    if tag == "string":
        return tag, text
    if tag == "float":
        return tag, numbers(text, place, (1,))[0]
    if tag == "integer" and re.fullmatch(r"[+-]?\d+", text):
        return tag, int(text)
    if tag == "boolean" and text.lower() in ("true", "false"):
        return tag, text.lower() == "true"
    raise SceneError(place, f"'{text}' is no {tag}")


def spectrum(text, place):
    """Three numbers are RGB, as before version 2; one number or wavelength:value pairs make an array [N, 2], sorted, in
    which one number has the wavelength 0."""
    if ":" not in text:
        values = numbers(text, place, (1, 3))
        return ("rgb", np.array(values)) if len(values) == 3 else ("spectrum", np.array([[0, values[0]]]))
    pairs = [entry.split(":") for entry in re.sub(r"\s*:\s*", ":", text).replace(",", " ").split()]
    if any(len(pair) != 2 for pair in pairs):
        raise SceneError(place, f"'{text[:40]}' is not made of pairs wavelength:value")
    flat = numbers(" ".join(word for pair in pairs for word in pair), place, (2 * len(pairs),))
    samples = np.array(flat).reshape(-1, 2)
    if len(samples) > 1 and not (np.diff(samples[:, 0]) > 0).all():
        raise SceneError(place, "the wavelengths of a spectrum do not rise")
    return "spectrum", samples


def colour(tag, text, place):
    """Linear RGB."""
    if re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        rgb = np.array([int(text[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    else:
        rgb = np.array(np.broadcast_to(numbers(text, place, (1, 3)), 3))
    return linear(rgb) if tag == "srgb" else rgb


def linear(rgb):
    """Of sRGB."""
    return np.where(rgb <= 0.04045, rgb / 12.92, (np.maximum(rgb + 0.055, 0) / 1.055) ** 2.4)


def step(tag, attributes, place):
    """One step of a transform, a matrix."""

    def vector(otherwise):
        if "value" in attributes:
            return np.broadcast_to(numbers(attributes["value"], place, (1, 3)), 3)
        return np.array([numbers(attributes.get(axis, otherwise), place, (1,))[0] for axis in "xyz"])

    def listed(name, counts, otherwise=""):
        return np.array(numbers(attributes.get(name, otherwise), place, counts))

    try:
        if tag == "translate":
            return matrices.translation(vector("0"))
        if tag == "scale":
            return matrices.scaling(vector("1"))
        if tag == "rotate":
            return matrices.rotation(vector("0"), listed("angle", (1,))[0])
        if tag in ("lookat", "lookAt"):
            return matrices.look_at(listed("origin", (3,)), listed("target", (3,)), listed("up", (3,), "0 0 0"))
        if tag == "matrix":
            return matrices.from_numbers(listed("value", (9, 16)))
    except ValueError as error:
        raise SceneError(place, f"<{tag}> {error}") from None
    raise SceneError(place, f"<{tag}> is no step of a transform")
