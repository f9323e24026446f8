#include "core/scene/mesh_writer.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <iterator>

namespace isochron {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY files are written little-endian");

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

std::string to_ply(const Scene& scene, const Shape& shape) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      shape.vertex_count, shape.triangle_count);
  for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v)
    for (int axis = 0; axis < 3; ++axis) append(bytes, scene.positions[v][axis]);
  for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
    append(bytes, std::uint8_t{3});
    for (const int v : scene.triangles[t].vertex) append(bytes, std::int32_t{v - shape.first_vertex});
  }
  return bytes;
}

std::string to_obj(const Scene& scene, const Shape& shape) {
  std::string text;
  auto out = std::back_inserter(text);
  for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v) {
    const Vec3& p = scene.positions[v];
    fmt::format_to(out, "v {} {} {}\n", p.x, p.y, p.z);
  }
  const int first = shape.first_vertex - 1;  // OBJ counts from 1
  for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
    const auto& v = scene.triangles[t].vertex;
    fmt::format_to(out, "f {} {} {}\n", v[0] - first, v[1] - first, v[2] - first);
  }
  return text;
}

std::span<const MeshFormat> mesh_formats() {
  static constexpr MeshFormat kFormats[] = {{"ply", "binary", to_ply}, {"obj", "text", to_obj}};
  return kFormats;
}

}  // namespace isochron
