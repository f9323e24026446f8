#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "core/base/error.h"
#include "core/base/file.h"
#include "core/image/exr_check.h"
#include "core/image/image.h"

namespace isochron {
namespace {

constexpr char kRgb[] = {'R', 'G', 'B'};

std::string gate_channel(int gate, char letter) {
  return fmt::format("gate{:03}.{}", gate, letter);
}

/// A named channel of one float per pixel.
struct Plane {
  std::string name;
  std::vector<float> values;
};

void write_planes(const std::string& file, int width, int height, const std::vector<Plane>& planes,
                  const ExrNotes& notes) {
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const auto& [name, text] : notes) header.insert(name, Imf::StringAttribute(text));
  Imf::FrameBuffer buffer;
  for (const Plane& plane : planes) {
    header.channels().insert(plane.name, Imf::Channel(Imf::FLOAT));
    // OpenEXR asks for a pointer to what it only reads.
    char* base = reinterpret_cast<char*>(const_cast<float*>(plane.values.data()));
    buffer.insert(plane.name, Imf::Slice(Imf::FLOAT, base, sizeof(float), sizeof(float) * width));
  }
  Imf::StdOSStream stream;
  {
    Imf::OutputFile output(stream, header);
    output.setFrameBuffer(buffer);
    output.writePixels(height);
  }  // the table of offsets is written on destruction
  write_file_atomically(file, stream.str());
}

void require_pixels(const GatedImage& image) {
  if (image.width < 1 || image.height < 1 || image.gates < 1 || (image.channels != 1 && image.channels != 3))
    throw std::invalid_argument("an image to be written needs pixels, gates, and one or three channels");
}

[[noreturn]] void fail(const std::string& file, const std::string& what) {
  throw InputError(file + ": " + what);
}

struct ChannelName {
  int gate;
  char letter;
};

std::optional<ChannelName> parse_channel(std::string_view name) {
  constexpr std::string_view kPrefix = "gate";
  if (!name.starts_with(kPrefix) || name.size() < kPrefix.size() + 5) return {};
  const char letter = name.back();
  int gate = -1;
  std::from_chars(name.data() + kPrefix.size(), name.data() + name.size() - 2, gate);
  // Writing it again catches everything but the one way to name a gate.
  if (gate < 0 || gate_channel(gate, letter) != name) return {};
  return std::string_view("RGBY").find(letter) == std::string_view::npos ? std::nullopt
                                                                         : std::optional(ChannelName{gate, letter});
}

/// Whether a channel is one of opacity, beside the colours of its layer: those are multiplied by it already.
bool is_alpha(std::string_view name) {
  return name == "A" || name.ends_with(".A");
}

/// Whether the channels are those of an image without gates: one of the letters that gates have, without a layer.
bool is_plain(const Imf::ChannelList& list) {
  return list.findChannel("Y") != nullptr || list.findChannel("R") != nullptr || list.findChannel("G") != nullptr ||
         list.findChannel("B") != nullptr;
}

/// The name of a gate's channel, or of that of an image without gates.
std::string channel_name(bool plain, int gate, char letter) {
  return plain ? std::string(1, letter) : gate_channel(gate, letter);
}

/// Checks that the channels are those of whole gates without a gap; sets `gates` and `channels`.
void check_channels(const std::string& file, const Imf::ChannelList& list, GatedImage& image) {
  const bool plain = is_plain(list);
  if (list.findChannel("RY") != nullptr || list.findChannel("BY") != nullptr)
    fail(file, "holds luminance and chroma (channels Y, RY, BY; allowed: R, G, B)");
  for (auto channel = list.begin(); channel != list.end(); ++channel) {
    if (is_alpha(channel.name())) continue;
    const std::string full = plain && std::string_view(channel.name()).size() == 1
                                 ? gate_channel(0, channel.name()[0])
                                 : std::string(plain ? "" : channel.name());
    const std::optional<ChannelName> name = parse_channel(full);
    if (!name)
      fail(file, fmt::format("channel {} is not one of a gated image (gateNNN.Y, or gateNNN.R, .G, .B; for one gate Y, "
                             "or R, G, B; alpha is left out)",
                             quote(channel.name())));
    const int channels = name->letter == 'Y' ? 1 : 3;
    if (image.channels != 0 && image.channels != channels)
      fail(file, fmt::format("channel {} mixes grey and colour", quote(channel.name())));
    if (channel.channel().type == Imf::UINT)
      fail(file, fmt::format("channel {} holds integers (half or float)", quote(channel.name())));
    if (channel.channel().xSampling != 1 || channel.channel().ySampling != 1)
      fail(file, fmt::format("channel {} is subsampled", quote(channel.name())));
    image.channels = channels;
    image.gates = std::max(image.gates, name->gate + 1);
  }
  if (image.gates == 0) fail(file, "has no channel but alpha");
  for (int gate = 0; gate < image.gates; ++gate) {
    for (int c = 0; c < image.channels; ++c) {
      const std::string name = channel_name(plain, gate, image.channels == 1 ? 'Y' : kRgb[c]);
      if (list.findChannel(name) == nullptr)
        fail(file, fmt::format("channel '{}' is missing (gates 0 to {})", name, image.gates - 1));
    }
  }
}

GatedImage read_planes(const std::string& file) {
  constexpr int kLargestSize = 32768;  // as of a camera
  Imf::Header::setMaxImageSize(kLargestSize, kLargestSize);
  Imf::StdISStream stream;
  stream.str(read_checked_exr(file));
  Imf::InputFile input(stream);
  const auto& window = input.header().dataWindow();
  if (window != input.header().displayWindow()) fail(file, "is cropped (data window and display window differ)");
  GatedImage image;
  check_channels(file, input.header().channels(), image);
  const bool plain = is_plain(input.header().channels());
  image.width = window.max.x - window.min.x + 1;
  image.height = window.max.y - window.min.y + 1;

  const std::size_t planes = static_cast<std::size_t>(image.gates) * image.channels;
  std::vector<float> row(planes * image.width);
  Imf::FrameBuffer buffer;
  for (std::size_t p = 0; p < planes; ++p) {
    const int gate = static_cast<int>(p) / image.channels, channel = static_cast<int>(p) % image.channels;
    // One row for all scanlines (no stride in y); pixels beside each other as in the image.
    char* base =
        reinterpret_cast<char*>(row.data() + p) - sizeof(float) * planes * static_cast<std::ptrdiff_t>(window.min.x);
    buffer.insert(channel_name(plain, gate, image.channels == 1 ? 'Y' : kRgb[channel]),
                  Imf::Slice(Imf::FLOAT, base, sizeof(float) * planes, 0));
  }
  input.setFrameBuffer(buffer);
  for (int y = 0; y < image.height; ++y) {
    input.readPixels(window.min.y + y);
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (!std::isfinite(row[i]))
        fail(file, fmt::format("{} in row {}, column {}, gate {}", row[i], y, i / planes,
                               static_cast<int>(i % planes) / image.channels));
    }
    // Grows with what was found, not to what a damaged header declares.
    image.data.insert(image.data.end(), row.begin(), row.end());
  }
  return image;
}

}  // namespace

