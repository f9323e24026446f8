"""Spectra over wavelengths as linear RGB.

The matching functions are the sums of Gaussians of Wyman, Sloan and Shirley, "Simple Analytic Approximations to the CIE XYZ Color
Matching Functions" (2013). Each is scaled so that its integral is one: equal energy is X = Y = Z = 1.
"""

import numpy as np

NANOMETRES = np.arange(360.0, 831.0)
# Of each Gaussian: its height, its middle, its widths before and behind it.
LOBES = (((1.056, 599.8, 37.9, 31.0), (0.362, 442.0, 16.0, 26.7), (-0.065, 501.1, 20.4, 26.2)),
         ((0.821, 568.8, 46.9, 40.5), (0.286, 530.9, 16.3, 31.1)),
         ((1.217, 437.0, 11.8, 36.0), (0.681, 459.0, 26.0, 13.8)))
TO_RGB = np.array([[3.240479, -1.537150, -0.498535], [-0.969256, 1.875991, 0.041556], [0.055648, -0.204043, 1.057311]])
DAYLIGHT = 6504.0  # kelvins of D65


def matching():
    """[3, wavelengths]"""

    def lobe(height, middle, before, behind):
        return height * np.exp(-0.5 * ((NANOMETRES - middle) / np.where(NANOMETRES < middle, before, behind)) ** 2)

    rows = np.array([sum(lobe(*numbers) for numbers in lobes) for lobes in LOBES])
    return rows / rows.sum(axis=1, keepdims=True)


def planck(temperature):
    """Radiance in W / (m^2 sr nm), at NANOMETRES."""
    metres, c, h, k = NANOMETRES * 1e-9, 299792458.0, 6.62607015e-34, 1.380649e-23
    return 2e-9 * h * c**2 / metres**5 / np.expm1(h * c / (metres * k * temperature))


def emitted(radiance):
    """RGB of radiance at NANOMETRES; what is outside of the colours that RGB has is cut off."""
    return np.maximum(TO_RGB @ (matching() @ radiance), 0)


def reflected(reflectance):
    """RGB of a reflectance at NANOMETRES, in daylight; of a grey one that grey."""
    light = planck(DAYLIGHT)
    xyz = matching() * light
    return np.clip(TO_RGB @ (np.linalg.solve(TO_RGB, np.ones(3)) * (xyz @ reflectance) / xyz.sum(axis=1)), 0, 1)


def sampled(pairs):
    """Of pairs wavelength, value: linear in between, zero beyond."""
    return np.interp(NANOMETRES, pairs[:, 0], pairs[:, 1], left=0, right=0)
