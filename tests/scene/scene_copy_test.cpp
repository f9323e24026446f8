#include "core/scene/scene_copy.h"

#include <gtest/gtest.h>

#include "core/base/file.h"
#include "core/scene/scene_loader.h"
#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

const std::string kHead =
    "camera: {position: [0, 0, 5], look_at: [0, 0, 0], fov: 40.25, resolution: [8, 8]}  # a comment\n"
    "materials: {white: {type: diffuse, albedo: 0.1}}\nshapes:\n";

std::string triangle(double size) {
  return "v 0 0 0\nv " + std::to_string(size) + " 0 0\nv 0 1 0\nf 1 2 3\n";
}

void expect_same_scene(const std::string& a, const std::string& b) {
  const Scene x = load_scene(a), y = load_scene(b);
  EXPECT_EQ(x.positions, y.positions);
  EXPECT_EQ(x.camera.fov, y.camera.fov);
  ASSERT_EQ(x.shapes.size(), y.shapes.size());
  for (std::size_t i = 0; i < x.shapes.size(); ++i) EXPECT_EQ(x.shapes[i].name, y.shapes[i].name);
}

std::vector<std::string> put(const std::vector<FileCopy>& copies, const TemporaryFolder& folder) {
  std::vector<std::string> names;
  for (const FileCopy& copy : copies) {
    folder.write(copy.name, copy.contents);
    names.push_back(copy.name);
  }
  return names;
}

TEST(SceneCopy, MeshesBelowTheSceneKeepTheirPlace) {
  TemporaryFolder from, to;
  from.write("a.obj", triangle(1));
  from.write("meshes/a.obj", triangle(2));
  const std::string text = kHead +
                           "  - {name: a, file: ./a.obj, material: white, emission: 1}\n"
                           "  - {name: b, file: meshes/../meshes/a.obj, material: white}\n"
                           "  - {name: c, file: a.obj, material: white, transform: {scale: 0.1}}\n";
  const std::string file = from.write("scene.yaml", text);
  EXPECT_EQ(put(copy_of_scene(file), to), (std::vector<std::string>{"scene.yaml", "a.obj", "meshes/a.obj"}));
  expect_same_scene(file, to.path("scene.yaml"));
}

TEST(SceneCopy, MeshesElsewhereAreBroughtTogether) {
  TemporaryFolder from, to, other;
  other.write("a.obj", triangle(3));
  from.write("x/a.obj", triangle(1));
  from.write("y/a.obj", triangle(2));
  from.write("s/elsewhere/a.obj", triangle(4));
  const std::string file = from.write("s/scene.yaml", kHead +
                                                          "  - {name: a, file: ../x/a.obj, material: white, "
                                                          "emission: 1}\n"
                                                          "  - {name: b, file: ../y/a.obj, material: white}\n"
                                                          "  - {name: c, file: elsewhere/a.obj, material: white}\n"
                                                          "  - {name: d, file: " +
                                                          other.path("a.obj") +
                                                          ", material: white}\n"
                                                          "  - {name: \"7\", file: ../x/a.obj, material: white}\n");
  const std::vector<FileCopy> copies = copy_of_scene(file);
  EXPECT_EQ(put(copies, to), (std::vector<std::string>{"scene.yaml", "elsewhere/a.obj", "elsewhere/a_2.obj",
                                                       "elsewhere/a_3.obj", "elsewhere/a_4.obj"}));
  EXPECT_EQ(copies[0].checksum, checksum(from.read("s/scene.yaml")));
  expect_same_scene(file, to.path("scene.yaml"));
}

TEST(SceneCopy, AMeshMayBeAnotherOne) {
  TemporaryFolder from, to;
  from.write("a.obj", triangle(1));
  from.write("meshes/b.obj", triangle(2));
  const std::string file = from.write(
      "scene.yaml", kHead +
                        "  - {name: a, file: a.obj, material: white, emission: 1, transform: {translate: [1, 2, 3]}}\n"
                        "  - {name: b, file: meshes/b.obj, material: white, transform: {scale: 0.1}}\n");
  const std::string mesh = to.write("new/c.obj", triangle(4));
  const std::string text = scene_with_mesh(file, "a", mesh, to.path("new"));
  const Scene old = load_scene(file), scene = load_scene(to.write("new/scene.yaml", text));
  EXPECT_EQ(scene.camera.fov, old.camera.fov);
  ASSERT_EQ(scene.positions.size(), 6u);
  EXPECT_EQ(scene.positions[1], (Vec3{4, 0, 0})) << "the new mesh is where it is";
  for (int v = 3; v < 6; ++v) EXPECT_EQ(scene.positions[v], old.positions[v]);
}

}  // namespace
}  // namespace isochron
