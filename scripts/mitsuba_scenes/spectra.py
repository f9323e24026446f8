"""Colours: linear RGB of what Mitsuba calls spectra and textures."""

import numpy as np

from . import wavelengths
from .values import BlackBody, linear
from .writing import colour_text

# Equal energy at all wavelengths, as RGB with the white point D65: what Mitsuba's RGB variants make of a uniform emitter.
EQUAL_ENERGY = np.array([1.204794, 0.948292, 0.908916])


class Colours:
    def __init__(self, report, mean_textures):
        self.report, self.mean_textures = report, mean_textures

    def colour(self, node, name, default=None, emission=False):
        """Of a node's value or texture: three numbers."""
        node.used.add(name)
        for child_name, texture in node.objects("texture"):
            if child_name == name:
                return self.of_texture(texture)
        value = node.take(name, ("float", "integer", "rgb", "spectrum", "blackbody"), default)
        if value is None:
            node.fail(f"{name} is missing")
        if isinstance(value, BlackBody):
            return self.of_black_body(node, name, value)
        value = np.asarray(value, float)
        return self.of_spectrum(node, name, value, emission) if value.ndim == 2 else np.broadcast_to(value, 3)

    def reflectance(self, node, name, default):
        rgb = self.colour(node, name, default)
        if rgb.min() < 0 or rgb.max() > 1:
            node.fail(f"{name} {colour_text(rgb)} is not between 0 and 1", name)
        return rgb

    def of_spectrum(self, node, name, pairs, emission):
        """Pairs of a wavelength and a value."""
        if np.ptp(pairs[:, 1]) == 0:
            white = EQUAL_ENERGY if emission and not node.context.old else np.ones(3)
            return pairs[0, 1] * white
        rgb = (wavelengths.emitted if emission else wavelengths.reflected)(wavelengths.sampled(pairs))
        self.report.note(node.values[name].place, f"{node}: {name} over wavelengths is {colour_text(rgb.round(5))} as RGB")
        return rgb

    def of_black_body(self, node, name, body):
        if not body.temperature > 0:
            node.fail(f"a black body of {body.temperature:g} kelvins", name)
        rgb = body.scale * wavelengths.emitted(wavelengths.planck(body.temperature))
        self.report.note(node.values[name].place, f"{node}: {name} of a black body of {body.temperature:g} K is "
                         f"{colour_text(rgb)} as RGB, in W / (m^2 sr nm)")
        return rgb

    def of_texture(self, texture):
        kind = texture.type
        if kind == "uniform":
            rgb = np.full(3, texture.number("value", 1.0))
        elif kind in ("srgb", "rgb", "d65"):
            rgb = self.colour(texture, "color", 1.0) * texture.number("scale", 1.0)
        elif kind == "blackbody":
            rgb = wavelengths.emitted(wavelengths.planck(texture.number("temperature", 5000.0))) * texture.number("scale", 1.0)
        elif self.mean_textures and kind == "checkerboard":
            rgb = 0.5 * (self.colour(texture, "color0", 0.4) + self.colour(texture, "color1", 0.2))
        elif self.mean_textures and kind == "bitmap":
            rgb = mean_of_bitmap(texture)
        else:
            hint = " (--mean-textures takes its mean colour)" if kind in ("bitmap", "checkerboard") else ""
            texture.fail(f"no textures{hint}")
        if kind in ("bitmap", "checkerboard"):
            self.report.note(texture.place, f"{texture}: its mean colour, {colour_text(rgb)}")
            texture.ignore("to_uv", "filter_type", "wrap_mode")
        self.report.refuse_rest(texture)
        return rgb


def mean_of_bitmap(texture):
    from matplotlib import image  # slow to load

    file = texture.file()
    raw = texture.boolean("raw")
    try:
        pixels = image.imread(file)
    except (OSError, ValueError, SyntaxError) as error:
        texture.fail(f"{file} cannot be read: {error}", "filename")
    if pixels.dtype.kind == "u":
        pixels = pixels / np.iinfo(pixels.dtype).max
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    pixels = pixels[..., : 3 if pixels.shape[2] >= 3 else 1]
    if not raw:
        pixels = linear(pixels)
    return np.broadcast_to(pixels.mean(axis=(0, 1), dtype=float), 3)
