#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "core/base/error.h"
#include "core/scene/mesh_file.h"
#include "core/scene/mesh_text.h"

namespace isochron {
namespace {

using Point = std::array<float, 3>;

CheckedMeshFile check_obj(const std::string& file, const std::string& contents) {
  MeshText text(file, contents, '#');
  long long vertices = 0, highest = 0;  // faces may refer to vertices further down
  std::size_t faces = 0;
  int highest_line = 0;
  std::vector<int> corners;
  while (text.next()) {
    const std::string_view keyword = text.word();
    if (keyword == "v") {
      text.point();
      ++vertices;
    } else if (keyword == "f") {
      corners.clear();
      for (std::string_view word = text.word(); !word.empty(); word = text.word()) {
        const std::string_view digits = word.substr(0, word.find('/'));
        const long long index = MeshText::try_integer(digits).value_or(0);
        if (index == 0 || index < -vertices || index > MeshText::kMostItems)
          text.fail(fmt::format("{} is not a vertex of a face (an index from 1, or from -1 down to -{})", quote(word),
                                vertices));
        text.rewrite(word, digits);
        if (index > highest) highest = index, highest_line = text.line();
        corners.push_back(static_cast<int>(index > 0 ? index - 1 : vertices + index));
      }
      faces += text.check_face(corners);
    } else {
      text.skip_line();
    }
  }
  if (highest > vertices)
    throw InputError(
        fmt::format("{}:{}: there is no vertex {} (the file has {})", file, highest_line, highest, vertices));
  return text.found(vertices, faces);
}

CheckedMeshFile check_off(const std::string& file, const std::string& contents) {
  MeshText text(file, contents, '#');
  text.require_next();
  const std::string_view header = text.word(), rest = text.word();
  if (header != "OFF" && header != "COFF" && header != "NOFF" && header != "CNOFF" && header != "STOFF")
    text.fail("does not begin with OFF");
  if (!rest.empty()) text.fail(fmt::format("{} after OFF (only text files in three dimensions are read)", quote(rest)));
  text.require_next();
  const long long vertices = text.count(), faces = text.count();
  text.copy = fmt::format("OFF\n{} {} 0", vertices, faces);
  for (long long v = 0; v < vertices; ++v) text.require_next(), text.point();
  std::size_t kept = 0;
  for (long long f = 0; f < faces; ++f) text.require_next(), kept += text.check_face(text.face(vertices));
  return text.found(vertices, kept);
}

/// OpenMesh leaves out facets with equal corners.
bool is_triangle(const Point* p) {
  return p[0] != p[1] && p[1] != p[2] && p[2] != p[0];
}

CheckedMeshFile check_stl(const std::string& file, std::string contents) {
  static_assert(std::endian::native == std::endian::little, "STL files are little-endian");
  constexpr std::size_t kHeader = 84, kFacet = 50, kNormal = 12;
  Point points[3];
  std::size_t kept = 0;
  // A text file can begin like a binary one and the reverse; the size tells.
  std::uint32_t facets = 0;
  if (contents.size() >= kHeader) std::memcpy(&facets, contents.data() + kHeader - 4, sizeof facets);
  if (contents.size() >= kHeader && contents.size() == kHeader + kFacet * facets) {
    for (std::size_t f = 0; f < facets; ++f) {
      std::memcpy(points, contents.data() + kHeader + f * kFacet + kNormal, sizeof points);
      for (const Point& p : points) {
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
          throw InputError(fmt::format("{}: facet {} has a coordinate that is not a finite number", file, f + 1));
      }
      kept += is_triangle(points);
    }
    return {std::move(contents), true, std::nullopt, kept};
  }
  MeshText text(file, contents, '\0');
  text.require_next();
  if (text.word() != "solid") text.fail("is neither text STL nor binary STL of the size its header states");
  std::size_t corners = 0;
  while (text.next()) {
    const std::string_view keyword = text.word();
    if (keyword == "vertex") {
      points[corners++ % 3] = text.point();
    } else if (keyword == "endloop") {
      if (corners != 3) text.fail(fmt::format("a facet of {} vertices (three)", corners));
      kept += is_triangle(points);
      corners = 0;
    }
  }
  if (corners != 0) text.fail("the file ends within a facet");
  return text.found(std::nullopt, kept);
}

}  // namespace

CheckedMeshFile check_mesh_file(const std::string& file, const std::string& extension, std::string contents) {
  return extension == ".obj"   ? check_obj(file, contents)
         : extension == ".off" ? check_off(file, contents)
         : extension == ".ply" ? check_ply(file, contents)
                               : check_stl(file, std::move(contents));
}

bool has_three_corners(const std::vector<int>& vertices) {
  const auto other = std::find_if(vertices.begin(), vertices.end(), [&](int v) { return v != vertices[0]; });
  return std::any_of(other, vertices.end(), [&](int v) { return v != vertices[0] && v != *other; });
}

}  // namespace isochron
