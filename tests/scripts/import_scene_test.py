#!/usr/bin/python3
"""scripts/import_scene.py on small scenes in Mitsuba's format: what they become (import_scene_rendering_test.py renders).

usage: import_scene_test.py PROGRAM
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(SOURCE / "scripts"), str(SOURCE / "app/python")]
import import_scene
import numpy as np
import yaml
from in_process import run_main
from isochron import exr
from matplotlib import image

PROGRAM = sys.argv.pop(1)

CAMERA = """<sensor type="perspective"> <float name="fov" value="50"/>
  <transform name="to_world"> <lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/> </transform>
  <film type="hdrfilm"> <integer name="width" value="8"/> <integer name="height" value="8"/> </film> </sensor>"""
LIT = CAMERA + '<emitter type="point"> <point name="position" value="0 0 4"/> </emitter>'


def scene(*parts):
    return "<scene version='3.5.0'>\n" + "\n".join(parts) + "\n</scene>\n"


def shape(kind, inside="", transform=""):
    to_world = f'<transform name="to_world">{transform}</transform>' if transform else ""
    return f'<shape type="{kind}" id="it">{inside}{to_world}</shape>'


def read_obj(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    points = np.array([[float(x) for x in words[1:]] for words in lines if words[0] == "v"])
    return points, [[int(x) - 1 for x in words[1:]] for words in lines if words[0] == "f"]


def newell(points, face):
    """Of a polygon: a vector along its normal, as long as its area."""
    p = points[face]
    return 0.5 * np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)


class ImportSceneTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        self.out = self.folder / "out"

    def run_script(self, text, *options):
        """In this process; test_as_a_user_runs_it starts one."""
        (self.folder / "in.xml").write_text(text)
        return run_main(import_scene.main, self.folder / "in.xml", "-o", self.out, "--force", *options)

    def imported(self, text, *options):
        result = self.run_script(text, *options)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.said = result.stdout
        return yaml.safe_load((self.out / "scene.yaml").read_text())

    def mesh(self, text, *options):
        self.imported(scene(LIT, text), *options)
        return read_obj(self.out / "it.obj")

    def assert_fails(self, message, text, *options):
        result = self.run_script(text, *options)
        self.assertEqual((result.returncode, result.stdout), (2, ""), message)
        self.assertRegex(result.stderr, rf"\Aimport_scene\.py: (.*/in\.xml:\d+: )?{message}[^\n]*\n\Z")
        self.assertFalse(self.out.exists())

    def rendered(self, *options):
        words = [PROGRAM, "render", self.out / "experiment.yaml", "-o", self.out / "r", "--quiet", "--no-plots", *options]
        done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return self.out / "r"

    def image(self, *options):
        """Height, width, gate, colour."""
        channels = exr.read(self.rendered(*options) / "render.exr")
        gates = sorted({name.split(".")[0] for name in channels})
        colours = "RGB" if f"{gates[0]}.R" in channels else "Y"
        return np.stack([np.stack([channels[f"{gate}.{c}"] for c in colours], -1) for gate in gates], 2).astype(float)


class MeshesTest(ImportSceneTest):
    def test_primitives_face_outwards(self):
        points, faces = self.mesh(shape("rectangle"))
        np.testing.assert_allclose(newell(points, faces[0]), (0, 0, 4))
        np.testing.assert_allclose((points.min(axis=0), points.max(axis=0)), ((-1, -1, 0), (1, 1, 0)))
        points, faces = self.mesh(shape("disk"), "--fineness", 6)
        np.testing.assert_allclose(sum(newell(points, face) for face in faces), (0, 0, np.pi), rtol=1e-3, atol=1e-9)
        radius = "<float name='radius' value='2'/>"
        for kind, area, volume, inside in (("cube", 24, 8, ""), ("sphere", 16 * np.pi, 32 / 3 * np.pi, radius)):
            for mirror, flip in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
                flips = "<boolean name='flip_normals' value='true'/>" if flip < 0 else ""
                points, faces = self.mesh(shape(kind, inside + flips, f'<scale x="{mirror}"/><translate x="3"/>'))
                normals = np.array([newell(points, face) for face in faces])
                middles = np.array([points[face].mean(axis=0) for face in faces])
                self.assertAlmostEqual(np.linalg.norm(normals, axis=1).sum() / area, 1, delta=0.01)
                # Of a mirrored solid, too, the outside is the outside.
                self.assertAlmostEqual((normals * middles).sum() / 3 / volume, flip, delta=0.01)
                np.testing.assert_allclose(points.min(axis=0) + points.max(axis=0), (6, 0, 0), atol=1e-6)
        points, faces = self.mesh(shape("cylinder", '<point name="p0" x="1" y="0" z="0"/>'
                                        '<point name="p1" x="1" y="3" z="0"/><float name="radius" value="0.5"/>'))
        normals = np.array([newell(points, face) for face in faces])
        out = np.array([points[face].mean(axis=0) for face in faces]) - (1, 1.5, 0)
        self.assertGreater((normals * out).sum(axis=1).min(), 0)
        self.assertAlmostEqual(np.linalg.norm(normals, axis=1).sum(), 3 * np.pi, delta=0.01)
        np.testing.assert_allclose((points[:, 1].min(), points[:, 1].max()), (0, 3), atol=1e-9)

    def test_transforms_act_in_their_order(self):
        def corner(transform):
            points, faces = self.mesh(shape("rectangle", "", transform))
            return points[points @ (1, 2, 4) == (points @ (1, 2, 4)).max()][0], newell(points, faces[0])

        at, normal = corner('<scale x="2" y="3"/><rotate y="1" angle="90"/><translate value="1 2 3"/>')
        np.testing.assert_allclose(at, (1, 5, 5))  # x turns to -z, and the normal to +x
        np.testing.assert_allclose(normal, (24, 0, 0), atol=1e-6)
        at, _ = corner('<translate value="1 2 3"/><rotate y="1" angle="90"/><scale value="2"/>')
        np.testing.assert_allclose(at, (6, 6, 0), atol=1e-6)
        at, normal = corner('<matrix value="0 1 0 5  -1 0 0 6  0 0 1 7  0 0 0 1"/>')
        np.testing.assert_allclose((at, normal), ((6, 7, 7), (0, 0, 4)))
        _, normal = corner('<lookat origin="1,1,1" target="1,1,-2" up="0,1,0"/>')
        np.testing.assert_allclose(normal, (0, 0, -4), atol=1e-9)  # its z axis looks at the target
        # A sheared normal stays at a right angle to its surface.
        _, normal = corner('<matrix value="1 0 0  0 1 0  1 0 1"/>')
        np.testing.assert_allclose(normal, (-4, 0, 4), atol=1e-9)

    def test_instances_repeat_groups(self):
        group = '<shape type="shapegroup" id="g">' + shape("cube", "", '<translate x="1"/>') + "</shape>"
        turned = ('<shape type="instance" id="a"><ref id="g"/><transform name="to_world"><scale value="2"/></transform>'
                  '</shape>')
        other = '<shape type="instance"><ref id="g"/></shape>'
        shapes = self.imported(scene(LIT, group, turned, other))["shapes"]
        self.assertEqual(len(shapes), 2)
        self.assertEqual(shapes[0]["name"], "a_it")
        points = read_obj(self.out / shapes[0]["file"])[0]
        np.testing.assert_allclose((points.min(axis=0), points.max(axis=0)), ((0, -2, -2), (4, 2, 2)))
        self.assertEqual(read_obj(self.out / shapes[1]["file"])[0].max(), 2)

    def test_front_is_where_the_normals_point(self):
        text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 -1\nf 1//1 2//1 3//1 4//1\n"
        (self.folder / "a.obj").write_text(text)
        file = '<string name="filename" value="a.obj"/>'
        self.assertEqual(newell(*[x if i == 0 else x[0] for i, x in enumerate(self.mesh(shape("obj", file)))])[2], -1)
        points, faces = self.mesh(shape("obj", file + '<boolean name="face_normals" value="true"/>'))
        self.assertEqual(newell(points, faces[0])[2], 1)
        self.assertNotIn("flat", self.said)
        (self.folder / "a.obj").write_text(text.replace("vn 0 0 -1", "vn 0 0.3 -1"))
        self.mesh(shape("obj", file))
        self.assertIn("facets are flat here where Mitsuba shades smoothly: it", self.said)

    def test_ply_files(self):
        header = ("ply\nformat {}\ncomment c\nelement vertex 3\nproperty float x\nproperty double y\nproperty float z\n"
                  "property float nx\nproperty float ny\nproperty float nz\nelement face 1\nproperty uchar quality\n"
                  "property list uchar int vertex_indices\nend_header\n")
        corners = ((0, 0, 0.5), (2, 0, 0.5), (0, 1, 0.5))
        text = "".join(f"{x} {y} {z} 0 0 -1\n" for x, y, z in corners) + "7 3 0 1 2\n"
        (self.folder / "a.ply").write_text(header.format("ascii 1.0") + text)
        file = '<string name="filename" value="a.ply"/>'
        meshes = [self.mesh(shape("ply", file))]
        for order, name in (("<", "little"), (">", "big")):
            rows = np.array([(x, y, z, 0, 0, -1) for x, y, z in corners],
                            f"{order}f4, {order}f8, {order}f4, {order}f4, {order}f4, {order}f4")
            face = np.array([(7, 3, (0, 1, 2))], f"u1, u1, ({3},){order}i4")
            text = header.format(f"binary_{name}_endian 1.0").encode()
            (self.folder / "a.ply").write_bytes(text + rows.tobytes() + face.tobytes())
            meshes.append(self.mesh(shape("ply", file)))
        for points, faces in meshes:
            np.testing.assert_allclose(points, corners)
            np.testing.assert_allclose(newell(points, faces[0]), (0, 0, -1))
        (self.folder / "a.ply").write_bytes((self.folder / "a.ply").read_bytes()[:-6])
        result = self.run_script(scene(LIT, shape("ply", file)))
        self.assertEqual((result.returncode, result.stderr.count("\n")), (2, 1))
        self.assertRegex(result.stderr, r"in.xml:\d+: .*a.ply: is damaged")


class DocumentTest(ImportSceneTest):
    def test_parameters_includes_and_references(self):
        (self.folder / "parts.xml").write_text(
            '<scene version="3.0.0"><default name="grey" value="0.1"/><bsdf type="diffuse" id="paint">'
            '<float name="reflectance" value="$grey"/></bsdf></scene>')
        text = scene('<default name="grey" value="0.7"/> <default name="half" value="4"/>',
                     LIT.replace('value="8"', 'value="$half"'), '<include filename="parts.xml"/>',
                     shape("cube", '<ref id="paint"/>'))
        found = self.imported(text)
        self.assertEqual((found["materials"], found["camera"]["resolution"]),
                         ({"paint": {"type": "diffuse", "albedo": 0.7}}, [4, 4]))
        found = self.imported(text, "-D", "grey=0.25", "-D", "half=16", "-D", "unheard=3")
        self.assertEqual((found["materials"]["paint"]["albedo"], found["camera"]["resolution"]), (0.25, [16, 16]))
        self.assertIn("-D unheard: no $unheard here", self.said)
        # Before version 2 names were in camelCase.
        old = scene(LIT, shape("cube")).replace("3.5.0", "0.6.0").replace("to_world", "toWorld")
        self.assertEqual(self.imported(old)["camera"]["position"], [0, 0, 5])

    def test_materials(self):
        def material(text):
            return next(iter(self.imported(scene(LIT, shape("cube", text)))["materials"].values()))

        self.assertEqual(material(""), {"type": "diffuse", "albedo": 0.5})
        rgb = '<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.1, 0.2, 0.3"/></bsdf></bsdf>'
        self.assertEqual(material(rgb), {"type": "diffuse", "albedo": [0.1, 0.2, 0.3], "two_sided": True})
        metal = material('<bsdf type="roughconductor"><string name="distribution" value="ggx"/>'
                         '<float name="alpha" value="0.3"/><float name="eta" value="0.5"/><float name="k" value="2"/>'
                         '</bsdf>')
        self.assertEqual((metal["type"], metal["roughness"]), ("rough_conductor", 0.3))
        self.assertAlmostEqual(metal["reflectance"], (0.25 + 4) / (2.25 + 4), 6)
        self.assertIn("at normal incidence", self.said)
        mirror = {"type": "rough_conductor", "roughness": 0.05, "reflectance": 1}
        self.assertEqual(material('<bsdf type="conductor"/>'), mirror)
        self.assertIn("(--smooth)", self.said)
        glass = material('<bsdf type="roughdielectric"><float name="int_ior" value="1.6"/>'
                         '<string name="ext_ior" value="water"/></bsdf>')
        self.assertEqual((glass["type"], glass["roughness"]), ("rough_dielectric", 0.1))
        self.assertAlmostEqual(glass["ior"], 1.6 / 1.333, 6)
        self.assertIn("Beckmann", self.said)
        board = ('<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"><rgb name="color0" value="0.8"/>'
                 '<float name="color1" value="0"/></texture></bsdf>')
        self.imported(scene(LIT, shape("cube", board)), "--mean-textures")
        self.assertIn("albedo: 0.4}", (self.out / "scene.yaml").read_text())
        image.imsave(self.folder / "a.png", np.array([[[0, 0, 0], [188, 255, 0]]], np.uint8))  # sRGB: 188 is 0.503
        bitmap = ('<bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="a.png"/>'
                  '</texture></bsdf>')
        found = self.imported(scene(LIT, shape("cube", bitmap)), "--mean-textures")
        np.testing.assert_allclose(found["materials"]["it_material"]["albedo"], (0.2514, 0.5, 0), atol=1e-3)

    def test_lights(self):
        spot = ('<emitter type="spot"><rgb name="intensity" value="3"/><float name="cutoff_angle" value="40"/>'
                '<transform name="to_world"><lookat origin="1 2 3" target="1 2 0" up="0 1 0"/></transform></emitter>')
        light = self.imported(scene(CAMERA, spot, shape("cube")))["lights"][0]
        self.assertEqual(light, {"name": "light_1", "type": "spot", "position": [1, 2, 3], "direction": [0, 0, -1],
                                 "cone": 40, "blend": 0.25, "intensity": 3})
        area = '<emitter type="area"><spectrum name="radiance" value="2"/></emitter>'
        emission = self.imported(scene(CAMERA, shape("rectangle", area)))["shapes"][0]["emission"]
        equal_energy = np.array((1.204794, 0.948292, 0.908916))  # not white where that is D65
        np.testing.assert_allclose(emission, 2 * equal_energy, rtol=1e-5)

    def test_cameras(self):
        def fov(inside, size=(8, 4), old='<float name="fov" value="50"/>'):
            text = CAMERA.replace(old, inside).replace('"width" value="8"', f'"width" value="{size[0]}"').replace(
                '"height" value="8"', f'"height" value="{size[1]}"')
            return self.imported(scene(text, '<emitter type="point"/>', shape("cube")))["camera"]["fov"]

        def wide(factor):
            return 2 * np.degrees(np.arctan(np.tan(np.radians(25)) * factor))

        for axis, size, factor in (("x", (8, 4), 1), ("y", (8, 4), 2), ("smaller", (8, 4), 2), ("larger", (8, 4), 1),
                                   ("smaller", (4, 8), 1), ("larger", (4, 8), 0.5), ("diagonal", (8, 6), 0.8)):
            found = fov(f'<float name="fov" value="50"/><string name="fov_axis" value="{axis}"/>', size)
            self.assertAlmostEqual(found, wide(factor), 6, (axis, size))
        diagonal = np.hypot(36, 24) / 2 / 35
        self.assertAlmostEqual(fov('<string name="focal_length" value="35mm"/>', (6, 4)),
                               2 * np.degrees(np.arctan(diagonal * 6 / np.hypot(6, 4))), 6)
        crop = "".join(f'<integer name="crop_{name}" value="{value}"/>' for name, value in
                       (("width", 4), ("height", 4), ("offset_x", 2), ("offset_y", 2)))
        height = '<integer name="height" value="8"/>'
        self.assertAlmostEqual(fov(height + crop, (8, 8), height), wide(0.5), 6)

    def test_what_cannot_be_turned_is_named(self):
        def value(kind, text):
            return f'<shape type="{kind}">{text}</shape>'

        def bad(part, *options):
            return scene(LIT, shape("cube"), part), *options

        hair = shape("sphere", '<bsdf type="hair"/>').replace('"it"', '"other"')
        self.assert_fails(r"bsdf 'hair': no such material here \(allowed: diffuse, ", *bad(hair))
        self.assert_fails("shape 'hair': no such shape here", *bad('<shape type="hair"/>'))
        self.assert_fails("emitter 'envmap': no light from all around here", *bad('<emitter type="envmap"/>'))
        self.assert_fails(r"texture 'bitmap': no textures \(--mean-textures", *bad(
            '<shape type="cube"><bsdf type="diffuse"><texture type="bitmap" name="reflectance"/></bsdf></shape>'))
        self.assert_fails("the wavelengths of a spectrum do not rise", *bad(
            value("cube", '<bsdf type="diffuse"><spectrum name="reflectance" value="700:0.1, 400:0.9"/></bsdf>')))
        self.assert_fails("bsdf 'diffuse': reflectance 2 is not between 0 and 1", *bad(
            '<shape type="cube"><bsdf type="diffuse"><rgb name="reflectance" value="2"/></bsdf></shape>'))
        self.assert_fails("shape 'cube': colour is not understood here", *bad(
            value("cube", '<float name="colour" value="2"/>')))
        self.assert_fails("nothing has the id 'none'", *bad('<shape type="cube"><ref id="none"/></shape>'))
        self.assert_fails(r"\$size has no value", *bad('<shape type="sphere"><float name="radius" value="$size"/></shape>'))
        self.assert_fails("'two' is not made of numbers", *bad(value("sphere", '<float name="radius" value="two"/>')))
        self.assert_fails("shape 'obj': there is no file a.obj", *bad(
            value("obj", '<string name="filename" value="a.obj"/>')))
        self.assert_fails("is no XML: ", *bad("<shape"))
        self.assert_fails("<scene> says no version", "<scene></scene>")
        self.assert_fails("scene 'scene': has no sensor", scene(shape("cube")))
        self.assert_fails("sensor 'perspective': its to_world mirrors the image", scene(
            LIT.replace("<lookat", '<scale x="-1"/><lookat'), shape("cube")))
        self.assert_fails("integrator 'transient_path': no camera_unwarp", *bad(
            '<integrator type="transient_path"><boolean name="camera_unwarp" value="true"/></integrator>'))
        circle = '<shape type="shapegroup" id="g"><shape type="instance"><ref id="g"/></shape></shape>'
        self.assert_fails(".*in.xml: objects refer to each other in a circle", *bad(
            circle + '<shape type="instance"><ref id="g"/></shape>'))
        self.assert_fails(".*--define: 'x' is not name=value", *bad("", "-D", "x"))
        result = self.run_script(*bad(hair + '<emitter type="envmap"/>', "--skip"))
        self.assertEqual((result.returncode, result.stderr.count("\n")), (0, 2))
        self.assertEqual(len(yaml.safe_load((self.out / "scene.yaml").read_text())["shapes"]), 2)
        self.assertIn("albedo: 0.5", (self.out / "scene.yaml").read_text())

    def test_as_a_user_runs_it(self):
        for text, code in ((scene(LIT, shape("cube")), 0), (scene(LIT, shape("hair")), 2)):
            (self.folder / "my.xml").write_text(text)
            words = [sys.executable, str(SOURCE / "scripts/import_scene.py"), "my.xml"]
            done = subprocess.run(words, cwd=self.folder, capture_output=True, text=True)
            lines = done.stdout.count("\n"), done.stderr.count("\n")
            self.assertEqual((done.returncode, *lines), (code, code == 0, code == 2))
            if code == 0:
                self.assertEqual(done.stdout, "my: scene.yaml, experiment.yaml; OBJ files: 1\n")

    def test_folder_is_whole_or_not_there(self):
        self.out.mkdir()
        (self.out / "mine").write_text("")
        result = self.run_script(scene(LIT, shape("cube")))
        self.assertEqual(result.returncode, 2)
        self.assertRegex(result.stderr, r"out: is there and holds no scene.yaml\n\Z")
        self.assertEqual([path.name for path in self.out.iterdir()], ["mine"])
        (self.out / "mine").rename(self.out / "scene.yaml")
        self.imported(scene(LIT, shape("cube")))
        self.assertEqual(sorted(path.name for path in self.out.iterdir()), ["experiment.yaml", "it.obj", "scene.yaml"])
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ["in.xml", "out"])


if __name__ == "__main__":
    unittest.main()
