"""Arrays as pictures inside the page: PNG in data URIs, in the colours that the sheets of pictures have, too."""

import base64
import io

import matplotlib
import numpy as np
from PIL import Image

from isochron.pictures.scales import NON_FINITE_RGB, srgb
from isochron.report.markup import Markup, element, number

NON_FINITE_INDEX = 255  # of the palette; the others are the colour scale
SHADES = 255


def palette(name):
    colours = (matplotlib.colormaps[name](np.linspace(0, 1, SHADES))[:, :3] * 255).round().astype(np.uint8)
    return np.concatenate([colours, [NON_FINITE_RGB]]).astype(np.uint8)


class Scale:
    """Values to colours, from `low` to `high`."""

    def __init__(self, colours, low, high):
        self.colours, self.low, self.high = colours, low, max(high, np.nextafter(low, np.inf))
        self.palette = palette(colours)

    def uri(self, values):
        """`values` [height, width], row 0 at the top."""
        unit = (values - self.low) / (self.high - self.low)
        index = np.clip(np.nan_to_num(unit) * (SHADES - 1), 0, SHADES - 1).round().astype(np.uint8)
        index[~np.isfinite(values)] = NON_FINITE_INDEX
        image = Image.fromarray(index, "P")
        image.putpalette(self.palette.ravel().tolist())
        return data_uri(image)

    def bar(self, label):
        """The colours with the numbers at their ends."""
        steps = [f"rgb({r},{g},{b})" for r, g, b in self.palette[np.linspace(0, SHADES - 1, 17).astype(int)]]
        ends = [number(v, 3) for v in (self.low, self.high)]
        return element("p", ends[0], " ",
                       element("span", class_="bar", style=f"background:linear-gradient(to right,{','.join(steps)})",
                               role="img", aria_label=f"colours from {ends[0]} to {ends[1]}"),
                       " ", ends[1], " ", element("span", label, class_="quiet"), class_="scale")


class ColourScale:
    """Light of three channels in its own colours, white at `high`."""

    def __init__(self, high):
        self.high = high

    def uri(self, values):
        picture = srgb(np.nan_to_num(values / self.high, nan=0, posinf=1, neginf=0))
        picture = (picture * 255).round().astype(np.uint8)
        picture[~np.isfinite(values).all(-1)] = NON_FINITE_RGB
        return data_uri(Image.fromarray(picture, "RGB"))

    def bar(self, label):
        return element("p", f"white is {number(self.high, 3)} ", element("span", label, class_="quiet"), class_="scale")


def data_uri(image):
    data = io.BytesIO()
    image.save(data, "PNG", compress_level=6)
    return Markup("data:image/png;base64," + base64.b64encode(data.getvalue()).decode())


def figure_uri(figure, dpi=100):
    """A Matplotlib figure."""
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=dpi)
    data.seek(0)
    return data_uri(Image.open(data).convert("RGB"))


def shrunk(image, factor):
    """Means over blocks of pixels of one image, grey or of three colours."""
    if factor == 1:
        return image
    height, width = (n // factor for n in image.shape[:2])
    blocks = image[:height * factor, :width * factor].reshape(height, factor, width, factor, *image.shape[2:])
    return blocks.mean(axis=(1, 3))
