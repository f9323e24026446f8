#!/usr/bin/python3
"""scripts/import_scene.py on what people of this field have: scenes of Mitsuba 0.5, of mitransient and of peers of this project, in
small ones of our own after theirs.

usage: import_field_test.py PROGRAM
"""

import csv
import struct
import subprocess
import unittest
import zlib

import numpy as np
import yaml
from import_scene_test import CAMERA, LIT, PROGRAM, ImportSceneTest, newell, scene, shape

EQUAL_ENERGY = np.array((1.204794, 0.948292, 0.908916))  # of RGB whose white is D65
OLD = """<scene version="0.5.0">
  <integrator type="bdpt"> <integer name="maxDepth" value="4"/> </integrator>
  <sensor type="perspective"> <float name="fov" value="30"/> <string name="fovAxis" value="y"/>
    <float name="nearClip" value="0.1"/>
    <transform name="toWorld"> <lookAt origin="0, 1, 5" target="0, 1, 0" up="0, 1, 0"/> </transform>
    <sampler type="independent"> <integer name="sampleCount" value="64"/> </sampler>
    <film type="ldrfilm"> <integer name="width" value="8"/> <integer name="height" value="4"/>
      <boolean name="banner" value="false"/> <rfilter type="box"/> </film> </sensor>
  <bsdf type="diffuse" id="red"> <spectrum name="reflectance" value="0.5, 0.1, 0.2"/> </bsdf>
  <shape type="cube"> <boolean name="faceNormals" value="true"/> <ref id="red"/>
    <transform name="toWorld"> <scale x="2"/> <translate y="1"/> </transform> </shape>
  <shape type="Rectangle"> <bsdf type="diffuse"> <srgb name="diffuseReflectance" value="#80ff00"/> </bsdf>
    <emitter type="area"> <spectrum name="radiance" value="8"/> </emitter>
    <transform name="toWorld"> <translate z="3"/> </transform> </shape>
</scene>"""


class FieldTest(ImportSceneTest):
    def experiment(self):
        return yaml.safe_load((self.out / "experiment.yaml").read_text())

    def assert_refused(self, message, text, *options):
        """As assert_fails, beside other lines, and where an earlier scene is there."""
        result = self.run_script(text, *options)
        self.assertEqual((result.returncode, result.stdout), (2, ""), message)
        self.assertRegex(result.stderr, rf"(?m)^import_scene\.py: .*/in\.xml:\d+: {message}")

    def material(self, text, *options, version="3.5.0"):
        found = self.imported(scene(LIT, shape("cube", text)).replace("3.5.0", version).replace("to_world", "toWorld" if
                              version < "2" else "to_world"), *options)
        return next(iter(found["materials"].values()))


