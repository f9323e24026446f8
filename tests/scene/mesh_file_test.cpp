// Meshes from files of every format, and what is said of damaged ones.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iostream>

#include "tests/scene/cube_mesh.h"
#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

template <class T>
void append(std::string& bytes, T value, bool big_endian = false) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (big_endian) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

class MeshFile : public ::testing::Test {
 protected:
  Mesh read(const std::string& name, const std::string& contents) { return read_mesh(folder.write(name, contents)); }
  /// The message without the folder.
  std::string error(const std::string& name, const std::string& contents) {
    const std::string message = error_of([&] { read(name, contents); });
    const std::string prefix = folder.path("");
    return message.starts_with(prefix) ? message.substr(prefix.size()) : message;
  }

  TemporaryFolder folder;
};

std::string cube_obj() {
  std::string text = "# a cube of quads\nmtllib none.mtl\no cube\n";
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = cube_corner(i);
    text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  }
  text += "vt 0 0\nvn 0 0 1\nusemtl none\ns off\n";
  for (const auto& q : kCube) {
    text += "f";
    const char* const suffixes[] = {"", "/1", "//1", "/1/1"};
    for (int k = 0; k < 4; ++k) text += fmt::format(" {}{}", q[k] + 1, suffixes[k]);
    text += "\r\n";
  }
  return text;
}

std::string cube_ply(const std::string& format) {
  const bool big = format == "binary_big_endian";
  std::string bytes =
      "ply\nformat " + format +
      " 1.0\ncomment 3 quads\nelement vertex 8\nproperty float x\nproperty float y\nproperty uchar red\n"
      "property float z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = cube_corner(i);
    if (format == "ascii") {
      bytes += fmt::format("{} {} 255 {}\n", p.x, p.y, p.z);
    } else {
      append(bytes, static_cast<float>(p.x), big), append(bytes, static_cast<float>(p.y), big);
      append(bytes, static_cast<unsigned char>(255)), append(bytes, static_cast<float>(p.z), big);
    }
  }
  for (const auto& q : kCube) {
    if (format == "ascii") {
      bytes += "4";
      for (const int v : q) bytes += fmt::format(" {}", v);
      bytes += "\n";
    } else {
      append(bytes, static_cast<unsigned char>(4));
      for (const int v : q) append(bytes, static_cast<std::int32_t>(v), big);
    }
  }
  return bytes;
}

std::string cube_stl(bool binary) {
  std::string bytes = binary ? std::string(80, ' ') : "solid cube\n";
  if (binary) append(bytes, std::uint32_t{12});
  for (const auto& q : kCube) {
    for (int k = 2; k < 4; ++k) {
      if (binary) {
        bytes.append(12, '\0');
      } else {
        bytes += "  facet normal 0 0 0\n    outer loop\n";
      }
      for (const int v : {q[0], q[k - 1], q[k]}) {
        const Vec3 p = cube_corner(v);
        if (binary) {
          append(bytes, static_cast<float>(p.x)), append(bytes, static_cast<float>(p.y)),
              append(bytes, static_cast<float>(p.z));
        } else {
          bytes += fmt::format("      vertex {} {} {}\n", p.x, p.y, p.z);
        }
      }
      if (binary) {
        bytes.append(2, '\0');
      } else {
        bytes += "    endloop\n  endfacet\n";
      }
    }
  }
  return binary ? bytes : bytes + "endsolid cube\n";
}

std::string cube_off() {
  std::string text = "OFF\n# counts\n8 6 0\n";
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = cube_corner(i);
    text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
  }
  for (const auto& q : kCube) {
    text += "4";
    for (const int v : q) text += fmt::format(" {}", v);
    text += " 255 0 0\n";
  }
  return text;
}

TEST_F(MeshFile, EveryFormatGivesTheSameCube) {
  std::ostringstream chatter;
  std::streambuf* const standard = std::cerr.rdbuf(chatter.rdbuf());
  expect_cube(read("cube.obj", cube_obj()));
  expect_cube(read("cube.off", cube_off()));
  expect_cube(read("text.ply", cube_ply("ascii")));
  expect_cube(read("little.ply", cube_ply("binary_little_endian")));
  expect_cube(read("big.ply", cube_ply("binary_big_endian")));
  expect_cube(read("text.stl", cube_stl(false)));
  expect_cube(read("binary.STL", cube_stl(true)));
  std::cerr.rdbuf(standard);
  EXPECT_EQ(chatter.str(), "");
}

