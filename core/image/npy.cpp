#include "core/image/npy.h"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <string_view>

#include "core/base/error.h"
#include "core/base/file.h"

namespace isochron {
namespace {

static_assert(std::endian::native == std::endian::little);

struct ElementType {
  std::size_t size;
  double (*read)(const char*);
};

template <class T>
ElementType element_type() {
  return {sizeof(T), [](const char* from) {
            T value;
            std::memcpy(&value, from, sizeof(T));
            return static_cast<double>(value);
          }};
}

/// By the kind and size that a descriptor ends with.
const std::map<std::string, ElementType, std::less<>>& element_types() {
  static const std::map<std::string, ElementType, std::less<>> types = {
      {"b1", element_type<std::uint8_t>()},  {"u1", element_type<std::uint8_t>()},
      {"u2", element_type<std::uint16_t>()}, {"u4", element_type<std::uint32_t>()},
      {"u8", element_type<std::uint64_t>()}, {"i1", element_type<std::int8_t>()},
      {"i2", element_type<std::int16_t>()},  {"i4", element_type<std::int32_t>()},
      {"i8", element_type<std::int64_t>()},  {"f4", element_type<float>()},
      {"f8", element_type<double>()}};
  return types;
}

/// What follows "'key':" in the header, a Python dictionary as NumPy writes it; empty where there is none.
std::string_view entry(std::string_view header, const std::string& key) {
  const std::string name = "'" + key + "':";
  const std::size_t at = header.find(name);
  if (at == std::string_view::npos) return {};
  header.remove_prefix(at + name.size());
  header.remove_prefix(std::min(header.find_first_not_of(' '), header.size()));
  return header;
}

std::optional<std::vector<std::size_t>> parse_shape(std::string_view text) {
  const std::size_t end = text.find(')');
  if (text.empty() || text[0] != '(' || end == std::string_view::npos) return std::nullopt;
  std::vector<std::size_t> shape;
  for (const char *at = text.data() + 1, *last = text.data() + end; at < last;) {
    if (*at == ' ' || *at == ',') {
      ++at;
      continue;
    }
    std::size_t extent = 0;
    const auto parsed = std::from_chars(at, last, extent);
    if (parsed.ec != std::errc()) return std::nullopt;
    shape.push_back(extent);
    at = parsed.ptr;
  }
  return shape;
}

/// The header without what comes before it, and where the elements begin.
std::optional<std::pair<std::string_view, std::size_t>> find_header(std::string_view contents) {
  constexpr std::string_view kMagic = "\x93NUMPY";
  if (!contents.starts_with(kMagic) || contents.size() < 12) return std::nullopt;
  const std::size_t width = contents[6] == 1 ? 2 : 4, begin = 8 + width;
  std::uint32_t length = 0;
  std::memcpy(&length, contents.data() + 8, width);
  if (contents.size() < begin + length) return std::nullopt;
  return std::pair{contents.substr(begin, length), begin + length};
}

}  // namespace

NumberArray read_npy(const std::string& file) {
  const auto fail = [&](const std::string& what) { throw InputError(file + ": " + what); };
  std::string problem;
  const std::optional<std::string> contents = read_regular_file(file, problem);
  if (!contents) fail(problem);
  const auto found = find_header(*contents);
  if (!found) fail("is no NumPy array (allowed: .npy as numpy.save writes it)");
  const auto& [header, begin] = *found;

  const std::string_view descriptor = entry(header, "descr");
  const std::string_view type =
      descriptor.size() > 1 && descriptor[0] == '\'' ? descriptor.substr(1, descriptor.find('\'', 1) - 1) : "";
  const bool little = type.size() == 3 && (type[0] == '<' || type[0] == '|');
  const auto known = element_types().find(little ? type.substr(1) : "");
  if (known == element_types().end())
    fail(fmt::format("holds elements of type {} (allowed: booleans, integers and 32 or 64-bit floats, little-endian)",
                     quote(type)));
  const ElementType& element = known->second;
  const auto shape = parse_shape(entry(header, "shape"));
  const std::string_view order = entry(header, "fortran_order");
  if (!shape || !(order.starts_with("True") || order.starts_with("False"))) fail("its header cannot be read");

  const std::size_t available = (contents->size() - begin) / element.size;
  std::size_t count = 1;
  for (const std::size_t extent : *shape) {
    if (extent > 0 && count > available / extent)
      fail(fmt::format("ends before its {} elements", fmt::join(*shape, " x ")));
    count *= extent;
  }
  NumberArray array{*shape, std::vector<double>(count)};
  // Fortran's order has the first index fastest.
  std::vector<std::size_t> stride(shape->size(), 1), index(shape->size(), 0);
  const bool fortran = order.starts_with("True");
  for (std::size_t k = 1; k < shape->size(); ++k) {
    const std::size_t axis = fortran ? k : shape->size() - 1 - k, before = fortran ? axis - 1 : axis + 1;
    stride[axis] = stride[before] * (*shape)[before];
  }
  for (double& value : array.values) {
    std::size_t at = 0;
    for (std::size_t axis = 0; axis < index.size(); ++axis) at += index[axis] * stride[axis];
    value = element.read(contents->data() + begin + at * element.size);
    for (std::size_t axis = index.size(); axis-- > 0 && ++index[axis] == (*shape)[axis];) index[axis] = 0;
  }
  return array;
}

std::string npy_of_pixels(int columns, int rows, const std::vector<std::uint8_t>& values) {
  std::string header = fmt::format("{{'descr': '|u1', 'fortran_order': True, 'shape': ({}, {}), }}", columns, rows);
  constexpr std::size_t kBefore = 10, kAligned = 64;  // bytes before the header; elements begin at a multiple of
  header.resize((kBefore + header.size()) / kAligned * kAligned + kAligned - kBefore, ' ');
  header.back() = '\n';
  std::string contents = "\x93NUMPY\x01";
  contents += '\0';
  for (const std::size_t byte : {header.size() % 256, header.size() / 256}) contents += static_cast<char>(byte);
  return contents + header + std::string(values.begin(), values.end());
}

}  // namespace isochron
