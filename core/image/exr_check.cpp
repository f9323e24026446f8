#include "core/image/exr_check.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/base/file.h"

namespace isochron {
namespace {

static_assert(std::endian::native == std::endian::little, "EXR files are little-endian");

/// The attributes of every EXR file. A size of zero: a list of channels.
struct Required {
  std::string_view name, type;
  std::size_t size;
};
constexpr Required kRequired[] = {
    {"channels", "chlist", 0},        {"compression", "compression", 1}, {"dataWindow", "box2i", 16},
    {"displayWindow", "box2i", 16},   {"lineOrder", "lineOrder", 1},     {"pixelAspectRatio", "float", 4},
    {"screenWindowCenter", "v2f", 8}, {"screenWindowWidth", "float", 4},
};

class Bytes {
 public:
  explicit Bytes(std::string_view rest) : rest_(rest) {}
  bool empty() const { return rest_.empty(); }
  std::string_view take(std::size_t size) {
    if (size > rest_.size()) throw std::runtime_error("the header ends too early");
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }
  std::int32_t integer() {
    std::int32_t value = 0;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }
  std::string_view text() {  ///< up to a zero
    const std::string_view word = take(std::min(rest_.find('\0'), rest_.size()));
    take(1);
    return word;
  }

 private:
  std::string_view rest_;
};

/// How many channels a list has; empty where it is none.
std::optional<int> count_channels(std::string_view value) {
  constexpr std::size_t kChannel = 16;
  Bytes bytes(value);
  int count = 0;
  for (; !bytes.text().empty(); ++count) bytes.take(kChannel);
  return bytes.empty() ? std::optional(count) : std::nullopt;
}

/// OpenEXR makes room for a row of tiles before it looks at them.
void require_small_tiles(std::string_view tiles, std::string_view window, int channels) {
  constexpr double kMostBytes = 1 << 29, kSample = 4;
  Bytes sizes(tiles), corners(window);
  const std::int32_t across = sizes.integer(), down = sizes.integer();
  const std::int32_t left = corners.integer();
  corners.integer();  // the top
  const std::int32_t right = corners.integer();
  if (across < 1 || down < 1 || (double{1} * right - left + across) * down * channels * kSample > kMostBytes)
    throw std::runtime_error("its tiles of " + std::to_string(across) + " x " + std::to_string(down) +
                             " pixels are none, or too large (a row of them: half a gigabyte)");
}

}  // namespace

std::string read_checked_exr(const std::string& file) {
  std::string problem;
  std::optional<std::string> read = read_regular_file(file, problem);
  if (!read) throw InputError(file + ": " + problem);
  std::string contents = std::move(*read);

  constexpr std::int32_t kMagic = 20000630, kTiled = 0x200, kDeep = 0x800, kParts = 0x1000;
  constexpr std::size_t kTileDescription = 9;
  Bytes bytes(contents);
  if (bytes.integer() != kMagic) throw std::runtime_error("it does not begin like one");
  const std::int32_t flags = bytes.integer();
  if ((flags & kDeep) != 0) throw std::runtime_error("it is deep (allowed: one value per pixel and channel)");
  if ((flags & kParts) != 0)
    throw std::runtime_error("it has several parts (allowed: one image, in scanlines or tiles)");
  const bool tiled = (flags & kTiled) != 0;
  std::string_view tiles, window;
  int channels = 0;
  for (std::string_view name; !(name = bytes.text()).empty();) {
    const std::string_view type = bytes.text();
    const std::int32_t size = bytes.integer();
    const std::string_view value = bytes.take(static_cast<std::uint32_t>(size));
    const Required* known = nullptr;
    for (const Required& required : kRequired)
      if (required.name == name) known = &required;
    if (name == "dataWindow") window = value;
    if (name == "channels") channels = count_channels(value).value_or(0);
    if (tiled && name == "tiles") {
      if (type != "tiledesc" || value.size() != kTileDescription)
        throw std::runtime_error("its attribute tiles is damaged");
      tiles = value;
    } else if (known == nullptr) {
      if (!type.empty()) contents[static_cast<std::size_t>(type.data() - contents.data())] = '\1';
    } else if (known->type != type || (known->size != 0 ? value.size() != known->size : !count_channels(value))) {
      throw std::runtime_error("its attribute " + std::string(name) + " is damaged");
    }
  }
  if (tiled && tiles.empty()) throw std::runtime_error("its attribute tiles is missing");
  if (tiled && !window.empty()) require_small_tiles(tiles, window, channels);
  return contents;
}

}  // namespace isochron
