// Text files of meshes, word by word; for the readers of mesh_file.h.
#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string_view>

#include "core/base/error.h"
#include "core/scene/mesh_file.h"

namespace isochron {

/// A text file's lines and words, and what the formats have in common.
class MeshText {
 public:
  static constexpr long long kMostItems = std::numeric_limits<int>::max();

  MeshText(const std::string& file, const std::string& contents, char comment)
      : file_(file), rest_(contents), comment_(comment) {}

  bool next() {  ///< goes to the next line that is not blank; false at the end
    while (!rest_.empty()) {
      current_ = rest_.substr(0, rest_.find('\n'));
      rest_.remove_prefix(std::min(current_.size() + 1, rest_.size()));
      ++line_;
      if (comment_ != '\0') current_ = current_.substr(0, current_.find(comment_));
      if (current_.find_first_not_of(kSpaces) == std::string_view::npos) continue;
      return true;
    }
    current_ = {};
    return false;
  }
  void require_next() {
    if (!next()) fail("the file ends too early");
  }
  std::string_view word() {  ///< the line's next word; empty at its end
    current_.remove_prefix(std::min(current_.find_first_not_of(kSpaces), current_.size()));
    const std::string_view word = current_.substr(0, current_.find_first_of(kSpaces));
    current_.remove_prefix(word.size());
    return word;
  }
  float number() {
    const std::string_view text = word();
    char* end = nullptr;  // a word ends before a space, a comment or the string's final zero
    const float value = text.empty() ? NAN : std::strtof(text.data(), &end);
    if (!std::isfinite(value) || end != text.data() + text.size() || text.find_first_of("xX") != std::string_view::npos)
      fail(fmt::format("{} is not a finite number", quote(text)));
    return value;
  }
  std::array<float, 3> point() {
    const float x = number(), y = number();
    return {x, y, number()};
  }
  static std::optional<long long> try_integer(std::string_view text) {
    long long value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
  }
  long long integer() {
    const std::string_view text = word();
    const std::optional<long long> value = try_integer(text);
    if (!value) fail(fmt::format("{} is not an integer", quote(text)));
    return *value;
  }
  long long count() {
    const long long value = integer();
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
  void add_face(const std::vector<int>& corners, PolygonMesh& mesh) {
    if (corners.size() < 3) fail(fmt::format("a face of {} vertices (at least three)", corners.size()));
    mesh.add_polygon(corners);
  }
  std::string_view rest() const { return rest_; }  ///< behind the line
  int line() const { return line_; }
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_, line_, what));
  }

 private:
  static constexpr std::string_view kSpaces = " \t\r\f\v";

  const std::string& file_;
  std::string_view rest_, current_;
  char comment_;
  int line_ = 0;
};

}  // namespace isochron
