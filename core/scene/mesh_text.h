// Text files of meshes, word by word; for the readers of mesh_file.h.
#pragma once
#include <fmt/format.h>

#include <limits>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/base/text_lines.h"
#include "core/scene/mesh_file.h"

namespace isochron {

/// What the formats have in common.
class MeshText : public TextLines {
 public:
  static constexpr long long kMostItems = std::numeric_limits<int>::max();

  using TextLines::TextLines;

  double number() {
    const std::string_view text = word();
    const std::optional<double> value = parse_number(text);
    if (!value) fail(fmt::format("{} is not a finite number", quote(text)));
    return *value;
  }
  Vec3 point() {
    const double x = number(), y = number();
    return {x, y, number()};
  }
  long long integer() { return integer_of(word()); }
  long long integer_of(std::string_view text) const {
    const std::optional<long long> value = parse_integer(text);
    if (!value) fail(fmt::format("{} is not an integer", quote(text)));
    return *value;
  }
  long long count() { return count_of(word()); }
  long long count_of(std::string_view text) const {
    const long long value = integer_of(text);
    if (value < 0 || value > kMostItems) fail("impossible counts");
    return value;
  }
  std::vector<int> face(long long vertices) {  ///< as OFF and PLY have it, with the number of corners first
    std::vector<int> corners;
    for (long long left = integer(); left > 0; --left) {
      const long long index = integer();
      if (index < 0 || index >= vertices) fail(fmt::format("there is no vertex {} (0 to {})", index, vertices - 1));
      corners.push_back(static_cast<int>(index));
    }
    return corners;
  }
  void add_face(const std::vector<int>& corners, PolygonMesh& mesh) const {
    if (corners.size() < 3) fail(fmt::format("a face of {} vertices (at least three)", corners.size()));
    mesh.add_polygon(corners);
  }
};

}  // namespace isochron