class DocumentTest(FieldTest):
    def test_scenes_of_before_version_2(self):
        found = self.imported(OLD)
        self.assertEqual(found["camera"]["resolution"], [8, 4])
        self.assertAlmostEqual(found["camera"]["fov"], 2 * np.degrees(np.arctan(2 * np.tan(np.radians(15)))), 6)
        self.assertEqual((found["camera"]["position"], self.experiment()["max_bounces"]), ([0, 1, 5], 3))
        self.assertEqual(found["materials"]["red"]["albedo"], [0.5, 0.1, 0.2])
        srgb = found["materials"]["shape_2_material"]["albedo"]
        np.testing.assert_allclose(srgb, (((128 / 255 + 0.055) / 1.055) ** 2.4, 1, 0), rtol=1e-8)
        self.assertEqual(found["shapes"][1]["emission"], 8)  # one number is white before version 2, and equal energy since
        self.image("--samples", 4)

    def test_folders_of_included_files(self):
        for folder in ("common/meshes", "parts"):
            (self.folder / folder).mkdir(parents=True)
        (self.folder / "common/meshes/floor.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")
        floor = shape("obj", '<string name="filename" value="meshes/floor.obj"/>')
        (self.folder / "parts/floor.xml").write_text(scene(floor))
        path = '<path value="common"/>'
        for part in (floor, '<include filename="parts/floor.xml"/>'):
            self.assertEqual(len(self.imported(scene(path, LIT, part))["shapes"]), 1)
        # A path in an included file is relative to that.
        (self.folder / "parts/floor.xml").write_text(scene('<path value="../common"/>', floor))
        self.imported(scene(LIT, '<include filename="parts/floor.xml"/>'))
        self.assert_refused("shape 'obj': there is no file meshes/floor.obj$", scene(LIT, floor))

    def test_what_nobody_needs_may_lack_a_value(self):
        sampler = '<sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>'
        self.imported(scene(LIT.replace("<film", sampler + "<film"), shape("cube")))
        moving = '<shape type="cube"><animation name="to_world"><transform time="0"/></animation></shape>'
        self.assert_refused("<animation> is not understood$", scene(LIT, moving))
        lacking = shape("sphere", '<float name="radius" value="$r"/>')
        self.assert_refused(r"\$r has no value", scene(LIT, lacking))

    def test_what_is_not_there(self):
        box = '<shape type="cube"><ref id="paint"/></shape>'
        text = scene('<include filename="none.xml"/>', LIT, box)
        self.assert_refused("there is no file none.xml$", text)
        self.assert_refused("nothing has the id 'paint'$", text)
        result = self.run_script(text, "--skip")
        self.assertEqual((result.returncode, result.stderr.count("\n")), (0, 2))
        (self.folder / "a.obj").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
        self.assert_refused("shape 'obj': .*a.obj is a pointer of Git LFS", scene(LIT, shape(
            "obj", '<string name="filename" value="a.obj"/>')))

    def test_depths_of_any_integrator(self):
        depth = '<integer name="max_depth" value="{}"/>'.format

        def bounces(integrator, *options):
            self.imported(scene(integrator, LIT, shape("cube")), *options)
            return self.experiment()["max_bounces"]

        self.assertEqual(bounces(f'<integrator type="ptracer">{depth(5)}</integrator>'), 4)
        self.assertEqual(bounces(f'<integrator type="prb_reparam">{depth(3)}</integrator>'), 2)
        self.assertEqual(bounces(f'<integrator type="volpathAD">{depth(7)}</integrator>'), 6)
        self.assertEqual(bounces('<integrator type="mine"><float name="own" value="1"/></integrator>'), 8)
        self.assertIn("integrator 'mine': its depth alone is taken", self.said)
        inner = f'<integrator type="path">{depth(3)}</integrator>'
        for wrapper in ("stokes", "moment", "aov"):
            aovs = '<string name="aovs" value="dd.y:depth"/>'
            self.assertEqual(bounces(f'<integrator type="{wrapper}">{aovs}{inner}</integrator>'), 2)
        self.assertEqual(bounces('<integrator type="aov"><integrator type="path"/></integrator>', "--max-bounces", 5), 5)
        self.assert_refused("integrator 'path': sees no light", scene(
            f'<integrator type="aov"><integrator type="path">{depth(0)}</integrator></integrator>', LIT, shape("cube")))

    def test_bins_of_peers(self):
        def gates(film):
            self.imported(OLD.replace("<rfilter", film + "<rfilter"))
            return self.experiment()["gates"]

        value = '<{} name="{}" value="{}"/>'.format
        found = gates(value("string", "decomposition", "transient") + value("float", "minBound", 10)
                      + value("float", "maxBound", 16) + value("float", "binWidth", 0.5))
        self.assertEqual(found, {"kind": "bins", "start": 10, "width": 0.5, "count": 12})
        found = gates(value("boolean", "transient", "true") + value("float", "pathMin", 1) + value("float", "pathMax", 2)
                      + value("float", "pathSample", 0.25))
        self.assertEqual(found, {"kind": "bins", "start": 1, "width": 0.25, "count": 4})
        found = gates(value("integer", "duration", 100) + value("float", "tresolution", 20) + value("float", "tstart", 1000)
                      + value("float", "tresolution_light", 20))
        pulse = {"offsets": [0, 5.99584916], "values": [1, 1]}
        self.assertEqual(found, {"kind": "bins", "start": 299.792458, "width": 5.99584916, "count": 100, "response": pulse})
        self.assertNotIn("near", self.said)  # these count from the pinhole
        self.assertEqual(gates(""), {"kind": "steady"})


