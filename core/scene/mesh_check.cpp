#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <set>
#include <string_view>

#include "core/math/error.h"
#include "core/scene/mesh_file.h"

namespace isochron {
namespace {

using Point = std::array<float, 3>;

constexpr std::string_view kSpace = " \t\r\f\v";
constexpr long long kMost = std::numeric_limits<int>::max();

/// A text file's lines and words, and what the formats have in common. The words asked for are copied, and
/// only they reach OpenMesh: the rest, such as comments, colors or normals, it may take for something else.
class Text {
 public:
  Text(const std::string& file, const std::string& contents, char comment)
      : file_(file), rest_(contents), comment_(comment) {
    copy.reserve(contents.size());
  }

  bool next() {  ///< goes to the next line that is not blank; false at the end
    while (!rest_.empty()) {
      current_ = rest_.substr(0, rest_.find('\n'));
      rest_.remove_prefix(std::min(current_.size() + 1, rest_.size()));
      ++line_;
      if (comment_ != '\0') current_ = current_.substr(0, current_.find(comment_));
      if (current_.find_first_not_of(kSpace) == std::string_view::npos) continue;
      if (!copy.empty() && copy.back() != '\n') copy += '\n';
      line_start_ = copy.size();
      return true;
    }
    current_ = {};
    return false;
  }
  void require_next() {
    if (!next()) fail("the file ends too early");
  }
  std::string_view word() {  ///< the line's next word; empty at its end
    current_.remove_prefix(std::min(current_.find_first_not_of(kSpace), current_.size()));
    const std::string_view word = current_.substr(0, current_.find_first_of(kSpace));
    current_.remove_prefix(word.size());
    if (copy.size() > line_start_) copy += ' ';
    copy += word;
    return word;
  }
  float number() {
    const std::string_view text = word();
    char* end = nullptr;  // a word ends before a space, a comment or the string's final zero
    const float value = text.empty() ? NAN : std::strtof(text.data(), &end);
    if (!std::isfinite(value) || end != text.data() + text.size() ||
        text.find_first_of("xX") != std::string_view::npos)
      fail(fmt::format("'{}' is not a finite number", text));
    return value;
  }
  Point point() {
    const float x = number(), y = number();
    return {x, y, number()};
  }
  std::optional<long long> try_integer(std::string_view text) {
    long long value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
  }
  long long integer() {
    const std::string_view text = word();
    const std::optional<long long> value = try_integer(text);
    if (!value) fail(fmt::format("'{}' is not an integer", text));
    return *value;
  }
  long long count() {
    const long long value = integer();
    if (value < 0 || value > kMost) fail("impossible counts");
    return value;
  }
  std::vector<int> face(long long vertices) {  ///< as OFF and PLY have it, with the number of corners first
    std::vector<int> corners;
    for (long long left = integer(); left > 0; --left) {
      const long long index = integer();
      if (index < 0 || index >= vertices)
        fail(fmt::format("there is no vertex {} (0 to {})", index, vertices - 1));
      corners.push_back(static_cast<int>(index));
    }
    return corners;
  }
  std::size_t triangles(const std::vector<int>& corners) {
    if (corners.size() < 3) fail(fmt::format("a face of {} vertices (at least three)", corners.size()));
    fan_.clear();
    add_fan(corners, fan_);
    return fan_.size();
  }
  void skip_line() { copy.resize(line_start_); }
  int line() const { return line_; }
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_, line_, what));
  }
  CheckedMeshFile found(std::optional<std::size_t> vertices, std::size_t triangles) {
    return {std::move(copy) + '\n', false, vertices, triangles, std::nullopt};
  }

  std::string copy;

 private:
  const std::string& file_;
  std::string_view rest_, current_;
  char comment_;
  int line_ = 0;
  std::size_t line_start_ = 0;  // in the copy
  std::vector<std::array<int, 3>> fan_;
};

CheckedMeshFile check_obj(const std::string& file, const std::string& contents) {
  Text text(file, contents, '#');
  long long vertices = 0, highest = 0;  // faces may refer to vertices further down
  std::size_t triangles = 0;
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
        const long long index = text.try_integer(word.substr(0, word.find('/'))).value_or(0);
        if (index == 0 || index < -vertices || index > kMost)
          text.fail(fmt::format("'{}' is not a vertex of a face (an index from 1, or from -1 down to -{})",
                                word, vertices));
        if (index > highest) highest = index, highest_line = text.line();
        corners.push_back(static_cast<int>(index > 0 ? index - 1 : vertices + index));
      }
      triangles += text.triangles(corners);
    } else {
      text.skip_line();
    }
  }
  if (highest > vertices)
    throw InputError(
        fmt::format("{}:{}: there is no vertex {} (the file has {})", file, highest_line, highest, vertices));
  return text.found(vertices, triangles);
}

CheckedMeshFile check_off(const std::string& file, const std::string& contents) {
  Text text(file, contents, '#');
  text.require_next();
  const std::string_view header = text.word(), rest = text.word();
  if (header != "OFF" && header != "COFF" && header != "NOFF" && header != "CNOFF" && header != "STOFF")
    text.fail("does not begin with OFF");
  if (!rest.empty())
    text.fail(fmt::format("'{}' after OFF (only text files in three dimensions are read)", rest));
  text.require_next();
  const long long vertices = text.count(), faces = text.count();
  text.copy = fmt::format("OFF\n{} {} 0", vertices, faces);
  for (long long v = 0; v < vertices; ++v) text.require_next(), text.point();
  std::size_t triangles = 0;
  for (long long f = 0; f < faces; ++f) text.require_next(), triangles += text.triangles(text.face(vertices));
  return text.found(vertices, triangles);
}

