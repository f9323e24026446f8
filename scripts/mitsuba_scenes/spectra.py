"""Colours: linear RGB of what Mitsuba calls spectra and textures."""

import numpy as np

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
        value = node.take(name, ("float", "integer", "rgb", "spectrum"), default)
        if value is None:
            node.fail(f"{name} is missing")
        if isinstance(value, str):
            return self.of_spectrum(node, name, value, emission)
        return np.broadcast_to(np.asarray(value, float), 3)

    def reflectance(self, node, name, default):
        rgb = self.colour(node, name, default)
        if rgb.min() < 0 or rgb.max() > 1:
            node.fail(f"{name} {colour_text(rgb)} is not between 0 and 1", name)
        return rgb

    def of_spectrum(self, node, name, text, emission):
        entries = text.replace(",", " ").split()
        try:
            values = {float(entry.split(":")[-1]) for entry in entries}
        except ValueError:
            values = set()
        if len(values) != 1:
            node.fail(f"{name} is a spectrum over wavelengths (an <rgb> of the same colour can be read)", name)
        return values.pop() * (EQUAL_ENERGY if emission else np.ones(3))

    def of_texture(self, texture):
        kind = texture.type
        if kind == "uniform":
            rgb = np.full(3, texture.number("value", 1.0))
        elif kind in ("srgb", "rgb", "d65"):
            rgb = self.colour(texture, "color", 1.0) * texture.number("scale", 1.0)
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
        pixels = np.where(pixels <= 0.04045, pixels / 12.92, ((pixels + 0.055) / 1.055) ** 2.4)
    return np.broadcast_to(pixels.mean(axis=(0, 1), dtype=float), 3)
