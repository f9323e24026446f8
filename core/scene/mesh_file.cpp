#include "core/scene/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/math/error.h"

namespace isochron {
namespace {

constexpr std::string_view kSpace = " \t\r\f\v";

/// Wavefront OBJ: `v` and `f` lines; texture coordinates, normals, groups, lines and materials do not matter
/// here.
Mesh read_obj(const std::string& file, const std::string& contents) {
  Mesh mesh;
  LineReader lines(file, contents, '#');
  std::vector<int> corners;
  int highest = -1, highest_line = 0;  // faces may refer to vertices further down
  while (lines.next()) {
    const std::string_view keyword = lines.word();
    if (keyword == "v") {
      mesh.positions.push_back(lines.point());
    } else if (keyword == "f") {
      const auto count = static_cast<long long>(mesh.positions.size());
      corners.clear();
      for (std::string_view word = lines.word(); !word.empty(); word = lines.word()) {
        const std::string_view digits = word.substr(0, word.find('/'));
        long long index = 0;
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
        if (error != std::errc() || end != digits.data() + digits.size() || index == 0 || index < -count ||
            index > INT32_MAX)
          lines.fail(fmt::format("'{}' is not a vertex of a face (an index from 1, or from -1 down to -{})",
                                 word, count));
        corners.push_back(static_cast<int>(index > 0 ? index - 1 : count + index));
        if (corners.back() > highest) highest = corners.back(), highest_line = lines.line();
      }
      if (corners.size() < 3)
        lines.fail(fmt::format("a face of {} vertices (at least three)", corners.size()));
      add_polygon(corners, mesh);
    }
  }
  if (highest >= static_cast<int>(mesh.positions.size()))
    throw InputError(fmt::format("{}:{}: there is no vertex {} (the file has {})", file, highest_line,
                                 highest + 1, mesh.positions.size()));
  return mesh;
}

/// Object File Format, text: OFF with any of its prefixes ST, C, N (what they add is skipped).
Mesh read_off(const std::string& file, const std::string& contents) {
  Mesh mesh;
  LineReader lines(file, contents, '#');
  lines.require_next();
  const std::string_view header = lines.word();
  if (header != "OFF" && header != "COFF" && header != "NOFF" && header != "CNOFF" && header != "STOFF")
    lines.fail("does not begin with OFF");
  std::string_view word = lines.word();
  if (!word.empty())
    lines.fail(fmt::format("'{}' after OFF (only text files in three dimensions are read)", word));
  lines.require_next();
  const long long vertices = lines.integer(), faces = lines.integer();
  if (vertices < 0 || vertices > INT32_MAX || faces < 0 || faces > INT32_MAX) lines.fail("impossible counts");
  for (long long v = 0; v < vertices; ++v) {
    lines.require_next();
    mesh.positions.push_back(lines.point());
  }
  for (long long f = 0; f < faces; ++f) {
    lines.require_next();
    const long long corners = lines.integer();
    read_indexed_face(lines, corners, mesh.positions.size(), mesh);
  }
  return mesh;
}

Mesh read_binary_stl(const std::string& file, const std::string& contents, std::uint32_t faces) {
  static_assert(std::endian::native == std::endian::little, "STL files are little-endian");
  constexpr std::size_t kHeader = 84, kFace = 50, kNormal = 12;
  Mesh mesh;
  for (std::uint32_t f = 0; f < faces; ++f) {
    float points[9];
    std::memcpy(points, contents.data() + kHeader + f * kFace + kNormal, sizeof points);
    const int v = static_cast<int>(mesh.positions.size());
    for (int k = 0; k < 9; k += 3) {
      mesh.positions.push_back({points[k], points[k + 1], points[k + 2]});
      const Vec3& p = mesh.positions.back();
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
        throw InputError(
            fmt::format("{}: facet {} has a coordinate that is not a finite number", file, f + 1));
    }
    mesh.faces.push_back({v, v + 1, v + 2});
  }
  return mesh;
}

Mesh read_stl(const std::string& file, const std::string& contents) {
  // A text file can begin like a binary one and the reverse; the size tells.
  std::uint32_t faces = 0;
  if (contents.size() >= 84) std::memcpy(&faces, contents.data() + 80, sizeof faces);
  if (contents.size() >= 84 && contents.size() == 84 + 50 * static_cast<std::uint64_t>(faces))
    return read_binary_stl(file, contents, faces);
  Mesh mesh;
  LineReader lines(file, contents, '\0');
  lines.require_next();
  if (lines.word() != "solid") lines.fail("is neither text STL nor binary STL of the size its header states");
  std::vector<int> corners;
  while (lines.next()) {
    const std::string_view keyword = lines.word();
    if (keyword == "vertex") {
      corners.push_back(static_cast<int>(mesh.positions.size()));
      mesh.positions.push_back(lines.point());
    } else if (keyword == "endloop") {
      if (corners.size() != 3) lines.fail(fmt::format("a facet of {} vertices (three)", corners.size()));
      add_polygon(corners, mesh);
      corners.clear();
    }
  }
  if (!corners.empty()) lines.fail("the file ends within a facet");
  return mesh;
}

}  // namespace

bool LineReader::next() {
  while (at_ < text_.size()) {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    current_ = text_.substr(at_, end - at_);
    at_ = std::min(end + 1, text_.size());
    ++line_;
    if (comment_ != '\0') current_ = current_.substr(0, current_.find(comment_));
    if (current_.find_first_not_of(kSpace) != std::string_view::npos) return true;
  }
  current_ = {};
  return false;
}

void LineReader::require_next() {
  if (!next()) fail("the file ends too early");
}

std::string_view LineReader::word() {
  current_.remove_prefix(std::min(current_.find_first_not_of(kSpace), current_.size()));
  const std::string_view word = current_.substr(0, current_.find_first_of(kSpace));
  current_.remove_prefix(word.size());
  return word;
}

double LineReader::number() {
  const std::string_view text = word();
  const std::string_view digits = text.substr(text.size() > 1 && text[0] == '+' && text[1] != '-');
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool whole = end == digits.data() + digits.size() && !digits.empty();
  // Out of range can mean too small, which is as good as the zero that strtod rounds it to.
  if (error == std::errc::result_out_of_range) value = std::strtod(std::string(digits).c_str(), nullptr);
  if (!whole || error == std::errc::invalid_argument || !std::isfinite(value))
    fail(fmt::format("'{}' is not a finite number", text));
  return value;
}

long long LineReader::integer() {
  const std::string_view text = word();
  long long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size())
    fail(fmt::format("'{}' is not an integer", text));
  return value;
}