TEST_F(MeshFile, TextIsRoundedToTheNearestDouble) {
  const Mesh mesh = read("m.obj", "v 0.1 +1e-3 -2.5E1\nv 1 0 0 1 0.5 0.5 0.5\nv 0 1 1e-400\nf -3 -2 -1\n");
  EXPECT_EQ(mesh.positions[0], (Vec3{0.1, 1e-3, -25}));
  EXPECT_EQ(mesh.positions[1], (Vec3{1, 0, 0}));
  EXPECT_EQ(mesh.positions[2], (Vec3{0, 1, 0}));
  EXPECT_EQ(mesh.faces, (std::vector<Face>{{0, 1, 2}}));
}

TEST_F(MeshFile, PolygonsBecomeFans) {
  const Mesh mesh = read("m.obj", "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5\n");
  EXPECT_EQ(mesh.faces, (std::vector<Face>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST_F(MeshFile, CornersTwiceCostNoOtherTriangle) {
  const std::string points = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
  const std::vector<Face> expected{{0, 1, 2}, {0, 1, 3}};
  EXPECT_EQ(read("m.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 2 3\nf 1 2 4 1\nf 1 1 2\n").faces, expected);
  EXPECT_EQ(read("m.off", "OFF\n4 3 0\n" + points + "4 0 1 1 2\n4 0 1 3 0\n3 0 0 1\n").faces, expected);
}

TEST_F(MeshFile, CommentsAndAttributesAreNotTakenForData) {
  // Each of these makes common readers lose or invent faces or vertices.
  const std::vector<Vec3> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  const std::vector<Face> faces{{0, 1, 2}, {1, 3, 2}};
  const auto expect_same = [&](const std::string& name, const std::string& contents) {
    const Mesh mesh = read(name, contents);
    EXPECT_EQ(mesh.positions, positions) << contents;
    EXPECT_EQ(mesh.faces, faces) << contents;
  };
  expect_same("m.obj", "v 0 0 0\nvt 0.5\nv 1 0 0 # 7\nv 0 1 0\nf 1 2 3 # the 4 th\n\nv 1 1 0\nf -3 4//1 3/1\n");
  expect_same("m.off", "OFF # a\n# 1\n4 2\n0 0 0\n# 2\n1 0 0\n\n0 1 0\n1 1 0\n3 0 1 2 255 0 0\n3 1 3 2 # 3\n");
  expect_same("m.off",
              "CNOFF\n4 2 5\n0 0 0 0 0 1 9 9 9 1\n1 0 0 0 0 1 9 9 9 1\n0 1 0 0 0 1 9 9 9 1\n"
              "1 1 0 0 0 1 9 9 9 1\n3 0 1 2 0.5 0 0 1\n3 1 3 2\n");
  expect_same("m.ply",
              "ply\nformat ascii 1.0\nobj_info x\nelement camera 1\nproperty list int int views\n"
              "element vertex 4\nproperty int red\nproperty double x\nproperty double y\n"
              "property double z\nelement face 2\nproperty list uchar float texcoord\n"
              "property list uchar int vertex_index\nproperty float nx\nend_header\n2 8 9\n0.5 0 0 0\n"
              "0.5 1 0 0\n1 0 1 0\n1 1 1 0\n6 0 0 1 0 0 1 3 0 1 2 nan\n0 3 1 3 2 0\n");
  const std::string stl =
      "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n\nvertex 1 0 0\nvertex 0 1 0\n"
      "endloop\nendfacet\nfacet normal nan 0 0\nouter loop\nvertex 1 0 0\nvertex 1 1 0\n"
      "vertex 0 1 0\nendloop\nendfacet\nendsolid\n";
  expect_same("m.stl", stl);
}

TEST_F(MeshFile, MeshesThatAreNoManifoldAreReadAsTheyAre) {
  // An edge of three faces, a neighbor of opposite orientation, and a face that shares only a vertex: a reader that links
  // faces would give the third, the fourth and the last vertices of their own. The last vertex has no face.
  const std::vector<Vec3> positions{{0, 0, 0},   {0, 0, 1}, {1, 0, 0}, {0, 1, 0},
                                    {-1, -1, 0}, {5, 0, 1}, {5, 1, 1}, {9, 9, 9}};
  const std::vector<Face> faces{{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {0, 2, 4}, {1, 5, 6}};
  std::string obj, points, indices, stl = "solid\n";
  for (const Vec3& p : positions) {
    points += fmt::format("{} {} {}\n", p.x, p.y, p.z);
    obj += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  }
  for (const Face& f : faces) {
    indices += fmt::format("3 {} {} {}\n", f[0], f[1], f[2]);
    obj += fmt::format("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1);
    stl += "facet\nouter loop\n";
    for (const int v : f) stl += fmt::format("vertex {} {} {}\n", positions[v].x, positions[v].y, positions[v].z);
    stl += "endloop\nendfacet\n";
  }
  const std::string counts = fmt::format("OFF\n{} {} 0\n", positions.size(), faces.size());
  const std::string header = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      positions.size(), faces.size());
  const Mesh meshes[] = {read("m.obj", obj), read("m.off", counts + points + indices),
                         read("m.ply", header + points + indices), read("m.stl", stl)};
  for (const Mesh& mesh : meshes) {
    const bool soup = &mesh == &meshes[3];  // holds no vertices without faces
    EXPECT_EQ(mesh.positions.size(), positions.size() - soup);
    EXPECT_EQ(mesh.faces, faces);
    const Mesh clean = clean_mesh(mesh);
    EXPECT_EQ(clean.positions, std::vector<Vec3>(positions.begin(), positions.end() - 1));
    EXPECT_EQ(clean.faces, faces);
    const std::vector<Edge> edges = build_edges(clean);
    EXPECT_EQ(std::ranges::count(edges, true, &Edge::sector), 3) << "of an edge that three faces share";
  }
}

TEST_F(MeshFile, ObjErrors) {
  const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_EQ(error("m.obj", "v 0 0\n"), "m.obj:1: '' is not a finite number");
  EXPECT_EQ(error("m.obj", "# c\n\nv 0 inf 0\n"), "m.obj:3: 'inf' is not a finite number");
  EXPECT_EQ(error("m.obj", "v 0 1e999 0\n"), "m.obj:1: '1e999' is not a finite number");
  EXPECT_EQ(error("m.obj", "v 0 0.1x 0\n"), "m.obj:1: '0.1x' is not a finite number");
  EXPECT_EQ(error("m.obj", "v 0 0x1 0\n"), "m.obj:1: '0x1' is not a finite number");
  EXPECT_EQ(error("m.obj", "v 0 0,5 0\n"), "m.obj:1: '0,5' is not a finite number");
  EXPECT_EQ(error("m.obj", three + "f 1 2\n"), "m.obj:4: a face of 2 vertices (at least three)");
  EXPECT_EQ(error("m.obj", three + "f 0 1 2\n"),
            "m.obj:4: '0' is not a vertex of a face (an index from 1, or from -1 down to -3)");
  EXPECT_EQ(error("m.obj", three + "f 1 2 -4/1\n"),
            "m.obj:4: '-4/1' is not a vertex of a face (an index from 1, or from -1 down to -3)");
  EXPECT_EQ(error("m.obj", three + "f 1 2 3\n\nf 9 2 3\n"), "m.obj:6: there is no vertex 9 (the file has 3)");
  EXPECT_EQ(error("m.obj", ""), "m.obj: has no faces");
  EXPECT_EQ(error("m.obj", "garbage"), "m.obj: has no faces");
  EXPECT_EQ(error("m.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 4 3\n"), "m.obj: none of its faces has an area");
  EXPECT_EQ(error("m.abc", three), "m.abc: '.abc' is not a kind of mesh (allowed: .obj, .ply, .off, .stl)");
  std::filesystem::create_directory(folder.path("folder.obj"));
  EXPECT_EQ(error_of([&] { read_mesh(folder.path("folder.obj")); }), folder.path("folder.obj") + ": is a folder");
}

TEST_F(MeshFile, OffErrors) {
  EXPECT_EQ(error("m.off", "garbage\n"), "m.off:1: does not begin with OFF");
  EXPECT_EQ(error("m.off", "OFF BINARY\n"),
            "m.off:1: 'BINARY' after OFF (only text files are read)");
  EXPECT_EQ(error("m.off", "OFF\n3 -1 0\n"), "m.off:2: impossible counts");
  EXPECT_EQ(error("m.off", "OFF\n3 1 0\n0 0 0\n1 nan 0\n"), "m.off:4: 'nan' is not a finite number");
  EXPECT_EQ(error("m.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"), "m.off:4: the file ends too early");
  EXPECT_EQ(error("m.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), "m.off:6: there is no vertex 3 (0 to 2)");
  EXPECT_EQ(error("m.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n"),
            "m.off:6: a face of 2 vertices (at least three)");
  EXPECT_EQ(error("m.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n"), "m.off: has no faces");
}

TEST_F(MeshFile, PlyErrors) {
  const auto text = [&](const std::string& from, const std::string& to, const std::string& format = "ascii") {
    std::string contents = cube_ply(format);
    contents.replace(contents.find(from), from.size(), to);
    return error("m.ply", contents);
  };
  EXPECT_EQ(error("m.ply", ""), "m.ply:0: the file ends too early");
  EXPECT_EQ(text("ply\n", "plx\n"), "m.ply:1: does not begin with ply");
  EXPECT_EQ(text("ascii", "utf8"), "m.ply:2: 'utf8' is not a format of PLY");
  EXPECT_EQ(text("property float z", "property float w"),
            "m.ply:11: the header has no element vertex with properties x, y and z");
  EXPECT_EQ(text("element face", "element faces"),
            "m.ply:11: has no faces (an element face with property vertex_indices)");
  EXPECT_EQ(text("\n1 ", "\nnan "), "m.ply:13: 'nan' is not a finite number");
  EXPECT_EQ(text("4 4 5 7 6", "4 4 5 8 6"), "m.ply:21: there is no vertex 8 (0 to 7)");
  EXPECT_EQ(text("4 1 3 7 5\n", ""), "m.ply:24: the file ends too early");
}

TEST_F(MeshFile, BinaryPlyErrors) {
  std::ostringstream chatter;
  std::streambuf* const standard = std::cerr.rdbuf(chatter.rdbuf());
  const std::string good = cube_ply("binary_little_endian");
  const std::size_t body = good.find("end_header\n") + 11, faces = body + 8 * 13;
  std::string bad = good;
  const float nan = std::nanf("");
  std::memcpy(bad.data() + body + 13, &nan, sizeof nan);
  EXPECT_EQ(error("m.ply", bad), "m.ply: vertex 1 has a coordinate that is not a finite number");
  bad = good;
  const std::int32_t index = 77;
  std::memcpy(bad.data() + faces + 1 + 8, &index, sizeof index);
  EXPECT_EQ(error("m.ply", bad), "m.ply: there is no vertex 77 (0 to 7)");
  EXPECT_EQ(error("m.ply", good.substr(0, body + 30)), "m.ply: the file ends too early");
  EXPECT_EQ(error("m.ply", good.substr(0, faces + 20)), "m.ply: the file ends too early");
  EXPECT_EQ(error("m.ply", good.substr(0, good.size() - 1)), "m.ply: the file ends too early");
  std::cerr.rdbuf(standard);
  EXPECT_EQ(chatter.str(), "");
}

TEST_F(MeshFile, CountsAreNotBelieved) {
  // Taken at their word these would take gigabytes or years.
  const std::string header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_index\nend_header\n";
  const std::string more = "property float z\nproperty list int int more\n";
  EXPECT_EQ(error("m.ply", header + more + faces + "0 0 0 9223372036854775807\n"), "m.ply:11: impossible counts");
  EXPECT_EQ(error("m.ply", header + more + faces + "0 0 0 2000000000 1\n"), "m.ply:11: the line ends too early");
  EXPECT_EQ(error("m.off", "OFF\n2147483647 1 0\n0 0 0\n"), "m.off:3: the file ends too early");
  EXPECT_EQ(error("m.off", "OFF\n1 1 0\n0 0 0\n9223372036854775807 0 0 0\n"), "m.off:4: '' is not an integer");

  const std::string good = cube_ply("binary_little_endian");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string contents = good;
    return error("m.ply", contents.replace(contents.find(from), from.size(), to));
  };
  EXPECT_EQ(with("vertex 8", "vertex 2147483647"), "m.ply: the file ends too early");
  EXPECT_EQ(with("face 6", "face 2147483647"), "m.ply: the file ends too early");
  EXPECT_EQ(with("end_header", "element none 2147483647\nend_header"), "no error");
  std::string list = good + "\xff\xff\xff\xff";
  list.replace(list.find("end_header"), 10, "element last 1\nproperty list uint double x\nend_header");
  EXPECT_EQ(error("m.ply", list), "m.ply: the file ends too early");
}

TEST_F(MeshFile, PlyHeadersThatContradictThemselves) {
  const std::string good = cube_ply("binary_big_endian");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string contents = good;
    return error("m.ply", contents.replace(contents.find(from), from.size(), to));
  };
  EXPECT_EQ(with("uchar red", "float x"), "m.ply:7: x is given twice");
  EXPECT_EQ(with("uchar red", "colour red"), "m.ply:7: 'colour' is not a type of PLY");
  EXPECT_EQ(with("element face", "element vertex"), "m.ply:9: element vertex is given twice");
  EXPECT_EQ(with("end_header", "property list int int vertex_index\nend_header"),
            "m.ply:11: vertex_indices is given twice");
  // A list's size of four and the first bytes of its indices, taken for a float.
  EXPECT_TRUE(with("uchar int vertex_indices", "float int vertex_indices").starts_with("m.ply: a list of "));
}

TEST_F(MeshFile, BinaryPlyOfEveryType) {
  const auto read_as = [&](const std::string& coordinate, const auto& x, const std::string& index, const auto& i) {
    std::string bytes = "ply\r\nformat binary_big_endian 1.0\r\nelement vertex 3\r\n";
    for (const char* axis : {"z", "y", "x"}) bytes += "property " + coordinate + " " + axis + "\r\n";
    bytes += "property list char ushort more\r\nelement face 1\r\nproperty list double " + index +
             " vertex_index\r\nend_header\r\n";
    using Coordinate = std::decay_t<decltype(x)>;
    for (int v = 0; v < 3; ++v) {
      const int place[] = {0, v == 2, v == 1};  // z, y, x
      for (const int p : place) append(bytes, static_cast<Coordinate>(p), true);
      append(bytes, static_cast<signed char>(v), true);
      bytes.append(static_cast<std::size_t>(2 * v), '\x7f');
    }
    using Index = std::decay_t<decltype(i)>;
    append(bytes, 3.0, true);
    for (const int corner : {2, 0, 1}) append(bytes, static_cast<Index>(corner), true);
    return read("m.ply", bytes);
  };
  const Mesh meshes[] = {read_as("char", std::int8_t{}, "uchar", std::uint8_t{}),
                         read_as("short", std::int16_t{}, "ushort", std::uint16_t{}),
                         read_as("int32", std::int32_t{}, "uint32", std::uint32_t{}),
                         read_as("double", double{}, "int8", std::int8_t{}),
                         read_as("uint8", std::uint8_t{}, "float", float{})};
  for (const Mesh& mesh : meshes) {
    EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh.faces, (std::vector<Face>{{2, 0, 1}}));
  }
}

TEST_F(MeshFile, MessagesArePrintable) {
  EXPECT_EQ(error("m.obj", "v 0 0 1\x1b[2J\n"), "m.obj:1: '1 [2J' is not a finite number");
  EXPECT_EQ(error("m.off", "OFF\n" + std::string(100, 'x') + "\n"),
            "m.off:2: '" + std::string(40, 'x') + "...' is not an integer");
}

TEST_F(MeshFile, StlErrors) {
  EXPECT_EQ(error("m.stl", "garbage"), "m.stl:1: is neither text STL nor binary STL of the size its header states");
  std::string bad = cube_stl(true);
  const float nan = std::nanf("");
  std::memcpy(bad.data() + 84 + 50 * 2 + 12 + 4, &nan, sizeof nan);
  EXPECT_EQ(error("m.stl", bad), "m.stl: facet 3 has a coordinate that is not a finite number");
  EXPECT_EQ(error("m.stl", cube_stl(true).substr(0, 200)),
            "m.stl:1: is neither text STL nor binary STL of the size its header states");
  EXPECT_EQ(error("m.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 x 0\n"),
            "m.stl:5: 'x' is not a finite number");
  EXPECT_EQ(error("m.stl", "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n"),
            "m.stl:6: a facet of 2 vertices (three)");
  EXPECT_EQ(error("m.stl", "solid\nfacet\nouter loop\nvertex 0 0 0\n"), "m.stl:4: the file ends within a facet");
}

}  // namespace
}  // namespace isochron
