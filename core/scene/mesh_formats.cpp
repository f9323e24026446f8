// OBJ, OFF and STL.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <map>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/scene/mesh_file.h"
#include "core/scene/mesh_text.h"

namespace isochron {

namespace {

/// An index as OBJ counts: from 1, or backwards from the last vertex so far. Texture and normals may follow it.
int corner_of(std::string_view word, long long vertices, const MeshText& text) {
  const long long index = parse_integer(word.substr(0, word.find('/'))).value_or(0);
  if (index == 0 || index < -vertices || index > MeshText::kMostItems)
    text.fail(
        fmt::format("{} is not a vertex of a face (an index from 1, or from -1 down to -{})", quote(word), vertices));
  return static_cast<int>(index > 0 ? index - 1 : vertices + index);
}

}  // namespace

PolygonMesh read_obj(const std::string& file, const std::string& contents) {
  MeshText text(file, contents, {.comment = '#', .continued = true});
  PolygonMesh mesh;
  int highest = -1, highest_line = 0;  // faces may refer to vertices further down
  std::vector<int> corners;
  while (text.next()) {
    const std::string_view keyword = text.word();
    if (keyword == "v") {
      mesh.positions.push_back(text.point());
    } else if (keyword == "f" || keyword == "fo") {  // as it was called once
      corners.clear();
      for (std::string_view word = text.word(); !word.empty(); word = text.word()) {
        corners.push_back(corner_of(word, static_cast<long long>(mesh.positions.size()), text));
        if (corners.back() > highest) highest = corners.back(), highest_line = text.line();
      }
      text.add_face(corners, mesh);
    }
  }
  if (highest >= static_cast<long long>(mesh.positions.size()))
    throw InputError(fmt::format("{}:{}: there is no vertex {} (the file has {})", file, highest_line, highest + 1LL,
                                 mesh.positions.size()));
  return mesh;
}

namespace {

/// Goes behind the header, which may be missing, stand on a line of its own, or before the counts with a blank or none.
/// Returns the first count.
std::string_view pass_off_header(MeshText& text) {
  text.require_next();
  std::string_view first = text.word();
  if (parse_integer(first)) return first;
  const std::string_view header = first.substr(0, std::min(first.find_first_of("0123456789+-"), first.size()));
  constexpr std::string_view kHeaders[] = {"OFF", "COFF", "NOFF", "CNOFF", "STOFF", "STCOFF", "STNOFF", "STCNOFF"};
  if (header.ends_with("nOFF") || first == "4OFF" || first == "4nOFF")
    text.fail(fmt::format("{} (only three dimensions are read)", quote(first)));
  if (std::none_of(std::begin(kHeaders), std::end(kHeaders), [&](std::string_view h) { return same_word(header, h); }))
    text.fail("does not begin with OFF");
  first.remove_prefix(header.size());
  if (first.empty()) first = text.word();
  if (same_word(first, "binary")) text.fail(fmt::format("{} after OFF (only text files are read)", quote(first)));
  if (!first.empty()) return first;
  text.require_next();
  return text.word();
}

}  // namespace

PolygonMesh read_off(const std::string& file, const std::string& contents) {
  MeshText text(file, contents, {.comment = '#'});
  const long long vertices = text.count_of(pass_off_header(text)), faces = text.count();
  PolygonMesh mesh;
  for (long long v = 0; v < vertices; ++v) text.require_next(), mesh.positions.push_back(text.point());
  for (long long f = 0; f < faces; ++f) text.require_next(), text.add_face(text.face(vertices), mesh);
  return mesh;
}

namespace {

/// Facets whose corners at equal positions are one vertex.
class Facets {
 public:
  void add(const Vec3* points) {
    std::vector<int> corners;
    for (int i = 0; i < 3; ++i) {
      const Vec3& p = points[i];
      const auto [vertex, is_new] =
          vertices_.emplace(std::array{p.x, p.y, p.z}, static_cast<int>(mesh.positions.size()));
      if (is_new) mesh.positions.push_back(p);
      corners.push_back(vertex->second);
    }
    mesh.add_polygon(corners);
  }
  PolygonMesh mesh;

 private:
  std::map<std::array<double, 3>, int> vertices_;
};

constexpr std::size_t kHeader = 84, kFacet = 50, kNormal = 12;

PolygonMesh read_binary_stl(const std::string& file, const std::string& contents, std::size_t count) {
  static_assert(std::endian::native == std::endian::little, "STL files are little-endian");
  Facets facets;
  for (std::size_t f = 0; f < count; ++f) {
    std::array<float, 9> numbers;
    std::memcpy(numbers.data(), contents.data() + kHeader + f * kFacet + kNormal, sizeof numbers);
    Vec3 points[3];
    for (int i = 0; i < 9; ++i) points[i / 3][i % 3] = numbers[static_cast<std::size_t>(i)];
    if (!std::all_of(numbers.begin(), numbers.end(), [](float x) { return std::isfinite(x); }))
      throw InputError(fmt::format("{}: facet {} has a coordinate that is not a finite number", file, f + 1));
    facets.add(points);
  }
  // What follows the facets is padding, unless it is so long that facets may be among it.
  const std::string_view behind = std::string_view(contents).substr(kHeader + count * kFacet);
  if (behind.size() >= kFacet && behind.find_first_not_of('\0') != std::string_view::npos)
    throw InputError(
        fmt::format("{}: {} bytes follow the {} facets that its header states", file, behind.size(), count));
  return std::move(facets.mesh);
}

PolygonMesh read_text_stl(MeshText& text) {
  Facets facets;
  Vec3 points[3];
  std::size_t corners = 0;
  const auto end_facet = [&] {
    if (corners != 3) text.fail(fmt::format("a facet of {} vertices (three)", corners));
    facets.add(points);
    corners = 0;
  };
  do {
    for (std::string_view word = text.word(); !word.empty(); word = text.word()) {
      if (same_word(word, "vertex")) {
        points[corners++ % 3] = text.point();
      } else if (same_word(word, "endloop")) {
        end_facet();
      } else if (same_word(word, "end") || same_word(word, "endfacet") || same_word(word, "facet")) {
        if (corners > 0) end_facet();  // some write `end loop`, or nothing
      } else if (same_word(word, "solid") || same_word(word, "endsolid")) {
        text.skip_line();  // a name of any words
      }
    }
  } while (text.next());
  if (corners != 0) text.fail("the file ends within a facet");
  return std::move(facets.mesh);
}

}  // namespace

PolygonMesh read_stl(const std::string& file, const std::string& contents) {
  // A binary file may begin with `solid`, too. The same four bytes of a text make a count that no text is long enough for.
  std::uint32_t count = 0;
  if (contents.size() >= kHeader) std::memcpy(&count, contents.data() + kHeader - sizeof count, sizeof count);
  if (contents.size() >= kHeader && contents.size() >= kHeader + kFacet * count)
    return read_binary_stl(file, contents, count);
  MeshText text(file, contents, {});
  text.require_next();
  if (contents.find('\0') != std::string::npos || !same_word(text.word(), "solid"))
    text.fail("is neither text STL nor binary STL of the size its header states");
  text.skip_line();
  return read_text_stl(text);
}

}  // namespace isochron
