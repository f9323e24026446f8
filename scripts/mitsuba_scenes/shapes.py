"""Mitsuba's shapes as meshes in the world, each with a name, a material and an emission."""

from dataclasses import dataclass

import numpy as np
from isochron.errors import InputError

from . import matrices, meshes, serialized
from .document import SceneError
from .writing import colour_text

WITHOUT_EFFECT = ("silhouette_sampling_weight", "flip_tex_coords", "max_smooth_angle", "srgb", "collapse")
POINTER = b"version https://git-lfs"
MOST_NAMES = 8  # in a line


@dataclass
class Shape:
    name: str
    mesh: meshes.Mesh
    material: str
    emission: str = ""  # as our file has it
    node: object = None


class Shapes:
    def __init__(self, report, materials, colours, fineness):
        self.report, self.materials, self.colours, self.fineness = report, materials, colours, fineness
        self.found, self.names, self.curved = [], set(), []
        self.walls = []  # rectangles that a capture looks at
        self.lamps = set()  # ids of the emitters that shapes have

    def add_all(self, scene):
        for _, node in scene.objects("shape"):
            if node.type != "shapegroup":
                self.report.attempt(self.add, node, np.eye(4), "")
        if self.curved:
            names = [name for _, name in self.curved]
            more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
            self.report.note(self.curved[0][0], "facets are flat here where Mitsuba shades smoothly: "
                             + ", ".join(names[:MOST_NAMES]) + more)

    def add(self, node, outer, prefix):
        if node.type == "instance":
            return self.add_instance(node, outer, prefix)
        if node.type in ("shapegroup", "merge"):
            for _, inner in node.objects("shape"):
                self.report.attempt(self.add, inner, outer, prefix)
            return self.report.refuse_rest(node)
        name = self.free_name(prefix + (node.id or f"shape_{len(self.names) + 1}"))
        node.ignore(*WITHOUT_EFFECT)
        if node.objects("medium", "subsurface"):
            self.report.attempt(node.fail, "no media")
        bsdf, emitter, sensor = node.only("bsdf"), node.only("emitter"), node.only("sensor")
        if bsdf and bsdf.type == "null":
            bsdf.fail("surfaces that nobody sees are left out")
        mesh, to_world = self.mesh_of(node), outer @ node.transform()
        mesh = meshes.transformed(mesh, to_world, node.boolean("flip_normals"))
        if not mesh.flat:
            self.curved.append((node.place, name))
        shape = Shape(name, mesh, self.materials.name_of(bsdf, name), node=node)
        if emitter:
            shape.emission = self.report.attempt(self.emission, emitter, otherwise="")
        if sensor and sensor.type == "nlos_capture_meter":
            if node.type != "rectangle":
                node.fail("captures are of rectangles alone")
            self.walls.append((shape, sensor, to_world))
        node.ignore("face_normals")
        self.report.refuse_rest(node)
        self.found.append(shape)
        return None

    def add_instance(self, node, outer, prefix):
        groups = [inner for _, inner in node.objects("shape")]
        if len(groups) != 1 or groups[0].type != "shapegroup":
            node.fail("is of no shapegroup")
        name = self.free_name(prefix + (node.id or f"instance_{len(self.names) + 1}"))
        self.add(groups[0], outer @ node.transform(), name + "_")
        self.report.refuse_rest(node)

    def free_name(self, wanted):
        name, count = wanted, 1
        while name in self.names:
            count += 1
            name = f"{wanted}_{count}"
        self.names.add(name)
        return name

    def emission(self, emitter):
        self.lamps.add(id(emitter))
        if emitter.type != "area":
            emitter.fail("no such emitter on a shape (allowed: area)")
        radiance = self.colours.colour(emitter, "radiance", 1.0, emission=True)
        if radiance.min() < 0:
            emitter.fail("radiance is negative", "radiance")
        emitter.ignore("sampling_weight")
        self.report.refuse_rest(emitter)
        return colour_text(radiance) if radiance.max() > 0 else ""

    def mesh_of(self, node):
        """In its own space, before to_world."""
        kinds = {"obj": self.file, "ply": self.file, "serialized": self.serialized, "rectangle": lambda node: meshes.rectangle(),
                 "cube": lambda node: meshes.cube(), "disk": lambda node: meshes.disk(self.fineness),
                 "sphere": self.sphere, "cylinder": self.cylinder}
        if node.type not in kinds:
            node.fail("no such shape here (allowed: " + ", ".join([*kinds, "shapegroup", "instance", "merge"]) + ")")
        return kinds[node.type](node)

    def file_of(self, node):
        path = node.file()
        with path.open("rb") as file:
            if file.read(len(POINTER)) == POINTER:
                node.fail(f"{path} is a pointer of Git LFS: its content was not fetched", "filename")
        return path

    def file(self, node):
        path = self.file_of(node)
        try:
            mesh = meshes.read(path, node.type)
        except InputError as error:
            raise SceneError(node.values["filename"].place, str(error)) from None
        return mesh if node.boolean("face_normals") else meshes.shaded_by_its_normals(mesh)

    def serialized(self, node):
        path, index = self.file_of(node), node.integer("shape_index", 0)
        try:
            found, flat = serialized.read(path, index)
        except InputError as error:
            raise SceneError(node.values["filename"].place, str(error)) from None
        mesh = meshes.of_polygons(found)
        return mesh if node.boolean("face_normals") or flat else meshes.shaded_by_its_normals(mesh)

    def sphere(self, node):
        matrix = matrices.translation(node.point("center", np.zeros(3))) @ self.radius(node)
        return self.rounded(node, meshes.transformed(meshes.sphere(self.fineness), matrix, False))

    def cylinder(self, node):
        start, end = node.point("p0", np.zeros(3)), node.point("p1", np.array([0.0, 0, 1]))
        length = np.linalg.norm(end - start)
        if not length > 0:
            node.fail("has no length")
        # look_at's frame is right-handed, whatever its up.
        frame = matrices.look_at(start, end, np.zeros(3))
        matrix = frame @ np.diag([1, 1, length, 1]) @ self.radius(node, (1, 1, 0))
        return self.rounded(node, meshes.transformed(meshes.cylinder(self.fineness), matrix, False))

    def radius(self, node, axes=(1, 1, 1)):
        radius = node.number("radius", 1.0)
        if not radius > 0:
            node.fail(f"its radius is {radius:g}", "radius")
        return matrices.scaling(np.where(axes, radius, 1))

    def rounded(self, node, mesh):
        self.report.note(node.place, f"{node}: {len(mesh.faces)} facets (--fineness)")
        return mesh