class MaterialsTest(FieldTest):
    def test_spectra(self):
        def diffuse(spectrum, version="3.5.0"):
            return self.material(f'<bsdf type="diffuse">{spectrum}</bsdf>', version=version)["albedo"]

        value = '<spectrum name="reflectance" value="{}"/>'.format
        self.assertEqual(diffuse(value("400:0.3, 550:0.3 700:0.3")), 0.3)
        self.assertEqual(diffuse(value("0.3")), 0.3)
        red = diffuse(value("360:0.05, 600:0.05, 610:0.95, 830:0.95"))
        self.assertGreater(red[0], 0.5)
        self.assertLess(max(red[1:]), 0.1)
        # Green as it is seen: of x and y 0.27 and 0.60 without light beyond 500 to 570 nm.
        green = diffuse(value("499:0, 500:1, 570:1, 571:0"))
        self.assertEqual((green[0], green[2], max(green)), (0, 0, green[1]))

        def emission(text):
            lamp = f'<emitter type="area">{text}</emitter>'
            return np.array(self.imported(scene(CAMERA, shape("rectangle", lamp)))["shapes"][0]["emission"])

        flat = emission('<spectrum name="radiance" value="360:2, 830:2"/>')
        np.testing.assert_allclose(flat, 2 * EQUAL_ENERGY, rtol=1e-5)
        nearly = emission('<spectrum name="radiance" value="360:2, 830:2.0001"/>')
        np.testing.assert_allclose(nearly, 2 * EQUAL_ENERGY, rtol=1e-3)
        # A black body of 6504 K is nearly D65's white, one of 2856 K is illuminant A: x = 0.44757, y = 0.40745.
        day = emission('<blackbody name="radiance" temperature="6504K"/>')
        np.testing.assert_allclose(day / day.mean(), 1, atol=0.05)
        lamp = emission('<blackbody name="radiance" temperature="2856" scale="2"/>')
        xyz = np.linalg.solve([[3.2405, -1.5371, -0.4985], [-0.9693, 1.8760, 0.0416], [0.0556, -0.2040, 1.0573]], lamp)
        np.testing.assert_allclose(xyz[:2] / xyz.sum(), (0.44757, 0.40745), atol=0.005)
        # Its radiance at 560 nm, in W / (m^2 sr nm), is 1.05 times its luminance: it rises towards the red.
        self.assertAlmostEqual(xyz[1] / (2 * 1.191043e-16 / 5.6e-7**5 / np.expm1(0.01438777 / 5.6e-7 / 2856) * 1e-9), 1.0,
                               delta=0.08)

    def test_plastic(self):
        found = self.material('<bsdf type="plastic"/>')
        # The base that is as bright as Mitsuba's, whose light is reflected inside as if it were white: by Walsh's closed form.
        n = 1.49 / 1.000277
        outside = (0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2) +
                   n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * np.log((n - 1) / (n + 1)) -
                   2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1)) +
                   8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * np.log(n))
        inside = 1 - (1 - outside) / n**2
        albedo = found.pop("albedo")
        self.assertAlmostEqual(albedo / (1 - albedo * inside), 0.5 / (1 - inside), delta=1e-6)
        self.assertEqual(found, {"type": "plastic", "roughness": 0.05, "ior": round(n, 8), "reflectance": 1})
        self.assertIn("no smooth surfaces here; with the roughness 0.05 (--smooth)", self.said)
        rough = self.material("""<bsdf type="twosided"><bsdf type="roughplastic"><float name="alpha" value="0.2"/>
          <string name="distribution" value="ggx"/><rgb name="diffuse_reflectance" value="0.1 0.2 0.3"/>
          <float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/><boolean name="nonlinear" value="true"/>
          <float name="specular_reflectance" value="0.5"/></bsdf></bsdf>""")
        self.assertEqual(rough, {"type": "plastic", "albedo": [0.1, 0.2, 0.3], "roughness": 0.2, "ior": 1.5,
                                 "reflectance": 0.5, "two_sided": True})
        self.assert_refused("bsdf 'plastic': int_ior 1 and ext_ior 1.00028 make no coat", scene(LIT, shape(
            "cube", '<bsdf type="plastic"><float name="int_ior" value="1"/></bsdf>')))

    def test_phong_is_as_wide_as_plastic(self):
        phong = """<bsdf type="phong"><spectrum name="diffuseReflectance" value="{}"/>
          <spectrum name="specularReflectance" value="0.1, 0.2, 0.05"/><float name="exponent" value="{}"/></bsdf>""".format
        for exponent in (2, 30, 1000):
            found = self.material(phong("0.3, 0.3, 0.3", exponent), version="0.6.0")
            alpha, tilt = found["roughness"], np.linspace(0, np.pi / 3, 100001)
            density = alpha**2 / np.pi / (np.cos(tilt)**2 * (alpha**2 - 1) + 1)**2
            half_width = 2 * tilt[np.argmax(density < 0.5 * density[0])]  # a facet turns light by twice its tilt
            self.assertAlmostEqual(np.cos(half_width)**exponent, 0.5, delta=1e-3 * exponent)
            self.assertEqual((found["type"], found["albedo"], found["reflectance"]), ("plastic", 0.3, [0.5, 1, 0.25]))
            self.assertAlmostEqual(((found["ior"] - 1) / (found["ior"] + 1))**2, 0.2, 6)
        self.assertIn("plastic of the same width of its lobe", self.said)
        self.assertEqual(self.material(phong("0, 0, 0", 30), version="0.6.0")["type"], "rough_conductor")
        # A coat reflects a half at most: beyond that whichever loses less.
        for diffuse, kind in ((0.1, "rough_conductor"), (0.4, "plastic")):
            strong = phong(f"{diffuse}, {diffuse}, {diffuse}", 30).replace("0.1, 0.2, 0.05", "0.3, 0.8, 0.4")
            found = self.material(strong, version="0.6.0")
            self.assertEqual(found["type"], kind)
            self.assertEqual("without its diffuse part of 0.1" in self.said, kind == "rough_conductor")
        self.assertEqual(found["reflectance"], [0.375, 1, 0.5])

    def test_principled(self):
        def material(**values):
            inside = "".join(f'<float name="{name}" value="{value}"/>' for name, value in values.items())
            return self.material(f'<bsdf type="principled"><rgb name="base_color" value="0.2 0.4 0.6"/>{inside}</bsdf>')

        plastic = {"type": "plastic", "albedo": [0.2, 0.4, 0.6], "roughness": 0.25, "reflectance": 1}
        found = material(sheen=0.5, anisotropic=0)
        self.assertAlmostEqual(found.pop("ior"), 1.5)
        self.assertEqual(found, plastic)
        self.assertIn("bsdf 'principled': plastic of the roughness 0.25, without sheen\n", self.said)
        self.assertEqual(material(metallic=0.9, roughness=0.6),
                         {"type": "rough_conductor", "roughness": 0.36, "reflectance": [0.2, 0.4, 0.6]})
        self.assertEqual(material(spec_trans=1, eta=1.3), {"type": "rough_dielectric", "roughness": 0.25, "ior": 1.3})

    def test_coated_materials_are_rendered(self):
        """What the base adds to the gloss is proportional to its reflectance, unless `nonlinear` says otherwise."""
        def mean(reflectance, nonlinear):
            self.material(f"""<bsdf type="twosided"><bsdf type="roughplastic"><float name="alpha" value="0.3"/>
              <float name="diffuse_reflectance" value="{reflectance}"/> <boolean name="nonlinear" value="{nonlinear}"/>
              </bsdf></bsdf>""")
            return self.image("--samples", 64).mean()

        for nonlinear, least, most in (("false", 1.98, 2.02), ("true", 2.3, 4)):
            dark, grey, bright = (mean(reflectance, nonlinear) for reflectance in (0, 0.4, 0.8))
            self.assertGreater(dark, 0)
            self.assertTrue(least < (bright - dark) / (grey - dark) < most)

    def test_what_lies_about_a_material(self):
        covered = shape("cube", """<bsdf type="mask"><float name="opacity" value="0.5"/>
          <bsdf type="diffuse"><float name="reflectance" value="0.3"/></bsdf></bsdf>""")
        message = r"bsdf 'mask': no such material here \(--skip takes the bsdf 'diffuse' inside\)"
        self.assert_fails(message, scene(LIT, covered))
        result = self.run_script(scene(LIT, covered), "--skip")
        self.assertEqual(result.returncode, 0)
        self.assertIn("albedo: 0.3}", (self.out / "scene.yaml").read_text())


