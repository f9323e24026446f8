// Meshes as other people's programs write them. Files of reported faults lie in tests/data/field.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include "core/scene/polygon.h"
#include "core/scene/scene_loader.h"
#include "tests/scene/cube_mesh.h"
#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

const std::string kField = PROJECT_ROOT "/tests/data/field/";

double area(const Mesh& mesh) {
  double sum = 0;
  for (const Face& f : mesh.faces) {
    const Vec3& a = mesh.positions[f[0]];
    sum += length(cross(mesh.positions[f[1]] - a, mesh.positions[f[2]] - a)) / 2;
  }
  return sum;
}

/// How often each side is one of a triangle, whatever its direction.
std::map<std::pair<int, int>, int> sides_of(const Mesh& mesh) {
  std::map<std::pair<int, int>, int> sides;
  for (const Face& f : mesh.faces)
    for (int i = 0; i < 3; ++i) ++sides[std::minmax(f[i], f[(i + 1) % 3])];
  return sides;
}

class FieldMesh : public ::testing::Test {
 protected:
  Mesh read(const std::string& name, const std::string& contents) { return read_mesh(folder_.write(name, contents)); }
  std::string error(const std::string& name, const std::string& contents) {
    const std::string message = error_of([&] { read(name, contents); });
    return message.starts_with(folder_.path("")) ? message.substr(folder_.path("").size()) : message;
  }
  TemporaryFolder folder_;
};

/// A cube's text with other ends of lines.
std::string with_ends(std::string text, const std::string& end) {
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += end.size()) text.replace(at, 1, end);
  return text;
}

std::string cube_points(const std::string& before) {
  std::string text;
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = cube_corner(i);
    text += fmt::format("{}{} {} {}\n", before, p.x, p.y, p.z);
  }
  return text;
}

std::string cube_quads(const std::string& before, int first) {
  std::string text;
  for (const auto& q : kCube)
    text += fmt::format("{} {} {} {} {}\n", before, q[0] + first, q[1] + first, q[2] + first, q[3] + first);
  return text;
}

std::string obj() {
  return cube_points("v ") + cube_quads("f", 1);
}

std::string off(const std::string& header) {
  return header + cube_points("") + cube_quads("4", 0);
}

TEST_F(FieldMesh, ReportedFilesAreTheUnitCube) {
  for (const char* name : {"bom_vertex_silent.obj", "bom.ply", "continued_lines.obj", "cr.obj", "glued.off",
                           "same_line.off", "lower.off", "upper.stl", "bin_trailing.stl"}) {
    SCOPED_TRACE(name);
    const Mesh mesh = read_mesh(kField + "meshes/" + name);
    expect_cube(mesh);
    EXPECT_NEAR(area(mesh), 6, 1e-12);
  }
  EXPECT_EQ(read_mesh(kField + "meshes/bom_vertex_silent.obj").positions.size(), 9u);
}

TEST_F(FieldMesh, LinesEndAsAnySystemEndsThem) {
  for (const std::string end : {"\n", "\r", "\r\n"})
    for (const std::string mark : {"", "\xEF\xBB\xBF"}) {
      expect_cube(read("m.obj", mark + with_ends(obj(), end)));
      expect_cube(read("m.off", mark + with_ends(off("OFF\n8 6 12\n"), end)));
      EXPECT_EQ(error("m.obj", mark + with_ends("v 0 0 0\n\nv 1 x 0\n", end)), "m.obj:3: 'x' is not a finite number");
    }
  // Two files that were joined, each with a mark.
  expect_cube(read("m.obj", "\xEF\xBB\xBF" + cube_points("v ") + "\xEF\xBB\xBF" + cube_quads("f", 1)));
  EXPECT_EQ(error("m.obj", std::string("\xFF\xFEv\0 \0", 6)), "m.obj: is text in UTF-16 (allowed: UTF-8)");
}

