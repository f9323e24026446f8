// OBJ, OFF and STL.
#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <string_view>

#include "core/base/error.h"
#include "core/scene/mesh_file.h"
#include "core/scene/mesh_text.h"

namespace isochron {

PolygonMesh read_obj(const std::string& file, const std::string& contents) {
  MeshText text(file, contents, '#');
  PolygonMesh mesh;
  long long highest = 0;  // faces may refer to vertices further down
  int highest_line = 0;
  std::vector<int> corners;
  while (text.next()) {
    const std::string_view keyword = text.word();
    const long long vertices = static_cast<long long>(mesh.positions.size());
    if (keyword == "v") {
      mesh.add_vertex(text.point());
    } else if (keyword == "f") {
      corners.clear();
      for (std::string_view word = text.word(); !word.empty(); word = text.word()) {
        const long long index = MeshText::try_integer(word.substr(0, word.find('/'))).value_or(0);
        if (index == 0 || index < -vertices || index > MeshText::kMostItems)
          text.fail(fmt::format("{} is not a vertex of a face (an index from 1, or from -1 down to -{})", quote(word),
                                vertices));
        if (index > highest) highest = index, highest_line = text.line();
        corners.push_back(static_cast<int>(index > 0 ? index - 1 : vertices + index));
      }
      text.add_face(corners, mesh);
    }
  }
  if (highest > static_cast<long long>(mesh.positions.size()))
    throw InputError(fmt::format("{}:{}: there is no vertex {} (the file has {})", file, highest_line, highest,
                                 mesh.positions.size()));
  return mesh;
}

PolygonMesh read_off(const std::string& file, const std::string& contents) {
  MeshText text(file, contents, '#');
  text.require_next();
  const std::string_view header = text.word(), rest = text.word();
  if (header != "OFF" && header != "COFF" && header != "NOFF" && header != "CNOFF" && header != "STOFF")
    text.fail("does not begin with OFF");
  if (!rest.empty()) text.fail(fmt::format("{} after OFF (only text files in three dimensions are read)", quote(rest)));
  text.require_next();
  const long long vertices = text.count(), faces = text.count();
  PolygonMesh mesh;
  for (long long v = 0; v < vertices; ++v) text.require_next(), mesh.add_vertex(text.point());
  for (long long f = 0; f < faces; ++f) text.require_next(), text.add_face(text.face(vertices), mesh);
  return mesh;
}

PolygonMesh read_stl(const std::string& file, const std::string& contents) {
  static_assert(std::endian::native == std::endian::little, "STL files are little-endian");
  constexpr std::size_t kHeader = 84, kFacet = 50, kNormal = 12;
  using Point = std::array<float, 3>;
  PolygonMesh mesh;
  std::map<Point, int> vertices;
  const auto add_facet = [&](const Point* points) {
    std::vector<int> corners;
    for (int i = 0; i < 3; ++i) {
      const auto [vertex, is_new] = vertices.emplace(points[i], static_cast<int>(mesh.positions.size()));
      if (is_new) mesh.add_vertex(points[i]);
      corners.push_back(vertex->second);
    }
    mesh.add_polygon(corners);
  };
  Point points[3];
  // A text file can begin like a binary one and the reverse; the size tells.
  std::uint32_t facets = 0;
  if (contents.size() >= kHeader) std::memcpy(&facets, contents.data() + kHeader - 4, sizeof facets);
  if (contents.size() >= kHeader && contents.size() == kHeader + kFacet * facets) {
    for (std::size_t f = 0; f < facets; ++f) {
      std::memcpy(points, contents.data() + kHeader + f * kFacet + kNormal, sizeof points);
      for (const Point& p : points)
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
          throw InputError(fmt::format("{}: facet {} has a coordinate that is not a finite number", file, f + 1));
      add_facet(points);
    }
    return mesh;
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
      add_facet(points);
      corners = 0;
    }
  }
  if (corners != 0) text.fail("the file ends within a facet");
  return mesh;
}

}  // namespace isochron