class LightsTest(FieldTest):
    def test_an_emitter_by_its_id(self):
        lamp = '<emitter type="area" id="lamp"><rgb name="radiance" value="1 2 3"/></emitter>'
        found = self.imported(scene(CAMERA, lamp, shape("rectangle", '<ref id="lamp"/>')))
        self.assertEqual((found["shapes"][0]["emission"], "lights" in found), ([1, 2, 3], False))
        self.imported(scene(LIT, lamp, shape("cube")))
        self.assertIn("emitter 'area': lights nothing, no shape refers to it", self.said)

    def test_pure_colours(self):
        for rgb in ("1 0 0", "0, 0, 0.5"):
            spot = f"""<emitter type="spot"><rgb name="intensity" value="{rgb}"/><transform name="to_world">
              <lookat origin="0 0 4" target="0 0 0" up="0 1 0"/></transform></emitter>"""
            light = self.imported(scene(CAMERA, spot, shape("cube")))["lights"][0]
            self.assertEqual(light["intensity"], [float(x) for x in rgb.replace(",", " ").split()])
            image = self.image("--samples", 16).sum(axis=(0, 1, 2))
            np.testing.assert_array_equal(image > 0, np.array(light["intensity"]) > 0)
        # Derivatives of the mean image by the lamp's place add up over its colours, too.
        text = (self.out / "scene.yaml").read_text().replace("[0, 0, 0.5]", "$intensity")
        unknown = "parameters: [{name: z, type: translation, light: light_1, direction: [0, 0, 1], initial: 0}]\n"
        with (self.out / "experiment.yaml").open("a") as file:
            file.write(unknown)
        values = []
        for intensity in ("[2, 0, 0]", "[0, 2, 0]", "[0, 0, 2]", "2"):
            (self.out / "scene.yaml").write_text(text.replace("$intensity", intensity))
            words = [PROGRAM, "derive", self.out / "experiment.yaml", "-o", self.out / "d", "--quiet", "--no-plots"]
            subprocess.run(list(map(str, words)), check=True)
            with (self.out / "d/derive.csv").open() as file:
                values.append(next(float(row["mean"]) for row in csv.DictReader(file) if row["component"] == "total"))
        self.assertNotEqual(values[3], 0)
        self.assertIn(round(sum(values[:3]) / values[3], 4), (1, 3))  # three: a grey image has one channel
        dark = '<emitter type="point"><rgb name="intensity" value="0"/></emitter>'
        self.assert_refused("emitter 'point': intensity 0 is not above 0", scene(CAMERA, dark, shape("cube")))

    def test_light_from_all_around_is_left_out(self):
        text = scene(CAMERA, '<emitter type="constant"/>', shape("cube"))
        self.assert_fails(r"emitter 'constant': no light from all around here: .* \(--skip leaves it out\)", text)
        result = self.run_script(text, "--skip")
        self.assertEqual(result.returncode, 0)
        self.assertRegex(result.stdout, "scene 'scene': nothing lights it\n")