TEST_F(FieldMesh, LinesOfObjGoOnBehindABackslash) {
  const std::vector<Face> two{{0, 1, 2}, {0, 2, 3}};
  const std::string points = "v 0 0 \\\r\n 0\r\nv 1\\\n0 0\nv 1 1 0\nv 0 1 0\n";
  EXPECT_EQ(read("m.obj", points + "f 1 2 \\  \n \\\n3 4\\").faces, two);
  // A comment does not, nor what a comment's end leaves.
  EXPECT_EQ(read("m.obj", "# C:\\meshes\\\n" + points + "usemtl a\\b\nf 1 2 3 4 # \\\n").faces, two);
  EXPECT_EQ(error("m.obj", points + "f 1 2 \\\n 3 9\nf 1 2 3\n"), "m.obj:7: there is no vertex 9 (the file has 4)");
}

TEST_F(FieldMesh, BinaryPlyBeginsBehindItsHeaderWhateverTheEndsOfLines) {
  for (const std::string end : {"\n", "\r", "\r\n"})
    for (const unsigned char first : {'\n', '\r', ' '}) {  // the first byte of the data, of a number behind the point
      const std::string header = with_ends(
          "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
          "property double z\nelement face 1\nproperty list uint uint vertex_indices\nend_header\n",
          end);
      std::array<double, 9> numbers{1, 0, 0, 0, 1, 0, 0, 0, 1};
      std::memcpy(numbers.data(), &first, 1);
      const std::array<std::uint32_t, 4> face{3, 0, 1, 2};
      std::string bytes = header;
      bytes.append(reinterpret_cast<const char*>(numbers.data()), sizeof numbers);
      bytes.append(reinterpret_cast<const char*>(face.data()), sizeof face);
      const Mesh mesh = read("m.ply", bytes);
      EXPECT_EQ(mesh.positions[0].x, numbers[0]);
      EXPECT_EQ(mesh.positions[2], (Vec3{0, 0, 1}));
      EXPECT_EQ(mesh.faces, (std::vector<Face>{{0, 1, 2}}));
    }
}

TEST_F(FieldMesh, HeadersOfOff) {
  for (const char* header :
       {"OFF\n8 6 12\n", "OFF 8 6 12\n", "OFF8 6 12\n", "off\n8 6\n", "# a\nOFF # b\n# c\n\n8 6 12 # d\n",
        "COFF8 6 0\n", "cnoff 8 6 0\n", "STCNOFF\n8 6 0\n", "8 6 12\n", "\t OFF \t\n 8\t6\t12 \n"})
    expect_cube(read("m.off", off(header)));
  EXPECT_EQ(error("m.off", off("4OFF\n8 6 0\n")), "m.off:1: '4OFF' (only three dimensions are read)");
  EXPECT_EQ(error("m.off", off("nOFF\n3\n8 6 0\n")), "m.off:1: 'nOFF' (only three dimensions are read)");
  EXPECT_EQ(error("m.off", off("OFFICE 8 6 0\n")), "m.off:1: does not begin with OFF");
  EXPECT_EQ(error("m.off", off("OFF many\n8 6 0\n")), "m.off:1: 'many' is not an integer");
}

std::string facet(const std::array<const char*, 3>& ends) {
  return fmt::format("facet normal 0 0 1 {}vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n{}\n{}\n", ends[0], ends[1],
                     ends[2]);
}

TEST_F(FieldMesh, WordsOfTextStl) {
  const std::vector<Face> one{{0, 1, 2}};
  for (const auto& ends :
       {std::array{"\nouter loop\n", "endloop", "endfacet"}, std::array{"outer loop ", "end loop", "end facet"},
        std::array{"\nOuter Loop\n", "", "EndFacet"}})
    for (const char* name : {"", " vertex of a facet", " a\nsolid a"})
      EXPECT_EQ(read("m.stl", fmt::format("Solid{}\n{}endsolid{}\n", name, facet(ends), name)).faces, one);
  EXPECT_EQ(read("m.stl", "solid a\nfacet outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet").faces,
            one);
  EXPECT_EQ(read("m.stl", "solid a\n" + facet({"", "endloop", "endfacet"}) + "endsolid\nsolid b\n" +
                              facet({"", "endloop", "endfacet"}) + "end solid")
                .faces.size(),
            2u);
}

