#include "core/scene/mesh_writer.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <iterator>
#include <limits>

namespace isochron {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY files are written little-endian");

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

std::string to_ply(const Scene& scene, const Shape& shape, std::span<const VertexProperty> properties) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\n",
      shape.file_vertex_count());
  for (const VertexProperty& property : properties) bytes += fmt::format("property double {}\n", property.name);
  bytes += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", shape.triangle_count);
  const std::vector<Vec3> positions = shape.file_positions(scene.positions);
  for (int i = 0; i < shape.file_vertex_count(); ++i) {
    for (int axis = 0; axis < 3; ++axis) append(bytes, positions[i][axis]);
    const int v = shape.vertex_of_file(i);
    for (const VertexProperty& property : properties)
      append(bytes, v < 0 ? std::numeric_limits<double>::quiet_NaN() : property.values[v]);
  }
  const std::vector<int> numbers = shape.numbers_in_file();
  for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
    append(bytes, std::uint8_t{3});
    for (const int v : scene.triangles[t].vertex) append(bytes, std::int32_t{numbers[v - shape.first_vertex]});
  }
  return bytes;
}

std::string to_obj(const Scene& scene, const Shape& shape, std::span<const VertexProperty> /*properties*/) {
  std::string text;
  auto out = std::back_inserter(text);
  for (const Vec3& p : shape.file_positions(scene.positions)) fmt::format_to(out, "v {} {} {}\n", p.x, p.y, p.z);
  const std::vector<int> numbers = shape.numbers_in_file();
  const auto number = [&](int v) { return numbers[v - shape.first_vertex] + 1; };  // OBJ counts from 1
  for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
    const auto& v = scene.triangles[t].vertex;
    fmt::format_to(out, "f {} {} {}\n", number(v[0]), number(v[1]), number(v[2]));
  }
  return text;
}

std::span<const MeshFormat> mesh_formats() {
  static constexpr MeshFormat kFormats[] = {{"ply", "binary", to_ply}, {"obj", "text", to_obj}};
  return kFormats;
}

}  // namespace isochron
