#include "core/scene/scene_loader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

constexpr char kScene[] = R"(camera:
  position: [0, 0, 5]
  look_at: [0, 0, 0]
  up: [0, 1, 0]
  fov: 40
  resolution: [64, 48]
materials:
  white: {type: diffuse, albedo: 0.6}
  metal: {type: rough_conductor, roughness: 0.2, reflectance: 0.9, two_sided: true}
shapes:
  - {name: floor, file: meshes/quad.obj, material: metal}
  - {name: lamp, file: meshes/triangle.off, material: white, emission: 10}
)";
constexpr char kQuad[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
constexpr char kTriangle[] = "OFF\n3 1 0\n0 0 2\n1 0 2\n0 1 2\n3 0 1 2\n";

/// The first number of a quantity.
double number(const Material& material, const char* quantity) {
  return material.number(material.find(quantity));
}

class SceneLoader : public ::testing::Test {
 protected:
  SceneLoader() {
    folder.write("meshes/quad.obj", kQuad);
    folder.write("meshes/triangle.off", kTriangle);
  }
  /// The scene above with one piece of its text replaced.
  std::string with(const std::string& from, const std::string& to) {
    std::string text = kScene;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    EXPECT_EQ(text.find(from, at + 1), std::string::npos) << "ambiguous: " << from;
    return folder.write("scene.yaml", text.replace(at, from.size(), to));
  }
  /// The message of loading that scene, with the temporary folder cut out.
  std::string error(const std::string& from, const std::string& to) {
    std::string message = error_of([&] { load_scene(with(from, to)); });
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    const std::string prefix = folder.path("");
    for (std::size_t at; (at = message.find(prefix)) != std::string::npos;) message.erase(at, prefix.size());
    return message;
  }

  TemporaryFolder folder;
};

TEST_F(SceneLoader, LoadsEverything) {
  const Scene scene = load_scene(folder.write("scene.yaml", kScene));
  EXPECT_EQ(scene.camera.position, (Vec3{0, 0, 5}));
  EXPECT_EQ(scene.camera.look_at, (Vec3{0, 0, 0}));
  EXPECT_EQ(scene.camera.up, (Vec3{0, 1, 0}));
  EXPECT_EQ(scene.camera.fov, 40);
  EXPECT_EQ(scene.camera.width, 64);
  EXPECT_EQ(scene.camera.height, 48);

  ASSERT_EQ(scene.materials.size(), 2u);
  EXPECT_EQ(scene.find_material("white"), 0);
  EXPECT_EQ(scene.find_material("metal"), 1);
  EXPECT_EQ(scene.find_material("gold"), -1);
  EXPECT_STREQ(scene.materials[0].kind(), "diffuse");
  EXPECT_EQ(number(scene.materials[0], "albedo"), 0.6);
  EXPECT_FALSE(scene.materials[0].bsdf().two_sided());
  EXPECT_STREQ(scene.materials[1].kind(), "rough_conductor");
  EXPECT_EQ(number(scene.materials[1], "reflectance"), 0.9);
  EXPECT_EQ(number(scene.materials[1], "albedo"), 0.9) << "its other name";
  EXPECT_EQ(number(scene.materials[1], "roughness"), 0.2);
  EXPECT_TRUE(scene.materials[1].bsdf().two_sided());
  EXPECT_TRUE(scene.grey);

  ASSERT_EQ(scene.shapes.size(), 2u);
  EXPECT_EQ(scene.find_shape("lamp"), 1);
  EXPECT_EQ(scene.find_shape("sun"), -1);
  const Shape &floor = scene.shapes[0], &lamp = scene.shapes[1];
  EXPECT_EQ(floor.file, folder.path("meshes/quad.obj"));
  EXPECT_EQ(floor.material, 1);
  EXPECT_FALSE(floor.emission.emits());
  EXPECT_EQ(floor.first_vertex, 0);
  EXPECT_EQ(floor.vertex_count, 4);
  EXPECT_EQ(floor.first_triangle, 0);
  EXPECT_EQ(floor.triangle_count, 2);
  EXPECT_EQ(lamp.material, 0);
  EXPECT_EQ(lamp.emission.radiance, Rgb(10));
  EXPECT_EQ(lamp.first_vertex, 4);
  EXPECT_EQ(lamp.vertex_count, 3);
  EXPECT_EQ(lamp.first_triangle, 2);
  EXPECT_EQ(lamp.triangle_count, 1);

  ASSERT_EQ(scene.positions.size(), 7u);
  EXPECT_EQ(scene.positions[2], (Vec3{1, 1, 0}));
  EXPECT_EQ(scene.positions[5], (Vec3{1, 0, 2}));
  ASSERT_EQ(scene.triangles.size(), 3u);
  EXPECT_EQ(scene.triangles[1].vertex, (std::array<int, 3>{0, 2, 3}));
  EXPECT_EQ(scene.triangles[1].shape, 0);
  EXPECT_EQ(scene.triangles[2].vertex, (std::array<int, 3>{4, 5, 6}));
  EXPECT_EQ(scene.triangles[2].shape, 1);

  // Five edges of the quad with its diagonal, three of the triangle; indices are those of the whole scene.
  ASSERT_EQ(scene.edges.size(), 8u);
  int inner = 0;
  for (const Edge& edge : scene.edges) {
    for (const int face : edge.face) {
      if (face < 0) continue;
      const auto& v = scene.triangles[face].vertex;
      for (const int end : edge.vertex) EXPECT_NE(std::find(v.begin(), v.end(), end), v.end());
    }
    inner += edge.face[1] >= 0;
  }
  EXPECT_EQ(inner, 1);
}

TEST_F(SceneLoader, Glass) {
  const std::string white = "white: {type: diffuse, albedo: 0.6}";
  const auto glass = [&](const std::string& keys) {
    return white + "\n  glass: {type: rough_dielectric, " + keys + "}";
  };
  const Material m = load_scene(with(white, glass("roughness: 0.1, ior: 1.4"))).materials[1];
  EXPECT_STREQ(m.kind(), "rough_dielectric");
  EXPECT_EQ(number(m, "roughness"), 0.1);
  EXPECT_EQ(number(m, "ior"), 1.4);
  EXPECT_EQ(error(white, glass("roughness: 0.1")), "scene.yaml:9:10: materials.glass.ior: is missing");
  EXPECT_EQ(error(white, glass("roughness: 0.1, ior: 1")),
            "scene.yaml:9:56: materials.glass.ior: 1 is no boundary (a number above 0 other than 1)");
  EXPECT_EQ(error(white, glass("roughness: 0.1, ior: -1.5")),
            "scene.yaml:9:56: materials.glass.ior: -1.5 is out of range (a number above 0)");
  EXPECT_EQ(error(white, glass("roughness: 0.1, ior: 1.5, two_sided: true")),
            "scene.yaml:9:61: materials.glass.two_sided: belongs to diffuse, rough_conductor, plastic and "
            "retroreflecting, not "
            "to rough_dielectric "
            "(allowed: type, roughness, ior)");
}

TEST_F(SceneLoader, Retroreflector) {
  const std::string white = "white: {type: diffuse, albedo: 0.6}";
  const auto sign = [&](const std::string& keys) { return "white: {type: retroreflecting, " + keys + "}"; };
  const Scene scene = load_scene(with(white, sign("albedo: 0.2, reflectance: [0.8, 0.1, 0], roughness: 0.1")));
  EXPECT_FALSE(scene.grey);
  const Material& m = scene.materials[0];
  EXPECT_STREQ(m.kind(), "retroreflecting");
  EXPECT_EQ(number(m, "albedo"), 0.2);
  EXPECT_EQ(number(m, "reflectance"), 0.8);
  EXPECT_EQ(m.number(m.find("reflectance") + 1), 0.1);
  EXPECT_EQ(number(m, "roughness"), 0.1);
  EXPECT_EQ(error(white, sign("albedo: 0.3, reflectance: 0.8, roughness: 0.1")),
            "scene.yaml:8:60: materials.white.reflectance: albedo and reflectance add up to more than 1 (a sum of at "
            "most 1)");
}

TEST_F(SceneLoader, GlassIsSolid) {
  const std::string white = "white: {type: diffuse, albedo: 0.6}";
  const std::string shape = "shapes:\n  - {name: gem, file: gem.off, material: white";
  const auto message = [&](const std::string& faces, const std::string& more = "") {
    folder.write("gem.off", "OFF\n6 " + std::to_string(faces.size() / 8) +
                                " 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 0\n1 1 -1\n" + faces);
    std::string text = kScene;
    text.replace(text.find(white), white.size(), "white: {type: rough_dielectric, roughness: 0.1, ior: 1.4}");
    text.replace(text.find("material: white, emission"), 15, "material: metal");
    text.replace(text.find("shapes:"), 7, shape + more + "}");
    folder.write("scene.yaml", text);
    std::string found = error_of([&] { load_scene(folder.path("scene.yaml")); });
    for (std::size_t at; (at = found.find(folder.path(""))) != std::string::npos;)
      found.erase(at, folder.path("").size());
    return found;
  };
  EXPECT_EQ(message("3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"), "no error");
  EXPECT_EQ(
      message("3 0 2 1\n3 0 1 3\n3 0 3 2\n"),
      "scene.yaml:11:23: shapes[0].file: gem.off: a transparent material needs a closed surface; this one ends at the "
      "edge from (1, 0, 0) to (0, 1, 0)");
  EXPECT_EQ(
      message("3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 3 2\n"),
      "scene.yaml:11:23: shapes[0].file: gem.off: a transparent material needs a closed surface; the faces of this one "
      "disagree about its outside at the edge from (1, 0, 0) to (0, 1, 0)");
  const std::string beside = "3 4 2 1\n3 4 5 2\n3 4 1 5\n3 2 5 1\n";
  EXPECT_EQ(message("3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n" + beside), "no error") << "two that touch along an edge";
  EXPECT_EQ(
      message("3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n3 4 2 1\n"),
      "scene.yaml:11:23: shapes[0].file: gem.off: a transparent material needs a closed surface; the faces of this one "
      "disagree about its outside at the edge from (1, 0, 0) to (0, 1, 0)")
      << "a wall on its edge";
  EXPECT_EQ(
      message("3 0 2 1\n3 0 1 2\n"),
      "scene.yaml:11:23: shapes[0].file: a transparent material needs a surface that lies nowhere on itself; this one "
      "does at the face of (0, 0, 0)");
  EXPECT_EQ(message("3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n", ", emission: 1"),
            "scene.yaml:11:59: shapes[0].emission: a shape of rough_dielectric emits nothing (leave it out)");
}

TEST_F(SceneLoader, EdgesOfLaterShapesCountOn) {
  const Scene scene = load_scene(with("meshes/triangle.off", "meshes/quad.obj"));
  ASSERT_EQ(scene.edges.size(), 10u);
  for (int shape = 0; shape < 2; ++shape) {
    // The diagonal joins the quad's corners 0 and 2, between its two triangles.
    const auto diagonal = std::count_if(scene.edges.begin(), scene.edges.end(), [&](const Edge& edge) {
      return edge.vertex == std::array{4 * shape, 4 * shape + 2} && edge.face == std::array{2 * shape, 2 * shape + 1};
    });
    EXPECT_EQ(diagonal, 1) << shape;
  }
}

TEST_F(SceneLoader, DirectionsOfAnyLength) {
  for (const std::string length : {"1e-200", "1e200"}) {
    const Scene scene = load_scene(
        with("material: metal}", "material: metal, transform: {rotate: {axis: [0, 0, " + length + "], degrees: 90}}}"));
    EXPECT_LT(isochron::length(scene.positions[1] - Vec3{0, 1, 0}), 1e-15);
    EXPECT_NE(error("up: [0, 1, 0]", "up: [0, 0, " + length + "]").find("up is parallel"), std::string::npos);
  }
}

TEST_F(SceneLoader, ColoursAndDefaults) {
  EXPECT_FALSE(load_scene(with("emission: 10", "emission: [1, 2, 3]")).grey);
  EXPECT_EQ(load_scene(with("emission: 10", "emission: [1, 2, 3]")).shapes[1].emission.radiance, Rgb(1, 2, 3));
  EXPECT_FALSE(load_scene(with("albedo: 0.6", "albedo: [0.5, 0.5, 0.5]")).grey);
  EXPECT_FALSE(load_scene(with("reflectance: 0.9", "reflectance: [1, 0, 0]")).grey);
  EXPECT_EQ(load_scene(with("  up: [0, 1, 0]\n", "")).camera.up, (Vec3{0, 1, 0}));
}

TEST_F(SceneLoader, TransformScalesThenRotatesThenTranslates) {
  // A quarter turn about z takes (x, y) to (-y, x).
  const Scene scene = load_scene(with("material: metal}",
                                      "material: metal, transform: {scale: 2, rotate: {axis: [0, 0, 3], degrees: 90}, "
                                      "translate: [10, 20, 30]}}"));
  const Vec3 expected[] = {{10, 20, 30}, {10, 22, 30}, {8, 22, 30}, {8, 20, 30}};
  for (int v = 0; v < 4; ++v) EXPECT_LT(length(scene.positions[v] - expected[v]), 1e-14) << v;
  EXPECT_EQ(scene.positions[4], (Vec3{0, 0, 2}));

  // A third of a turn about the diagonal takes x to y, y to z, z to x.
  const Scene turned =
      load_scene(with("material: metal}", "material: metal, transform: {rotate: {axis: [1, 1, 1], degrees: 120}}}"));
  EXPECT_LT(length(turned.positions[1] - Vec3{0, 1, 0}), 1e-15);
  EXPECT_LT(length(turned.positions[3] - Vec3{0, 0, 1}), 1e-15);
}

TEST_F(SceneLoader, PathsAreRelativeToTheSceneFile) {
  std::string text = kScene;
  for (std::size_t at; (at = text.find("meshes/")) != std::string::npos;) text.replace(at, 7, "../meshes~");
  for (std::size_t at; (at = text.find('~')) != std::string::npos;) text[at] = '/';
  const Scene scene = load_scene(folder.write("deep/scene.yaml", text));
  EXPECT_EQ(scene.shapes[0].file, folder.path("meshes/quad.obj"));
}

TEST_F(SceneLoader, CameraErrors) {
  EXPECT_EQ(error("fov: 40", "fov: 180"),
            "scene.yaml:5:8: camera.fov: 180 is out of range (a number above 0, below 180)");
  EXPECT_EQ(error("fov: 40", "fov: 0"), "scene.yaml:5:8: camera.fov: 0 is out of range (a number above 0, below 180)");
  EXPECT_EQ(error("fov: 40", "fov: wide"),
            "scene.yaml:5:8: camera.fov: 'wide' is not a finite number (a number above 0, below 180)");
  EXPECT_EQ(error("  fov: 40\n", ""), "scene.yaml:2:3: camera.fov: is missing");
  EXPECT_EQ(error("fov: 40", "fov: 40\n  zoom: 2"),
            "scene.yaml:6:3: camera.zoom: is not a known key (allowed: position, look_at, up, fov, resolution)");
  EXPECT_EQ(error("fov: 40", "fov: 40\n  fov: 41"), "scene.yaml:6:3: camera.fov: is given twice, first on line 5");
  EXPECT_EQ(error("[64, 48]", "[64, 0]"),
            "scene.yaml:6:20: camera.resolution[1]: 0 is out of range (an integer from 1 to 32768)");
  EXPECT_EQ(error("[64, 48]", "[64.5, 48]"),
            "scene.yaml:6:16: camera.resolution[0]: '64.5' is not an integer that fits (an integer from 1 to "
            "32768)");
  EXPECT_EQ(error("[64, 48]", "[64]"), "scene.yaml:6:15: camera.resolution: a list of 1 ([width, height])");
  EXPECT_EQ(error("look_at: [0, 0, 0]", "look_at: [0, 0, 5]"),
            "scene.yaml:3:12: camera.look_at: is the camera's position (a point away from it)");
  for (const std::string far : {"1e200", "1e-200", "1e308"})
    EXPECT_EQ(error("position: [0, 0, 5]\n  look_at: [0, 0, 0]", "position: [0, 0, 0]\n  look_at: [0, 0, " + far + "]"),
              "scene.yaml:3:12: camera.look_at: lies too near the camera's position or too far away (a distance "
              "whose square a double can hold)");
  EXPECT_EQ(error("position: [0, 0, 5]", "position: [0, 0, 2e12]"),
            "scene.yaml:2:13: camera.position: lies too far away (coordinates of at most 1000000000000)");
  EXPECT_EQ(error("emission: 10", "emission: 10, transform: {scale: 1e13}"),
            "scene.yaml:12:87: shapes[1].transform: puts a vertex too far away (coordinates of at most 1000000000000)");
  EXPECT_EQ(error("up: [0, 1, 0]", "up: [0, 0, -3]"),
            "scene.yaml:4:7: camera.up: up is parallel to the line of sight (any other direction)");
  EXPECT_EQ(error("up: [0, 1, 0]", "up: [0, 0, 0]"),
            "scene.yaml:4:7: camera.up: the zero vector has no direction ([x, y, z], not all zero)");
  EXPECT_EQ(error("position: [0, 0, 5]", "position: [0, .nan, 5]"),
            "scene.yaml:2:17: camera.position[1]: '.nan' is not a finite number (a finite number)");
}

TEST_F(SceneLoader, MaterialErrors) {
  EXPECT_EQ(error("albedo: 0.6", "albedo: 1.5"),
            "scene.yaml:8:34: materials.white.albedo: 1.5 is out of range (a number at least 0, at most 1)");
  EXPECT_EQ(error("albedo: 0.6", "albedo: [0, -1, 0]"),
            "scene.yaml:8:38: materials.white.albedo[1]: -1 is out of range (a number at least 0, at most 1)");
  EXPECT_EQ(error("roughness: 0.2", "roughness: 0"),
            "scene.yaml:9:45: materials.metal.roughness: 0 is out of range (a number above 0, at most 1)");
  EXPECT_EQ(error("roughness: 0.2", "roughness: 1.01"),
            "scene.yaml:9:45: materials.metal.roughness: 1.01 is out of range (a number above 0, at most 1)");
  EXPECT_EQ(error(", reflectance: 0.9", ""), "scene.yaml:9:10: materials.metal.reflectance: is missing");
  EXPECT_EQ(error("two_sided: true", "two_sided: 1"),
            "scene.yaml:9:79: materials.metal.two_sided: '1' is neither (true or false)");
  EXPECT_EQ(error("type: diffuse", "type: difuse"),
            "scene.yaml:8:17: materials.white.type: 'difuse' is not known, did you mean 'diffuse'? "
            "(allowed: diffuse, rough_conductor, rough_dielectric, plastic, retroreflecting)");
  EXPECT_EQ(error("albedo: 0.6", "albedo: 0.6, roughness: 0.1"),
            "scene.yaml:8:39: materials.white.roughness: belongs to rough_conductor, rough_dielectric, plastic "
            "and retroreflecting, not to diffuse "
            "(allowed: type, albedo, two_sided)");
  EXPECT_EQ(error("  metal:", "  white:"), "scene.yaml:9:3: materials.white: is given twice, first on line 8");
}

TEST_F(SceneLoader, ShapeErrors) {
  EXPECT_EQ(error("material: metal", "material: metla"),
            "scene.yaml:11:52: shapes[0].material: 'metla' is not known, did you mean 'metal'? (allowed: "
            "white, metal)");
  EXPECT_EQ(error("name: lamp", "name: floor"),
            "scene.yaml:12:12: shapes[1].name: 'floor' is an earlier shape's name (names differ)");
  EXPECT_EQ(error("name: lamp, ", ""), "scene.yaml:12:5: shapes[1].name: is missing");
  EXPECT_EQ(error("emission: 10", "emission: -1"),
            "scene.yaml:12:72: shapes[1].emission: -1 is out of range (a number at least 0)");
  EXPECT_EQ(error("emission: 10", "emision: 10"),
            "scene.yaml:12:62: shapes[1].emision: is not a known key, did you mean 'emission'? "
            "(allowed: name, file, material, emission, transform)");
  EXPECT_EQ(error(", emission: 10", ""),
            "scene.yaml:11:3: shapes: no shape emits light (emission above 0 on at least one, or `lights`)");
  EXPECT_EQ(error("emission: 10", "emission: 0"),
            "scene.yaml:11:3: shapes: no shape emits light (emission above 0 on at least one, or `lights`)");
  EXPECT_EQ(error("emission: 10", "emission: 10, transform: {scale: 0}"),
            "scene.yaml:12:95: shapes[1].transform.scale: 0 is out of range (a number above 0)");
  EXPECT_EQ(error("emission: 10", "emission: 10, transform: {rotate: {axis: [0, 0, 0], degrees: 3}}"),
            "scene.yaml:12:103: shapes[1].transform.rotate.axis: the zero vector has no direction "
            "([x, y, z], not all zero)");
  EXPECT_EQ(error("emission: 10", "emission: 10, transform: {scale: 1e-200}"),
            "scene.yaml:12:87: shapes[1].transform: gives a face whose area vanishes or overflows (sizes "
            "that a double can "
            "hold)");
  EXPECT_EQ(error("emission: 10", "emission: 10, transform: {translate: [1e30, 0, 0]}"),
            "scene.yaml:12:87: shapes[1].transform: gives a face whose area vanishes or overflows (sizes "
            "that a double can "
            "hold)");

  const std::string head = std::string(kScene).substr(0, std::string(kScene).find("shapes:"));
  EXPECT_EQ(error(kScene, head), "scene.yaml:1:1: shapes: is missing");
  EXPECT_EQ(error(kScene, head + "shapes: []\n"), "scene.yaml:10:9: shapes: has no shape (at least one)");
}

TEST_F(SceneLoader, MeshErrorsNameTheShape) {
  const auto mesh = [&](const std::string& name, const std::string& contents) {
    if (!contents.empty()) folder.write("meshes/" + name, contents);
    return error("meshes/quad.obj", "meshes/" + name);
  };
  const std::string at = "scene.yaml:11:25: shapes[0].file: meshes/";
  EXPECT_EQ(mesh("none.obj", ""), at + "none.obj: cannot be opened: No such file or directory");
  EXPECT_EQ(mesh("quad.fbx", "x"), at + "quad.fbx: '.fbx' is not a kind of mesh (allowed: .obj, .ply, .off, .stl)");
  EXPECT_EQ(mesh("empty.obj", "v 0 0 0\n"), at + "empty.obj: has no faces");
  EXPECT_EQ(mesh("huge.obj", "v 0 0 0\nv 1e20 0 0\nv 0 1e20 0\nf 1 2 3\n"),
            "scene.yaml:11:25: shapes[0].file: puts a vertex too far away (coordinates of at most 1000000000000)");
  EXPECT_EQ(mesh("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), at + "flat.obj: has no face with an area");
  EXPECT_EQ(mesh("nan.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n"), at + "nan.obj:2: 'nan' is not a finite number");
  EXPECT_EQ(mesh("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
            at + "index.obj:4: there is no vertex 4 (the file has 3)");
  EXPECT_EQ(mesh("fan.obj", "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nv -1 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"), "no error")
      << "an edge of three faces";
}

TEST_F(SceneLoader, FileErrors) {
  EXPECT_EQ(error_of([&] { load_scene(folder.path("none.yaml")); }),
            folder.path("none.yaml") + ":1:1: file: cannot be opened: No such file or directory");
  EXPECT_EQ(error("materials:\n", "materials: {}\nother:\n"),
            "scene.yaml:7:12: materials: has no material (at least one)");
  EXPECT_EQ(error("shapes:\n", "colour: 3\nshapes:\n"),
            "scene.yaml:10:1: colour: is not a known key (allowed: capture, camera, materials, shapes, lights)");
}

}  // namespace
}  // namespace isochron
