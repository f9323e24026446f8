"""mitransient's captures around corners: a wall that a detector looks at and a projector lights."""

import numpy as np

from . import matrices
from .sensors import WITHOUT_EFFECT, limited
from .writing import colour_text, vector_text


class Capture:
    """What our scene and experiment have of it: `lines`, `max_bounces`, `reflects` (whether the wall is part of the hidden
    scene, too) and `scale`, what our values are to be multiplied by to be mitransient's."""

    def __init__(self, scene, sensor, wall, film, report, colours, options):
        self.report, self.colours, self.options, self.film = report, colours, options, film
        self.sensor, self.wall = sensor, wall
        self.integrator = scene.only("integrator")
        self.albedo = self.wall_albedo(wall.shape.node.only("bsdf"))
        sensor.ignore("account_first_and_last_bounces", "laser_origin", "laser_lookat_pixel", "laser_lookat_3d")
        for name in ("original_film_width", "original_film_height"):
            if name in sensor.values:
                sensor.fail(f"{name}: say capture_type confocal in the integrator, and the film's whole size", name)
        self.kind = self.capture_type()
        self.projector = self.find_projector(scene)
        self.laser_origin, self.laser_matrix = self.laser()
        self.mask = None if wall.seen is None else wall.seen.reshape(-1, 1)  # [columns, rows] of a list of points
        self.spots = self.find_spots()
        self.lines = self.written_lines()
        self.max_bounces = self.bounces()
        self.reflects = self.wall_reflects() or sensor.type == "perspective"
        self.scale = self.find_scale()
        self.integrator.ignore(*WITHOUT_EFFECT, "nlos_laser_sampling", "discard_direct_paths", "hide_emitters")
        for node in (self.integrator, self.projector, sensor):
            report.refuse_rest(node)

    def wall_albedo(self, bsdf):
        if bsdf is not None and bsdf.type == "twosided":
            bsdf = bsdf.only("bsdf")
        if bsdf is None:
            return np.full(3, 0.5)
        if bsdf.type != "diffuse":
            bsdf.fail("the wall of a capture is diffuse")
        return self.colours.colour(bsdf, "reflectance", 0.5)

    def capture_type(self):
        kinds = ("single", "confocal", "exhaustive")
        value = self.integrator.take("capture_type", ("integer", "string"), "single")
        if isinstance(value, int) and 1 <= value <= 3:
            value = kinds[value - 1]
        if str(value).lower() not in kinds:
            self.integrator.fail(f"no capture_type {value}", "capture_type")
        return "confocal" if self.sensor.boolean("confocal") else value.lower()

    def find_projector(self, scene):
        found = [node for node in [*scene.objects("emitter"), *self.sensor.objects("emitter")]]
        found = [node for _, node in found if node.type == "projector"]
        if len(found) != 1:
            self.sensor.fail(f"{len(found)} projectors; its laser is one")
        return found[0]

    def laser(self):
        """Where it stands, and its transform."""
        matrix = self.projector.transform()
        origin = self.sensor.point("laser_origin")
        return matrix[:3, 3] if origin is None else origin, matrix

    def find_spots(self):
        """Points that are lit; none: those that are looked at."""
        self.integrator.ignore("illumination_scan_fov", "force_equal_illumination_scanning")
        film = self.sensor.only("film")
        film.ignore("exhaustive_scan", "laser_scan_width", "laser_scan_height")
        if self.kind == "confocal":
            return None
        if self.kind == "exhaustive":
            if self.integrator.boolean("force_equal_illumination_scanning", True):
                return self.wall.points
            return self.scanned(film.integer("laser_scan_width", 0), film.integer("laser_scan_height", 0))
        return self.aim()[np.newaxis]

    def aim(self):
        pixel, point = self.options.laser_pixel, self.options.laser_point
        if pixel is None and point is None:
            pixel, point = self.sensor.point("laser_lookat_pixel"), self.sensor.point("laser_lookat_3d")
        if pixel is not None and self.sensor.type != "nlos_capture_meter":
            self.sensor.fail("pixels to aim the laser at are of an nlos_capture_meter (--laser-point names a point)")
        if pixel is not None:
            # As mitransient counts: whole numbers are corners of pixels.
            return self.wall.point(pixel[0] / self.film.width, pixel[1] / self.film.height)
        if point is not None:
            return np.asarray(point, float)
        spot = self.wall.hit(self.laser_origin, self.laser_matrix[:3, 2])
        if spot is None:
            self.projector.fail("misses the wall (--laser-pixel or --laser-point says where it is aimed)")
        return spot

    def scanned(self, width, height):
        if min(width, height) < 1:
            self.sensor.fail("its film has no laser_scan_width and laser_scan_height")
        half = np.tan(np.radians(self.integrator.number("illumination_scan_fov", 20.0)) / 2)
        spots = []
        for row in range(height):
            for column in range(width):
                local = (half * (1 - 2 * column / width), half * (1 - 2 * row / height), 1)
                spots.append(self.wall.hit(self.laser_origin, matrices.directions(self.laser_matrix, local)))
        if any(spot is None for spot in spots):
            self.projector.fail("its scan goes beyond the wall")
        return np.array(spots)

    def written_lines(self):
        laser = "confocal" if self.spots is None else "{points: [" + ", ".join(map(vector_text, self.spots)) + "]}"
        lines = [*self.wall.lines, f"  normal: {vector_text(self.wall.normal)}", f"  laser: {laser}"]
        if self.integrator.boolean("account_first_and_last_bounces"):
            laser, sensor = vector_text(self.laser_origin), vector_text(self.wall.origin)
            lines.append(f"  origin: {{laser: {laser}, sensor: {sensor}}}")
        return lines

    def bounces(self):
        node = self.integrator
        exact = node.integer("filter_bounces", -1)
        if exact == -1:
            exact = node.integer("filter_depth", -1) - 1
        node.ignore("filter_depth")
        if exact == 3:
            return 1
        if exact >= 0:
            node.fail(f"paths of {exact} bounces alone (3 can be had: the wall, the hidden scene, the wall)")
        depth = node.integer("max_depth", 6)
        # The laser's spot is found without a step of its own where it is sampled.
        own = 2 if node.boolean("nlos_laser_sampling") else 3
        return limited(node, self.report, max(depth - own, 0) if depth >= 0 else None, self.options.max_bounces)

    def wall_reflects(self):
        """Whether paths meet it between the hidden surfaces."""
        node = self.integrator
        hidden_alone = node.boolean("nlos_hidden_geometry_sampling")
        for name in ("do_rroulette", "includes_relay_wall"):
            hidden_alone &= not node.boolean("nlos_hidden_geometry_sampling_" + name)
        return not hidden_alone

    def find_scale(self):
        irradiance = self.colours.colour(self.projector, "irradiance", 1.0, emission=True)
        self.projector.ignore("fov", "fov_axis", "focal_length")
        to_laser = self.laser_origin - (self.wall.points if self.spots is None else self.spots)
        distances = np.linalg.norm(to_laser, axis=1)
        if not distances.min() > 0:
            self.report.note(self.projector.place, f"{self.projector}: is on the wall: mitransient's values are unknown")
            return None
        falloff = np.abs(to_laser @ self.wall.normal) / distances**3
        colour = np.pi * irradiance * self.projector.number("scale", 1.0) * self.albedo**2 * self.film.bins[1]
        extremes = (np.array([float(f"{x:.6g}") for x in colour * f]) for f in (falloff.min(), falloff.max()))
        least, most = map(colour_text, extremes)
        return least if least == most else f"{least} to {most}, from spot to spot"
