"""Words of our YAML files."""

import json
import re

import numpy as np


def vector_text(values):
    largest = np.abs(values).max()
    # What is left of zeros after sines and cosines is zero.
    return "[" + ", ".join(f"{0.0 if abs(x) < 1e-14 * largest else x:.10g}" for x in values) + "]"


def colour_text(rgb):
    """Linear RGB: one number where it is grey."""
    if np.ptp(rgb) == 0:
        return f"{rgb[0]:.9g}"
    return "[" + ", ".join(f"{value:.9g}" for value in rgb) + "]"


def quoted(text):
    """A word of YAML."""
    return text if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_.-]*", text) else json.dumps(text)