CheckedMeshFile check_ply(const std::string& file, std::string contents) {
  struct Property {
    bool list, kept;
  };
  struct Element {
    long long count;
    std::vector<Property> properties;
  };
  Text text(file, contents, '\0');
  text.require_next();
  if (text.word() != "ply") text.fail("does not begin with ply");
  std::string_view format, name;
  std::vector<Element> elements;
  std::set<std::string> known;
  long long vertices = 0, faces = 0;
  for (text.require_next();; text.require_next()) {
    const std::string_view keyword = text.word();
    if (keyword == "end_header") break;
    if (keyword == "format") {
      format = text.word();
      if (format != "ascii" && format != "binary_little_endian" && format != "binary_big_endian")
        text.fail(fmt::format("'{}' is not a format of PLY", format));
      text.word();  // the version
    } else if (keyword == "element") {
      name = text.word();
      elements.push_back({text.count(), {}});
      if (name == "vertex") {
        vertices = elements.back().count;
      } else if (name == "face") {
        faces = elements.back().count;
      } else {
        text.skip_line();
      }
    } else if (keyword == "property") {
      if (elements.empty()) text.fail("a property of no element");
      const bool list = text.word() == "list";
      if (list) text.word(), text.word();
      const std::string key = fmt::format("{} {}", name, text.word());
      const bool kept = list ? key == "face vertex_indices" || key == "face vertex_index"
                             : key == "vertex x" || key == "vertex y" || key == "vertex z";
      elements.back().properties.push_back({list, kept});
      if (kept) {
        known.insert(key);
      } else {
        text.skip_line();
      }
    } else {
      text.skip_line();
    }
  }
  if (format.empty()) text.fail("the header states no format");
  if (!known.count("vertex x") || !known.count("vertex y") || !known.count("vertex z"))
    text.fail("the header has no element vertex with properties x, y and z");
  if (!known.count("face vertex_indices") && !known.count("face vertex_index"))
    text.fail("has no faces (an element face with property vertex_indices)");
  if (format != "ascii") return {std::move(contents), true, vertices, std::nullopt, faces};
  std::size_t triangles = 0;
  for (const Element& element : elements) {
    for (long long i = 0; i < element.count; ++i) {
      text.require_next();
      for (const auto [list, kept] : element.properties) {
        const std::size_t copied = text.copy.size();
        if (kept && list) {
          triangles += text.triangles(text.face(vertices));
        } else if (kept) {
          text.number();
        } else {
          for (long long left = list ? text.integer() : 1; left > 0; --left) text.word();
          text.copy.resize(copied);
        }
      }
    }
  }
  return text.found(vertices, triangles);
}

/// OpenMesh leaves out facets with equal corners.
bool is_triangle(const Point* p) {
  return p[0] != p[1] && p[1] != p[2] && p[2] != p[0];
}

CheckedMeshFile check_stl(const std::string& file, std::string contents) {
  static_assert(std::endian::native == std::endian::little, "STL files are little-endian");
  constexpr std::size_t kHeader = 84, kFacet = 50, kNormal = 12;
  Point points[3];
  std::size_t triangles = 0;
  // A text file can begin like a binary one and the reverse; the size tells.
  std::uint32_t facets = 0;
  if (contents.size() >= kHeader) std::memcpy(&facets, contents.data() + kHeader - 4, sizeof facets);
  if (contents.size() >= kHeader && contents.size() == kHeader + kFacet * facets) {
    for (std::size_t f = 0; f < facets; ++f) {
      std::memcpy(points, contents.data() + kHeader + f * kFacet + kNormal, sizeof points);
      for (const Point& p : points) {
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
          throw InputError(
              fmt::format("{}: facet {} has a coordinate that is not a finite number", file, f + 1));
      }
      triangles += is_triangle(points);
    }
    return {std::move(contents), true, std::nullopt, triangles, std::nullopt};
  }
  Text text(file, contents, '\0');
  text.require_next();
  if (text.word() != "solid") text.fail("is neither text STL nor binary STL of the size its header states");
  std::size_t corners = 0;
  while (text.next()) {
    const std::string_view keyword = text.word();
    if (keyword == "vertex") {
      points[corners++ % 3] = text.point();
    } else if (keyword == "endloop") {
      if (corners != 3) text.fail(fmt::format("a facet of {} vertices (three)", corners));
      triangles += is_triangle(points);
      corners = 0;
    }
  }
  if (corners != 0) text.fail("the file ends within a facet");
  return text.found(std::nullopt, triangles);
}

}  // namespace

CheckedMeshFile check_mesh_file(const std::string& file, const std::string& extension, std::string contents) {
  return extension == ".obj"   ? check_obj(file, contents)
         : extension == ".off" ? check_off(file, contents)
         : extension == ".ply" ? check_ply(file, std::move(contents))
                               : check_stl(file, std::move(contents));
}

void add_fan(const std::vector<int>& corners, std::vector<std::array<int, 3>>& triangles) {
  for (std::size_t k = 2; k < corners.size(); ++k) {
    const int a = corners[0], b = corners[k - 1], c = corners[k];
    if (a != b && b != c && c != a) triangles.push_back({a, b, c});
  }
}

}  // namespace isochron
