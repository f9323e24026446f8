#include "core/scene/mesh_writer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/scene/mesh.h"
#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

/// Two shapes, of which the second is looked at; its coordinates have more digits than a float.
Scene two_shapes() {
  Scene scene;
  scene.positions = {{9, 9, 9}, {0.1, 1.0 / 3, -2e-7}, {1, 0, 0}, {0, 1e5 + 1e-9, 0}, {1, 1, 0}};
  scene.triangles = {{{0, 0, 0}, 0}, {{1, 2, 3}, 1}, {{2, 4, 3}, 1}};
  scene.shapes.resize(2);
  scene.shapes[1].first_vertex = 1, scene.shapes[1].vertex_count = 4;
  scene.shapes[1].first_triangle = 1, scene.shapes[1].triangle_count = 2;
  return scene;
}

TEST(MeshWriter, BothKindsAreReadBackInTheSameOrder) {
  const Scene scene = two_shapes();
  TemporaryFolder folder;
  folder.write("m.ply", to_ply(scene, scene.shapes[1]));
  folder.write("m.obj", to_obj(scene, scene.shapes[1]));
  for (const char* name : {"m.ply", "m.obj"}) {
    const Mesh mesh = read_mesh(folder.path(name));
    ASSERT_EQ(mesh.positions.size(), 4u) << name;
    for (int v = 0; v < 4; ++v) EXPECT_EQ(mesh.positions[v], scene.positions[v + 1]);
    EXPECT_EQ(mesh.faces, (std::vector<std::array<int, 3>>{{0, 1, 2}, {1, 3, 2}})) << name;
  }
}

TEST(MeshWriter, VerticesAreThoseOfTheFileThatWasRead) {
  // In the file: one without a face, the second of the shape, its first, the second again, the others.
  Scene scene = two_shapes();
  scene.shapes[1].file_vertices = std::make_shared<const FileVertices>(FileVertices{{-1, 1, 0, 1, 2, 3}, {{7, 7, 7}}});
  const std::vector<Vec3>& p = scene.positions;
  TemporaryFolder folder;
  folder.write("m.ply", to_ply(scene, scene.shapes[1]));
  folder.write("m.obj", to_obj(scene, scene.shapes[1]));
  for (const char* name : {"m.ply", "m.obj"}) {
    const Mesh mesh = read_mesh(folder.path(name));
    EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{7, 7, 7}, p[2], p[1], p[2], p[3], p[4]})) << name;
    EXPECT_EQ(mesh.faces, (std::vector<std::array<int, 3>>{{2, 1, 4}, {1, 5, 4}})) << name;
  }
}

/// Numbers of vertices are those of the file, and what has no face has no property.
TEST(MeshWriter, PropertiesAreThoseOfTheFilesVertices) {
  Scene scene = two_shapes();
  scene.shapes[1].file_vertices = std::make_shared<const FileVertices>(FileVertices{{-1, 1, 0, 1, 2, 3}, {{7, 7, 7}}});
  const VertexProperty properties[] = {{"albedo", {0.5, 1.0 / 3, 2, 3}}, {"other", {10, 11, 12, 13}}};
  const std::string ply = to_ply(scene, scene.shapes[1], properties);
  EXPECT_NE(ply.find("property double z\nproperty double albedo\nproperty double other\nelement face"),
            std::string::npos);
  const std::vector<double> albedo{NAN, 1.0 / 3, 0.5, 1.0 / 3, 2, 3}, other{NAN, 11, 10, 11, 12, 13};
  for (std::size_t i = 0; i < albedo.size(); ++i) {
    double row[5];
    std::memcpy(row, ply.data() + ply.find("end_header\n") + 11 + i * sizeof row, sizeof row);
    EXPECT_TRUE(row[3] == albedo[i] || (std::isnan(row[3]) && i == 0)) << i;
    EXPECT_TRUE(row[4] == other[i] || (std::isnan(row[4]) && i == 0)) << i;
  }
}

TEST(MeshWriter, FilesHoldEveryDigit) {
  const Scene scene = two_shapes();
  const std::string ply = to_ply(scene, scene.shapes[1]), obj = to_obj(scene, scene.shapes[1]);
  double value = 0;
  std::memcpy(&value, ply.data() + ply.find("end_header\n") + 11 + sizeof value, sizeof value);
  EXPECT_EQ(value, 1.0 / 3);
  EXPECT_EQ(obj.substr(0, obj.find('\n')), "v 0.1 0.3333333333333333 -2e-07");
}

}  // namespace
}  // namespace isochron