TEST_F(FieldMesh, BytesBehindBinaryStl) {
  std::string bytes(80, ' ');
  bytes.replace(0, 5, "solid");
  bytes += std::string("\1\0\0\0", 4) + std::string(12, '\0');
  for (const float x : {0, 0, 0, 1, 0, 0, 0, 1, 0}) bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  bytes += std::string(2, '\0');
  for (const std::string& behind : {std::string(), std::string("\n"), std::string(512, '\0')})
    EXPECT_EQ(read("m.stl", bytes + behind).faces.size(), 1u);
  EXPECT_EQ(error("m.stl", bytes + bytes), "m.stl: 134 bytes follow the 1 facets that its header states");
  EXPECT_EQ(error("m.stl", bytes.substr(0, 120)),
            "m.stl:1: is neither text STL nor binary STL of the size its header states");
}

TEST_F(FieldMesh, OldAndOddWordsOfObj) {
  const std::vector<Face> two{{0, 1, 2}, {0, 2, 3}};
  const std::string points = "v\t0 0 0 \nv 1 0 0\t\n  v 1 1 0 1.0\nv 0 1 0\f\n";
  EXPECT_EQ(read("m.obj", points + "fo 1//2 2//2 3//1 4//1\n").faces, two);
  EXPECT_EQ(read("m.obj", points + "f -4/1/ -3/1/ -2/1/ -1/\n").faces, two);
  EXPECT_EQ(read("m.obj", points + "f 1 2 3 4 1\n").faces, two);  // goes back to where it began
}

TEST_F(FieldMesh, CoordinatesKeepTheirDigits) {
  const Mesh roof = read_mesh(kField + "georeferenced/roof.obj");
  EXPECT_EQ(clean_mesh(roof).positions.size(), 25u);
  EXPECT_EQ(clean_mesh(roof).faces.size(), 32u);
  EXPECT_EQ(roof.positions[1], (Vec3{437250.375, 5418300.375, 212.5499}));
  const Scene far = load_scene(kField + "georeferenced/scene.yaml");
  const Scene near = load_scene(kField + "georeferenced/scene_local.yaml");
  ASSERT_EQ(far.positions.size(), near.positions.size());
  for (std::size_t v = 0; v < near.positions.size(); ++v)
    EXPECT_LT(length(far.positions[v] - near.positions[v]), 2e-9) << v;  // two roundings of 5e6
}

TEST_F(FieldMesh, SurveysThatAreNotBroughtBackAreRefused) {
  folder_.write("wall.obj", "v 437250 5418300 0\nv 437251 5418300 0\nv 437251 5418300 1\nf 1 2 3\n");
  const std::string scene =
      folder_.write("scene.yaml",
                    "camera: {position: [437250, 5418298, 0], look_at: [437250, 5418300, 0], up: [0, 0, 1], fov: 4, "
                    "resolution: [2, 2]}\n"
                    "materials: {w: {type: diffuse, albedo: 0.5}}\n"
                    "shapes: [{name: wall, file: wall.obj, material: w}]\n"
                    "lights: [{name: flash, type: point, position: [437250, 5418298, 0], intensity: 10}]\n");
  EXPECT_EQ(error_of([&] { load_scene(scene); }),
            scene +
                ":3:9: shapes: the scene of size 2.45 lies at coordinates of 5.42e+06, where rays, in single "
                "precision, do not "
                "see it (at most a thousand times its size, as by `transform: {translate: ...}` of every shape)");
}

TEST_F(FieldMesh, RoundingInDoublePrecisionLeavesNoSeam) {
  // The seam of a cylinder whose last column is computed again, a whole turn on.
  constexpr int kSides = 12;
  for (const double far : {0.0, 5.4e6}) {
    std::string text;
    for (int i = 0; i <= kSides; ++i)
      for (const int z : {0, 1})
        text += fmt::format("v {} {} {}\n", far + std::cos(2 * M_PI * i / kSides), std::sin(2 * M_PI * i / kSides), z);
    for (int i = 1; i <= 2 * kSides; i += 2) text += fmt::format("f {} {} {} {}\n", i, i + 2, i + 3, i + 1);
    const Mesh clean = clean_mesh(read("m.obj", text));
    EXPECT_EQ(clean.positions.size(), 2u * kSides);
    EXPECT_EQ(build_edges(clean).size(), 4u * kSides);
  }
}