void write_exr(const std::string& file, const GatedImage& image, const ExrNotes& notes) {
  require_pixels(image);
  std::vector<Plane> planes;
  for (int gate = 0; gate < image.gates; ++gate) {
    for (int channel = 0; channel < image.channels; ++channel) {
      Plane plane{gate_channel(gate, image.channels == 1 ? 'Y' : kRgb[channel]), {}};
      plane.values.reserve(image.pixels());
      for (int pixel = 0; pixel < image.pixels(); ++pixel)
        plane.values.push_back(static_cast<float>(image.at(pixel, gate, channel)));
      planes.push_back(std::move(plane));
    }
  }
  write_planes(file, image.width, image.height, planes, notes);
}

void write_exr_components(const std::string& file, const std::vector<std::string>& components,
                          const std::vector<GatedImage>& images, const ExrNotes& notes) {
  if (components.empty() || components.size() != images.size())
    throw std::invalid_argument("one image per component is needed");
  std::vector<Plane> planes;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const GatedImage& image = images[i];
    require_pixels(image);
    if (!image.same_shape(images[0])) throw std::invalid_argument("the components' images differ in shape");
    for (int gate = 0; gate < image.gates; ++gate) {
      Plane plane{components[i] + "." + gate_channel(gate, 'Y'), {}};
      plane.values.reserve(image.pixels());
      for (int pixel = 0; pixel < image.pixels(); ++pixel) {
        double sum = 0;
        for (int channel = 0; channel < image.channels; ++channel) sum += image.at(pixel, gate, channel);
        plane.values.push_back(static_cast<float>(sum / image.channels));
      }
      planes.push_back(std::move(plane));
    }
  }
  write_planes(file, images[0].width, images[0].height, planes, notes);
}

GatedImage read_exr(const std::string& file) {
  try {
    return read_planes(file);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    std::string what = error.what();
    std::replace_if(
        what.begin(), what.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
    fail(file, "cannot be read as OpenEXR: " + what);
  }
}

}  // namespace isochron