class ShapesTest(FieldTest):
    def serialized(self, version, kind, normals):
        """Two meshes, of which the second is a triangle in the plane z = 1."""
        meshes = []
        for height in (0, 1):
            points = np.array([(0, 0, height), (2, 0, height), (0, 1, height)], kind)
            flags = (0x1000 if kind == "<f4" else 0x2000) | (0x1 if normals else 0) | 0x2
            body = struct.pack("<I", flags) + (b"name\0" if version == 4 else b"") + struct.pack("<QQ", 3, 1)
            body += points.tobytes() + (np.tile(np.array((0, 0, -1), kind), 3).tobytes() if normals else b"")
            body += np.zeros((3, 2), kind).tobytes() + np.array((0, 1, 2), "<u4").tobytes()
            meshes.append(struct.pack("<HH", 0x041C, version) + zlib.compress(body))
        starts = struct.pack("<QQ" if version == 4 else "<II", 0, len(meshes[0]))
        return b"".join(meshes) + starts + struct.pack("<I", 2)

    def test_serialized_meshes(self):
        inside = '<string name="filename" value="a.serialized"/><integer name="shape_index" value="{}"/>'.format
        for version, kind, normals in ((3, "<f4", False), (4, "<f8", True)):
            (self.folder / "a.serialized").write_bytes(self.serialized(version, kind, normals))
            points, faces = self.mesh(shape("serialized", inside(1)))
            np.testing.assert_allclose(points, [(0, 0, 1), (2, 0, 1), (0, 1, 1)])
            np.testing.assert_allclose(newell(points, faces[0]), (0, 0, -1 if normals else 1))
        text = scene(LIT, shape("serialized", inside(2)))
        self.assert_refused("/.*a.serialized: shape_index 2 of 2 meshes$", text)
        whole = (self.folder / "a.serialized").read_bytes()
        for damaged in (whole[:30], whole[:8] + bytes(20) + whole[28:], b"", whole[:-4] + b"\xff\xff\xff\x7f"):
            (self.folder / "a.serialized").write_bytes(damaged)
            self.assert_refused("/.*a.serialized: is damaged$", text.replace('value="2"', 'value="0"'))

    def test_media_and_what_they_are_in(self):
        inside = '<medium type="homogeneous" name="interior"/>'
        fog, dull = shape("cube", inside + '<bsdf type="null"/>'), shape("cube", inside)
        result = self.run_script(scene(LIT, fog, dull.replace("it", "other"), '<medium type="homogeneous" id="m"/>'), "--skip")
        self.assertEqual(result.returncode, 0)
        self.assertIn("no media", result.stderr)
        self.assertEqual(len(yaml.safe_load((self.out / "scene.yaml").read_text())["shapes"]), 1)

    def test_nothing_left_is_an_error(self):
        self.assert_refused("scene 'scene': has no shape that could be turned$", scene(LIT, shape("hair")), "--skip")
        self.assert_fails("scene 'scene': has no shape that could be turned", scene(LIT))

    def test_cameras(self):
        scaled = LIT.replace("<lookat", '<scale value="3"/><lookat')
        self.assertEqual(self.imported(scene(scaled, shape("cube")))["camera"]["look_at"], [0, 0, 4])
        lens = LIT.replace('"perspective">', '"thinlens"> <float name="aperture_radius" value="0.1"/>')
        self.assert_refused("sensor 'thinlens': cameras are pinholes here", scene(lens, shape("cube")))


