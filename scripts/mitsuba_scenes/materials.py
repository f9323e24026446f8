"""Mitsuba's bsdfs as our materials."""

import numpy as np

from . import coated
from .writing import colour_text

# At 589 nm, between 0 and 20 degrees Celsius.
IOR = {"vacuum": 1, "air": 1.000277, "water": 1.333, "acetone": 1.36, "ethanol": 1.361, "glycerol": 1.4729,
       "water ice": 1.31, "fused quartz": 1.458, "pyrex": 1.47, "acrylic glass": 1.49, "polypropylene": 1.49,
       "bk7": 1.5046, "sodium chloride": 1.544, "amber": 1.55, "pet": 1.575, "diamond": 2.419}
# Reflectance at normal incidence, linear RGB.
METALS = {"Ag": (0.972, 0.960, 0.915), "Al": (0.913, 0.922, 0.924), "Au": (1.0, 0.766, 0.336),
          "Cr": (0.550, 0.556, 0.554), "Cu": (0.955, 0.638, 0.538)}
COVERS = ("bumpmap", "normalmap", "mask", "coating", "roughcoating")
DEFAULT = "{type: diffuse, albedo: 0.5}"  # Mitsuba's, too


class Materials:
    """The scene's materials: names and what stands behind them in our file."""

    def __init__(self, report, colours, smooth):
        self.report, self.colours, self.smooth = report, colours, smooth
        self.written, self.names = {}, {}

    def name_of(self, node, shape_name):
        """The material of a shape with this bsdf, or none: Mitsuba's default."""
        key = id(node) if node else None
        if key not in self.names:
            text = self.report.attempt(self.text_of, node, otherwise=DEFAULT) if node else DEFAULT
            wanted = (node.id if node else "default") or f"{shape_name}_material"
            name, count = wanted, 1
            while name in self.written:
                count += 1
                name = f"{wanted}_{count}"
            self.names[key], self.written[name] = name, text
        return self.names[key]

    def text_of(self, node, two_sided=False):
        gloss = coated.Coated(self)
        kinds = {"diffuse": self.diffuse, "roughdiffuse": self.diffuse, "conductor": self.conductor,
                 "roughconductor": self.conductor, "dielectric": self.dielectric, "roughdielectric": self.dielectric,
                 "plastic": gloss.plastic, "roughplastic": gloss.plastic, "pplastic": gloss.plastic, "phong": gloss.phong,
                 "principled": gloss.principled, "twosided": self.twosided}
        if node.type in COVERS:
            return self.covered(node, two_sided)
        if node.type not in kinds:
            node.fail("no such material here (allowed: " + ", ".join(kinds) + ")")
        text = kinds[node.type](node, ", two_sided: true" if two_sided else "")
        self.report.refuse_rest(node)
        return text

    def twosided(self, node, _):
        inside = [inner for _, inner in node.objects("bsdf")]
        if len(inside) != 1:
            node.fail("has another material on its back" if inside else "has no bsdf inside")
        if inside[0].type in ("dielectric", "roughdielectric"):
            node.fail(f"has a {inside[0]} inside")
        return self.text_of(inside[0], two_sided=True)

    def covered(self, node, two_sided):
        """Something about another material: that alone, with --skip."""
        inside = node.only("bsdf")
        if inside is None:
            node.fail("has no bsdf inside")
        self.report.attempt(node.fail, f"no such material here (--skip takes the {inside} inside)")
        return self.text_of(inside, two_sided)

    def diffuse(self, node, sides):
        if node.type != "diffuse":
            self.report.note(node.place, f"{node}: diffuse in the sense of Lambert")
            node.ignore("alpha", "use_fast_approx")
        name = "diffuse_reflectance" if "diffuse_reflectance" in node.values else "reflectance"
        return f"{{type: diffuse, albedo: {colour_text(self.colours.reflectance(node, name, 0.5))}{sides}}}"

    def roughness(self, node):
        if not node.type.startswith("rough") and node.type != "pplastic":
            self.report.note(node.place, f"{node}: no smooth surfaces here; with the roughness {self.smooth:g} (--smooth)")
            return self.smooth
        node.ignore("sample_visible")
        if node.text("distribution", "beckmann").lower() != "ggx":
            self.report.note(node.place, f"{node}: GGX stands in for the distribution of Beckmann")
        if "alpha_u" in node.values or "alpha_v" in node.values:
            alphas = node.number("alpha_u"), node.number("alpha_v")
            if alphas[0] != alphas[1]:
                node.fail("is not isotropic", "alpha_u")
            alpha = alphas[0]
        else:
            alpha = self.colours.colour(node, "alpha", 0.1)[0]
        node.ignore("specular_sampling_weight")
        if not 0 < alpha <= 1:
            node.fail(f"alpha {alpha:g} is not above 0 and at most 1", "alpha")
        return alpha

    def conductor(self, node, sides):
        reflectance = self.metal(node) * self.colours.reflectance(node, "specular_reflectance", 1.0)
        return (f"{{type: rough_conductor, roughness: {self.roughness(node):.9g}, "
                f"reflectance: {colour_text(reflectance)}{sides}}}")

    def metal(self, node):
        """Reflectance at normal incidence."""
        material = node.text("material", "Cu" if node.context.old else "none")
        node.ignore("ext_eta", "diffuse_reflectance", "alpha")
        if material == "none" or "eta" in node.values:
            eta, k = self.colours.colour(node, "eta", 0.0), self.colours.colour(node, "k", 1.0)
            reflectance = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
        elif material in METALS:
            reflectance = np.array(METALS[material])
        else:
            node.fail(f"what does {material} reflect? (known: {', '.join(METALS)}; or give eta and k)", "material")
        if np.ptp(reflectance) > 0 or reflectance[0] < 1:
            self.report.note(node.place, f"{node}: reflects at every angle what it does at normal incidence, "
                             f"{colour_text(reflectance)}")
        return reflectance

    def dielectric(self, node, _):
        inside, outside = self.ior(node, "int_ior", "bk7"), self.ior(node, "ext_ior", "air")
        if not inside / outside > 0 or inside == outside:
            node.fail(f"int_ior {inside:g} and ext_ior {outside:g} make no glass", "int_ior")
        for name in ("specular_reflectance", "specular_transmittance"):
            if not np.all(self.colours.colour(node, name, 1.0) == 1):
                self.report.attempt(node.fail, f"{name} is not 1", name)
        return f"{{type: rough_dielectric, roughness: {self.roughness(node):.9g}, ior: {inside / outside:.9g}}}"

    def ior(self, node, name, default):
        value = node.take(name, ("float", "integer", "string"), default)
        if isinstance(value, str):
            if value.lower() not in IOR:
                node.fail(f"what is the index of {value}? (known: {', '.join(IOR)}; or a number)", name)
            value = IOR[value.lower()]
        return value