TEST_F(FieldMesh, VerticesKeepTheirNumbers) {
  // Vertex 0 has no face, 3 lies on 1, 5 on 2.
  const std::string text = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nf 2 3 5\nf 6 7 5\n";
  const Mesh clean = clean_mesh(read("m.obj", text));
  EXPECT_EQ(clean.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}));
  ASSERT_TRUE(clean.file_vertices);
  EXPECT_EQ(clean.file_vertices->vertex, (std::vector<int>{-1, 0, 1, 0, 2, 1, 3}));
  EXPECT_EQ(clean.file_vertices->loose, (std::vector<Vec3>{{9, 9, 9}}));
  EXPECT_FALSE(clean_mesh(read("m.obj", obj())).file_vertices);
}

TEST_F(FieldMesh, AFloorWithAWallInOnePolygon) {
  const Mesh mesh = read_mesh(kField + "meshes/bent_pentagon.obj");
  EXPECT_EQ(mesh.faces.size(), 3u);
  // The floor, and the triangle between (0, 0, -3), (1, 2, -3) and (0, 0, 0), whose sides are sqrt(5), sqrt(14) and 3.
  EXPECT_NEAR(area(mesh), 12 + std::sqrt(45.0) / 2, 1e-12);
  const Mesh solid = read_mesh(kField + "meshes/bent_closed.obj");
  EXPECT_EQ(solid.faces.size(), 8u);
  for (const auto& [side, count] : sides_of(solid)) EXPECT_EQ(count, 2) << side.first << " " << side.second;
}

TEST_F(FieldMesh, BentPolygonsKeepTheirSidesFromEveryCornerInBothOrientations) {
  // A floor with one wall, with two, a step, a saddle that no direction shows without a crossing, and one whose
  // corner lies on a straight side.
  const std::vector<std::vector<Vec3>> polygons{
      {{0, 0, 0}, {4, 0, 0}, {4, 0, -3}, {0, 0, -3}, {1, 2, -3}},
      {{0, 0, 0}, {4, 0, 0}, {4, 2, 0}, {4, 2, -3}, {4, 0, -3}, {0, 0, -3}, {0, 2, -3}, {0, 2, 0}},
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {2, 1, 0}, {2, 1, 1}, {1, 1, 1}, {1, 0, 1}, {0, 0, 1}},
      {{1, 0, 1}, {0, 1, -1}, {-1, 0, 1}, {-1, -1, 0}, {0, -1, -1}, {1, -1, 3}},
      {{0, 0, 0}, {2, 0, 0}, {4, 0, 0}, {4, 0, -3}, {0, 0, -3}, {1, 2, -3}}};
  for (const std::vector<Vec3>& points : polygons)
    for (const bool reversed : {false, true})
      for (std::size_t first = 0; first < points.size(); ++first) {
        std::vector<int> corners;
        for (std::size_t i = 0; i < points.size(); ++i)
          corners.push_back(static_cast<int>((first + i) % points.size()));
        if (reversed) std::reverse(corners.begin(), corners.end());
        Mesh mesh{points, {}};
        ASSERT_EQ(cut_polygon(points, corners, mesh.faces), "");
        EXPECT_EQ(mesh.faces.size(), points.size() - 2);
        std::map<std::pair<int, int>, int> sides;  // how often more upwards than downwards in number
        const auto add = [&](int a, int b, int sign) { sides[std::minmax(a, b)] += a < b ? sign : -sign; };
        for (const Face& f : mesh.faces)
          for (int i = 0; i < 3; ++i) add(f[i], f[(i + 1) % 3], 1);
        for (std::size_t i = 0; i < corners.size(); ++i) add(corners[i], corners[(i + 1) % corners.size()], -1);
        for (const auto& [side, count] : sides) EXPECT_EQ(count, 0) << side.first << " " << side.second;
        EXPECT_EQ(clean_mesh(mesh).faces.size(), points.size() - 2);  // none without area
      }
}

}  // namespace
}  // namespace isochron
