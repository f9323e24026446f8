"""Mitsuba's materials of a diffuse base under a gloss as our `plastic`."""

import numpy as np

from .writing import colour_text

MOST_REFLECTED = 0.5  # at normal incidence by a coat: of an index of 5.8

SHADES = ("anisotropic", "spec_tint", "sheen", "sheen_tint", "clearcoat", "clearcoat_gloss", "flatness", "diff_trans")  # of principled


def text(albedo, roughness, ior, reflectance, sides):
    return (f"{{type: plastic, albedo: {colour_text(albedo)}, roughness: {roughness:.9g}, ior: {ior:.9g}, "
            f"reflectance: {colour_text(reflectance)}{sides}}}")


def phong_roughness(exponent):
    """GGX's alpha whose density falls to a half at the same angle of the half vector as the lobe cos^exponent about the mirror
    direction, at normal incidence, where that angle is half of the lobe's."""
    angle = 0.5 * np.arccos(0.5 ** (1 / exponent)) if exponent > 0 else np.pi / 4
    return np.sqrt(np.sin(angle) ** 2 / (np.sqrt(2) - np.cos(angle) ** 2))


def index_of(reflected):
    """The index of refraction of a coat that reflects so much at normal incidence."""
    root = np.sqrt(min(reflected, MOST_REFLECTED))
    return (1 + root) / (1 - root)


def internal_reflectance(ior):
    """The share of a base's diffuse light that a smooth coat sends back to it."""
    cosine = (np.arange(4096) + 0.5) / 4096
    refracted = np.sqrt(ior**2 - 1 + cosine**2)
    across, along = (cosine - refracted) / (cosine + refracted), (ior**2 * cosine - refracted) / (ior**2 * cosine + refracted)
    from_outside = np.mean((across**2 + along**2) * cosine)
    return 1 - (1 - from_outside) / ior**2


def base_albedo(reflectance, ior):
    """Our base that looks like one of Mitsuba's without `nonlinear`: there reflections from inside are as many as white has, and
    reflectance / (1 - F) = albedo / (1 - albedo F)."""
    inside = internal_reflectance(ior)
    return reflectance / (1 - inside + reflectance * inside)


class Coated:
    """`materials`: what it shares with the other materials."""

    def __init__(self, materials):
        self.report, self.colours, self.materials = materials.report, materials.colours, materials

    def plastic(self, node, sides):
        albedo = self.colours.reflectance(node, "diffuse_reflectance", 0.5)
        gloss = self.colours.reflectance(node, "specular_reflectance", 1.0)
        node.ignore("specular_sampling_weight")
        inside, outside = self.materials.ior(node, "int_ior", "polypropylene"), self.materials.ior(node, "ext_ior", "air")
        if not inside > outside > 0:
            node.fail(f"int_ior {inside:g} and ext_ior {outside:g} make no coat", "int_ior")
        if not node.boolean("nonlinear"):
            albedo = base_albedo(albedo, inside / outside)
        return text(albedo, self.materials.roughness(node), inside / outside, gloss, sides)

    def phong(self, node, sides):
        albedo = self.colours.reflectance(node, "diffuse_reflectance", 0.5)
        gloss = self.colours.reflectance(node, "specular_reflectance", 0.2)
        exponent = self.colours.colour(node, "exponent", 30.0)[0]
        node.ignore("specular_sampling_weight")
        if not exponent >= 0:
            node.fail(f"exponent {exponent:g} is negative", "exponent")
        largest = gloss.max()
        if not largest > 0:
            return f"{{type: diffuse, albedo: {colour_text(albedo)}{sides}}}"
        roughness, ior = phong_roughness(exponent), index_of(largest)
        if albedo.max() <= max(largest - MOST_REFLECTED, 0):  # more of the lobe would be lost under a coat
            without = f", without its diffuse part of {albedo.max():.4g}" if albedo.max() > 0 else ""
            self.report.note(node.place, f"{node}: a rough_conductor of the same width of its lobe, roughness {roughness:.4g}{without}")
            return (f"{{type: rough_conductor, roughness: {roughness:.9g}, reflectance: {colour_text(gloss)}{sides}}}")
        self.report.note(node.place, f"{node}: plastic of the same width of its lobe, roughness {roughness:.4g}, whose coat "
                         f"reflects {min(largest, MOST_REFLECTED):.4g} at normal incidence, ior {ior:.4g}")
        return text(albedo, roughness, ior, gloss / largest, sides)

    def principled(self, node, sides):
        base = self.colours.reflectance(node, "base_color", 0.5)
        roughness = self.colours.colour(node, "roughness", 0.5)[0]
        metallic = self.colours.colour(node, "metallic", 0.0)[0]
        clear = self.colours.colour(node, "spec_trans", 0.0)[0]
        ior = node.number("eta") or 2 / (1 - np.sqrt(0.08 * min(node.number("specular", 0.5), 1))) - 1
        alpha = float(np.clip(roughness**2, self.materials.smooth, 1))
        left_out = [name for name in SHADES if name in node.values and np.any(self.colours.colour(node, name, 0.0))]
        node.ignore(*SHADES, "diffuse_reflectance_sampling_rate", "specular_sampling_rate", "clearcoat_sampling_rate")
        without = f", without {', '.join(left_out)}" if left_out else ""
        kind = "rough_conductor" if metallic > 0.5 else "rough_dielectric" if clear > 0.5 else "plastic"
        self.report.note(node.place, f"{node}: {kind} of the roughness {alpha:.4g}{without}")
        if kind == "rough_conductor":
            return f"{{type: rough_conductor, roughness: {alpha:.9g}, reflectance: {colour_text(base)}{sides}}}"
        if not ior > 1:
            node.fail(f"eta {ior:g} is not above 1", "eta")
        if kind == "rough_dielectric":
            return f"{{type: rough_dielectric, roughness: {alpha:.9g}, ior: {ior:.9g}}}"
        return text(base, alpha, ior, np.ones(3), sides)