class CapturesTest(FieldTest):
    """After mitransient's two examples: a camera that looks at a wall and beyond its border, beside other walls."""

    TEXT = """<integrator type="transient_nlos_path"> <boolean name="nlos_laser_sampling" value="true"/>
        <boolean name="nlos_hidden_geometry_sampling" value="true"/> <integer name="capture_type" value="1"/>
        <boolean name="account_first_and_last_bounces" value="False"/> </integrator>
      <sensor type="perspective"> <float name="fov" value="90"/>
        <transform name="to_world"> <lookat origin="0 0 1" target="0 0 0" up="0 1 0"/> </transform>
        <film type="transient_hdr_film"> <integer name="width" value="8"/> <integer name="height" value="4"/>
          <integer name="temporal_bins" value="30"/> <float name="bin_width_opl" value="0.1"/>
          <float name="start_opl" value="9.5"/> <rfilter type="box"/> </film> </sensor>
      <emitter type="projector"> <rgb name="irradiance" value="100"/> <float name="fov" value="0.2"/>
        <transform name="to_world"> <lookat origin="0 0 1" target="0 0 0" up="0 1 0"/> </transform> </emitter>""" + shape(
            "rectangle", "", '<scale x="0.6"/>').replace('"it"', '"wall"') + shape(
            "rectangle", "", '<scale value="0.1"/><rotate y="1" angle="180"/> <translate x="0.5" y="5" z="2"/>')

    def test_pixels_beside_the_wall_are_masked(self):
        side = shape("rectangle", '<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>',
                     '<scale y="9"/><rotate y="1" angle="90"/><translate x="0.8"/>').replace('"it"', '"side"')
        for parts in ((), (side,)):
            capture = self.imported(scene(self.TEXT, *parts))["capture"]
            # Its pixels' middles are 0.25 apart on the wall, from x = -0.875 on; it ends at 0.6.
            mask, points = np.load(self.out / "mask.npy"), np.array(capture["sensor"]["points"])
            self.assertEqual(mask.shape, (32, 1))
            seen = mask.reshape(4, 8)
            np.testing.assert_array_equal(seen, np.tile([0, 0, 1, 1, 1, 1, 0, 0], (4, 1)))
            self.assertIn("16 of its 32 pixels do not see the wall, wall: mask.npy masks them", self.said)
            x = points[:, 0].reshape(4, 8)
            np.testing.assert_allclose(x, np.tile([-3, -3, -3, -1, 1, 3, 3, 3], (4, 1)) / 8, atol=1e-9)
            self.assertEqual(np.abs(points[:, 2]).max(), 0)
            self.assertEqual(capture["laser"]["points"], [[0, 0, 0]])

    def test_the_mask_serves_a_target(self):
        self.imported(scene(self.TEXT))
        self.rendered("--samples", 16)
        text = (self.out / "experiment.yaml").read_text()
        (self.out / "experiment.yaml").write_text(text + """target: {capture: r/render.h5, mask: mask.npy}
parameters: [{name: z, type: translation, shape: it, direction: [0, 0, 1], initial: 0}]
optimizer: {method: levenberg_marquardt, iterations: 1}
""")
        words = [PROGRAM, "run", self.out / "experiment.yaml", "-o", self.folder / "run", "--quiet", "--no-plots"]
        done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
