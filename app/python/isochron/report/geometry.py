"""The shapes that moved, initial, current and target, within the outlines of the scene: the data of a view that turns."""

import base64

import numpy as np

from isochron.errors import InputError
from isochron.mesh_files import name_in_files, read_run_mesh, read_scene_mesh
from isochron.report.markup import Markup, data_for_scripts, element, section
from isochron.report.surface import colours_of, found_surface, layer_switch

MOST_TRIANGLES = 2500  # of a mesh; larger ones are shown coarser
MOST_OF_FOUND = 6000  # of what a reconstruction found, whose colours need more
MOST_LINES = 1500  # of a shape's outline
ROUND_TRIANGLES = 100  # of the net of a shape without sharp edges
SHARP, FOLDED = np.cos(np.radians((30, 0.2)))  # angles of edges that are drawn, of what stands still and of what moves


def outline(points, triangles, sharp=SHARP):
    """Edges of one face, and those where faces meet at an angle: pairs of vertices."""
    normals = np.cross(points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    faces = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, faces = edges[order], faces[order]
    starts = np.flatnonzero(np.r_[True, np.any(edges[1:] != edges[:-1], axis=1)])
    counts = np.diff(np.r_[starts, len(edges)])
    second = faces[np.minimum(starts + 1, len(faces) - 1)]
    drawn = (counts != 2) | (np.einsum("ij,ij->i", normals[faces[starts]], normals[second]) < sharp)
    lines = edges[starts[drawn]]
    if len(lines) > MOST_LINES:
        lengths = np.linalg.norm(points[lines[:, 0]] - points[lines[:, 1]], axis=1)
        lines = lines[np.argsort(-lengths)[:MOST_LINES]]
    return lines


def coarser(moments, triangles, most=MOST_TRIANGLES):
    """Meshes of one topology with at most about so many triangles: vertices that share a cell of a grid become one."""
    points = moments[0]
    low, size = points.min(axis=0), np.ptp(points, axis=0).max() or 1.0
    cells = int(np.sqrt(most))
    while len(triangles) > most and cells > 4:
        keys = np.floor((points - low) / size * cells).astype(int)
        _, inverse = np.unique(keys, axis=0, return_inverse=True)
        inverse = inverse.ravel()
        few = inverse[triangles]
        few = few[(few != np.roll(few, 1, axis=1)).all(axis=1)]
        if len(few) <= most:
            counts = np.bincount(inverse)
            merged = [np.stack([np.bincount(inverse, p[:, k]) / counts for k in range(3)], axis=1) for p in moments]
            return merged, few
        cells = cells * 4 // 5
    return moments, triangles


def packed(array, kind):
    return base64.b64encode(np.ascontiguousarray(array, kind).tobytes()).decode()


class Geometry:
    def __init__(self, run):
        self.run, self.meshes, self.lines, self.marks, self.notes = run, [], [], [], []
        self.up, self.eye, self.look = np.array([0.0, 1, 0]), None, None
        self.moved, self.coarse, self.names, self.bars = {}, [], {}, {}
        found = found_surface(run)
        if found and found.fit:
            self._add_found(found)
        else:
            for moment in ("initial", "current", "target"):
                self._find(moment)
            self._add_meshes()
        if self.meshes:
            self._read_scene()

    def _find(self, moment):
        names = ["current", "final"] if moment == "current" else [moment]
        for name in names:  # a run that goes on has both
            for path in sorted((self.run.directory / "geometry").glob(f"{name}_*")):
                shape = path.stem.removeprefix(f"{name}_")
                if path.suffix in (".ply", ".obj") and moment not in self.moved.get(shape, {}):
                    mesh = self.run.read(read_run_mesh, f"geometry/{path.name}")
                    if mesh:
                        self.moved.setdefault(shape, {})[moment] = mesh

    def _add_meshes(self):
        for shape, moments in self.moved.items():
            names = [m for m in moments if len(moments[m][0]) == len(next(iter(moments.values()))[0])]
            points, triangles = self._coarser(shape, [moments[m][0] for m in names], moments[names[0]][1], MOST_TRIANGLES)
            for name, p in zip(names, points):
                self.meshes.append({"shape": shape, "moment": name, "points": p, "triangles": triangles, "layers": {},
                                    "about": p})
        present = {mesh["moment"] for mesh in self.meshes}
        self.names = {m: "final" if m == "current" and self.run.ended else m for m in MOMENTS if m in present}

    def _add_found(self, found):
        """Back-projection stands where other runs have the initial shape."""
        self.moved = {found.shape: {}}
        for moment, surface in (("initial", found.back_projection), ("current", found.fit)):
            layers, bars = colours_of(found, surface)
            whole = found.wall.world(surface.points)
            (points, *colours), triangles = self._coarser(surface.name, [whole, *layers.values()], surface.triangles, MOST_OF_FOUND)
            self.meshes.append({"shape": surface.name, "moment": moment, "points": points, "triangles": triangles,
                                "layers": dict(zip(layers, colours)), "about": whole[found.lit(surface)]})
            self.names[moment] = surface.name
            for layer, bar in bars.items():
                self.bars.setdefault(layer, []).append(bar)

    def _coarser(self, shape, moments, triangles, most):
        if len(triangles) <= most:
            return moments, triangles
        self.coarse.append(shape)
        return coarser(moments, triangles, most)

    def _read_scene(self):
        path, scene = self.run.scene_path, self.run.scene
        try:
            self._add_view(scene)
            for entry in scene.get("shapes") or []:
                name = str(entry.get("name"))
                if name_in_files(name) not in self.moved:
                    self._add_outline(name, path.parent / str(entry.get("file", "")), entry.get("transform") or {})
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            self.run.note(f"{path}: cannot be drawn: {error}")

    def _add_view(self, scene):
        if isinstance(scene.get("camera"), dict):
            camera = scene["camera"]
            self.eye, self.look = (np.array(camera[k], float) for k in ("position", "look_at"))
            self.up = np.array(camera.get("up", self.up), float)
            self.marks.append(("camera", self.eye))
        sensor = scene.get("capture")
        if isinstance(sensor, dict):
            grid = sensor.get("sensor")
            if isinstance(grid, dict) and "corner" in grid:
                corner, across, down = (np.array(grid[k], float) for k in ("corner", "across", "down"))
                normal = np.array(sensor["normal"], float)
                self._add_wall(np.array([corner, corner + across, corner + across + down, corner + down]), normal)
            elif "file" in sensor:
                self.run.read(self._read_wall, "final.h5")
        for light in scene.get("lights") or []:
            if isinstance(light, dict) and isinstance(light.get("position"), list):
                self.marks.append((str(light.get("name", "light")), np.array(light["position"], float)))

    def _add_wall(self, corners, normal):
        self.lines.append((corners, np.array([[0, 1], [1, 2], [2, 3], [3, 0]])))
        down = corners[3] - corners[0]
        self.up, self.look = -down / (np.linalg.norm(down) or 1), corners.mean(axis=0)
        # From behind the wall and aside, so that what is hidden lies ahead.
        self.eye = self.look - normal * np.linalg.norm(corners[1] - corners[0])
        self.marks.append(("sensor points", corners[0]))

    def _read_wall(self, path):
        """Of a measurement: a grid of points, columns first, in metres as scenes of such files are."""
        import h5py

        with h5py.File(path, "r") as file:
            points, normals = file["sensor_grid_xyz"][()], file["sensor_grid_normals"][()]
        if points.ndim == 3:
            corners = np.array([points[0, 0], points[-1, 0], points[-1, -1], points[0, -1]])
            self._add_wall(corners, normals.reshape(-1, 3).mean(axis=0))

    def _add_outline(self, name, path, transform):
        try:
            points, triangles = read_scene_mesh(path, transform)
        except InputError as error:
            self.notes.append(f"{name} is not drawn: {error}")
            return
        lines = outline(points, triangles)
        if not len(lines):  # round: a coarse net of it
            (points,), triangles = coarser([points], triangles, ROUND_TRIANGLES)
            lines = outline(points, triangles, 2)
        used, renumbered = np.unique(lines, return_inverse=True)
        self.lines.append((points[used], renumbered.reshape(-1, 2)))

    def data(self):
        everything = np.concatenate([m["points"] for m in self.meshes] + [p for p, _ in self.lines])
        moving = np.concatenate([m["about"] for m in self.meshes])
        low, high = everything.min(axis=0), everything.max(axis=0)
        middle = (moving.min(axis=0) + moving.max(axis=0)) / 2
        # The moving shapes are in the middle; of a scene that is far larger, what is about them. What was found fills the view.
        size = float(np.linalg.norm(high - low)) / 2 or 1.0
        near = float(np.linalg.norm(np.ptp(moving, axis=0))) / 2 or size
        back = self.eye - middle if self.eye is not None else np.array([0.4, 0.3, 1.0])
        back = back / (np.linalg.norm(back) or 1)
        meshes = [{"shape": m["shape"], "moment": m["moment"], "points": packed(m["points"], "<f4"),
                   "triangles": packed(m["triangles"], "<u4"),
                   "layers": {name: packed(np.rint(colours), "u1") for name, colours in m["layers"].items()},
                   "edges": packed(outline(m["points"], m["triangles"], FOLDED), "<u4")} for m in self.meshes]
        lines = [{"points": packed(p, "<f4"), "pairs": packed(pairs, "<u4")} for p, pairs in self.lines]
        return {"meshes": meshes, "lines": lines, "middle": middle.tolist(), "radius": min(size, (1.3 if self.bars else 3.6) * near),
                "up": self.up.tolist(), "back": back.tolist(), "marks": [[name, at.tolist()] for name, at in self.marks]}


MOMENTS = ("initial", "current", "target")


def geometry_section(run):
    geometry = Geometry(run)
    if not geometry.meshes:
        return Markup("")
    names = geometry.names
    box = element("label", element("input", type="checkbox", checked=True, id="edges"), " ",
                  element("span", class_="key m-target", aria_hidden="true"), " the target's edges in every view")
    shapes = ", ".join(geometry.moved)
    words = (f"The scene from its camera's side. {shapes}: {', '.join(names.values())}, side by side; "
             "other shapes as outlines.")
    if geometry.bars:
        words = f"The surface and the wall, from behind the wall: {', '.join(names.values())}, side by side."
    canvas = element("canvas", words, id="view", width="1200", height="440", tabindex="0", role="img", aria_label=words,
                     aria_describedby="view-keys")
    keys = element("p", "Drag, or arrow keys: turn. + and −: nearer and farther. Home: initial view.", class_="note",
                   id="view-keys")
    notes = [f"{name}: drawn coarser than it is" for name in geometry.coarse]
    notes += geometry.notes
    controls = element("p", box, class_="controls") if "target" in names and len(names) > 1 else None
    return section("geometry", "Geometry", controls, layer_switch(geometry.bars), canvas, keys,
                   element("p", "; ".join(notes) + ".", class_="note") if notes else None, distances(geometry, names),
                   data_for_scripts({**geometry.data(), "names": names}, id="view-data"))


def distances(geometry, names):
    """What the view shows, in words: how far vertices are from the target's."""
    items = []
    for shape in geometry.moved:
        moments = geometry.moved[shape]
        if "target" not in moments:
            continue
        target = moments["target"][0]
        words = []
        for name in ("initial", "current"):
            if name in moments and len(moments[name][0]) == len(target):
                away = np.linalg.norm(moments[name][0] - target, axis=1)
                words.append(f"{names[name]} {np.sqrt(np.mean(away**2)):.3g} (at most {away.max():.3g})")
        if words:
            distance = ", ".join(words)
            items.append(element("li", f"{shape}: vertices' RMS distance from the target's: {distance}, in scene units"))
    return element("ul", *items, class_="note") if items else None