Vec3 LineReader::point() {
  const double x = number(), y = number(), z = number();
  return {x, y, z};
}

void LineReader::fail(const std::string& what) const {
  throw InputError(fmt::format("{}:{}: {}", file_, line_, what));
}

void add_polygon(const std::vector<int>& corners, Mesh& mesh) {
  for (std::size_t k = 2; k < corners.size(); ++k)
    mesh.faces.push_back({corners[0], corners[k - 1], corners[k]});
}

void read_indexed_face(LineReader& lines, long long corners, std::size_t vertices, Mesh& mesh) {
  if (corners < 3) lines.fail(fmt::format("a face of {} vertices (at least three)", corners));
  std::vector<int> polygon;
  for (long long k = 0; k < corners; ++k) {
    const long long index = lines.integer();
    if (index < 0 || index >= static_cast<long long>(vertices))
      lines.fail(fmt::format("there is no vertex {} (0 to {})", index, static_cast<long long>(vertices) - 1));
    polygon.push_back(static_cast<int>(index));
  }
  add_polygon(polygon, mesh);
}

Mesh read_mesh(const std::string& file) {
  std::string extension = std::filesystem::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension != ".obj" && extension != ".off" && extension != ".ply" && extension != ".stl")
    throw InputError(
        fmt::format("{}: '{}' is not a kind of mesh (allowed: .obj, .ply, .off, .stl)", file, extension));
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) throw InputError(file + ": is a folder");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file + ": cannot be opened: " + std::strerror(errno));
  std::ostringstream buffer;
  if (stream.peek() != std::ifstream::traits_type::eof()) buffer << stream.rdbuf();
  if (stream.bad() || !buffer) throw InputError(file + ": cannot be read");
  const std::string contents = std::move(buffer).str();

  Mesh mesh = extension == ".obj"   ? read_obj(file, contents)
              : extension == ".off" ? read_off(file, contents)
              : extension == ".ply" ? read_ply(file, contents)
                                    : read_stl(file, contents);
  if (mesh.faces.empty()) throw InputError(file + ": has no faces");
  return mesh;
}

}  // namespace isochron
