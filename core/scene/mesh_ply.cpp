#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <set>
#include <string_view>

#include "core/base/error.h"
#include "core/scene/mesh_file.h"
#include "core/scene/mesh_text.h"

namespace isochron {
namespace {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
constexpr std::size_t kSize[] = {1, 1, 2, 2, 4, 4, 4, 8};

struct Property {
  bool list;
  Scalar count, type;  ///< count: of lists
  int axis = -1;       ///< of a coordinate
  bool corners = false;
};

struct Element {
  std::string name;
  long long count;
  std::vector<Property> properties;
};

struct Header {
  std::string format;
  std::vector<Element> elements;
  long long vertices = 0;
};

Scalar find_scalar(const MeshText& text, std::string_view word) {
  constexpr std::string_view kNames[] = {"char", "uchar", "short", "ushort", "int",   "uint",   "float",   "double",
                                         "int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"};
  const auto found = std::find(std::begin(kNames), std::end(kNames), word);
  if (found == std::end(kNames)) text.fail(fmt::format("{} is not a type of PLY", quote(word)));
  return static_cast<Scalar>((found - std::begin(kNames)) % std::size(kSize));
}

void read_property(MeshText& text, Header& header, std::set<std::string>& known) {
  if (header.elements.empty()) text.fail("a property of no element");
  Element& element = header.elements.back();
  Property property{};
  std::string_view type = text.word();
  property.list = type == "list";
  if (property.list) property.count = find_scalar(text, text.word()), type = text.word();
  property.type = find_scalar(text, type);
  std::string name(text.word());
  if (property.list && element.name == "face" && (name == "vertex_indices" || name == "vertex_index")) {
    property.corners = true;
    name = "vertex_indices";
  } else if (!property.list && element.name == "vertex" && (name == "x" || name == "y" || name == "z")) {
    property.axis = name[0] - 'x';
  }
  if ((property.corners || property.axis >= 0) && !known.insert(name).second) text.fail(name + " is given twice");
  element.properties.push_back(property);
}

Header read_header(MeshText& text) {
  Header header;
  std::set<std::string> known;
  text.require_next();
  if (text.word() != "ply") text.fail("does not begin with ply");
  for (text.require_next();; text.require_next()) {
    const std::string_view keyword = text.word();
    if (keyword == "end_header") break;
    if (keyword == "format") {
      header.format = text.word();
      if (header.format != "ascii" && header.format != "binary_little_endian" && header.format != "binary_big_endian")
        text.fail(fmt::format("{} is not a format of PLY", quote(header.format)));
    } else if (keyword == "element") {
      const std::string name(text.word());
      header.elements.push_back({name, text.count(), {}});
      if (name != "vertex" && name != "face") continue;
      if (!known.insert("element " + name).second) text.fail("element " + name + " is given twice");
      if (name == "vertex") header.vertices = header.elements.back().count;
    } else if (keyword == "property") {
      read_property(text, header, known);
    }
  }
  if (header.format.empty()) text.fail("the header states no format");
  if (!known.contains("x") || !known.contains("y") || !known.contains("z"))
    text.fail("the header has no element vertex with properties x, y and z");
  if (!known.contains("vertex_indices")) text.fail("has no faces (an element face with property vertex_indices)");
  return header;
}

PolygonMesh read_text(MeshText& text, const Header& header) {
  PolygonMesh mesh;
  for (const Element& element : header.elements) {
    for (long long i = 0; i < element.count; ++i) {
      text.require_next();
      Vec3 point;
      for (const Property& property : element.properties) {
        if (property.corners) {
          text.add_face(text.face(header.vertices), mesh);
        } else if (property.axis >= 0) {
          point[property.axis] = text.number();
        } else {
          for (long long left = property.list ? text.count() : 1; left > 0; --left)
            if (text.word().empty()) text.fail("the line ends too early");
        }
      }
      if (element.name == "vertex") mesh.positions.push_back(point);
    }
  }
  return mesh;
}

/// The numbers behind a binary file's header.
class Bytes {
 public:
  Bytes(const std::string& file, std::string_view rest, bool big_endian)
      : file_(file), rest_(rest), big_endian_(big_endian) {}

  void skip(double count, Scalar type) {
    const double size = count * static_cast<double>(kSize[static_cast<int>(type)]);
    if (size > static_cast<double>(rest_.size())) throw InputError(file_ + ": the file ends too early");
    rest_.remove_prefix(static_cast<std::size_t>(size));
  }
  double number(Scalar type) {  // a double holds every scalar of PLY
    switch (type) {
      case Scalar::int8:
        return take<std::int8_t>(type);
      case Scalar::uint8:
        return take<std::uint8_t>(type);
      case Scalar::int16:
        return take<std::int16_t>(type);
      case Scalar::uint16:
        return take<std::uint16_t>(type);
      case Scalar::int32:
        return take<std::int32_t>(type);
      case Scalar::uint32:
        return take<std::uint32_t>(type);
      case Scalar::float32:
        return take<float>(type);
      case Scalar::float64:
        return take<double>(type);
    }
    throw std::logic_error("unknown type of PLY");
  }
  double list_size(Scalar type) {
    const double count = number(type);
    if (!(count >= 0) || count != std::floor(count))
      throw InputError(fmt::format("{}: a list of {} entries", file_, count));
    return count;
  }

 private:
  template <class T>
  T take(Scalar type) {
    const std::string_view at = rest_;
    skip(1, type);
    char raw[sizeof(T)];
    std::memcpy(raw, at.data(), sizeof(T));
    if (big_endian_) std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
  }

  const std::string& file_;
  std::string_view rest_;
  bool big_endian_;
};

PolygonMesh read_binary(const std::string& file, const Header& header, std::string_view rest) {
  Bytes bytes(file, rest, header.format == "binary_big_endian");
  PolygonMesh mesh;
  std::vector<int> corners;
  for (const Element& element : header.elements) {
    if (element.properties.empty()) continue;
    for (long long i = 0; i < element.count; ++i) {
      Vec3 point;
      for (const Property& property : element.properties) {
        if (property.corners) {
          corners.clear();
          for (double left = bytes.list_size(property.count); left > 0; --left) {
            const double index = bytes.number(property.type);
            if (!(index >= 0 && index < static_cast<double>(header.vertices)) || index != std::floor(index))
              throw InputError(fmt::format("{}: there is no vertex {} (0 to {})", file, index, header.vertices - 1));
            corners.push_back(static_cast<int>(index));
          }
          if (corners.size() < 3)
            throw InputError(fmt::format("{}: face {} has {} vertices (at least three)", file, i, corners.size()));
          mesh.add_polygon(corners);
        } else if (property.axis >= 0) {
          const double value = bytes.number(property.type);
          if (!std::isfinite(value))
            throw InputError(fmt::format("{}: vertex {} has a coordinate that is not a finite number", file, i));
          point[property.axis] = value;
        } else {
          bytes.skip(property.list ? bytes.list_size(property.count) : 1, property.type);
        }
      }
      if (element.name == "vertex") mesh.positions.push_back(point);
    }
  }
  return mesh;
}

}  // namespace

PolygonMesh read_ply(const std::string& file, const std::string& contents) {
  MeshText text(file, contents, {});
  const Header header = read_header(text);
  return header.format == "ascii" ? read_text(text, header) : read_binary(file, header, text.rest());
}

}  // namespace isochron
