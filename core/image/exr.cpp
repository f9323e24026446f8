#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "core/base/error.h"
#include "core/base/file.h"
#include "core/base/ranks.h"
#include "core/image/exr_check.h"
#include "core/image/image.h"
#include "core/image/sparse_block.h"
#include "core/image/stored_image.h"

namespace isochron {
namespace {

constexpr char kRgb[] = {'R', 'G', 'B'};
/// The attribute that names the largest magnitude of each gate; with ".COMPONENT" behind it, of each component's.
const std::string kPeaks = "isochron.peaks";

std::string gate_channel(int gate, char letter) {
  return fmt::format("gate{:03}.{}", gate, letter);
}

/// What OpenEXR writes, on its way to a file.
class FileStream final : public Imf::OStream {
 public:
  FileStream(const std::string& name, NewFile& file) : OStream(name.c_str()), file_(file) {}
  void write(const char bytes[], int count) override { file_.write({bytes, static_cast<std::size_t>(count)}); }
  std::uint64_t tellp() override { return file_.position(); }
  void seekp(std::uint64_t position) override { file_.seek(position); }

 private:
  NewFile& file_;
};

/// f(column, channel, value)
using TakeValue = std::function<void(int, std::size_t, float)>;

/// Channels of one float per pixel.
struct Planes {
  int width, height;
  std::vector<std::string> names;
  std::function<void(int, const TakeValue&)> visit;  ///< of a row the values that can be other than zero
};

constexpr int kBlockLines = 16;  ///< that ZIP_COMPRESSION compresses together

/// What is to be known of values before they are written.
struct Survey {
  std::vector<float> peaks;  ///< largest magnitude of each channel
  /// The values other than zero of each block, where they are few in the whole image. Else empty.
  std::vector<std::vector<SparseValue>> blocks;
};

Survey survey_of(const Planes& planes) {
  constexpr std::size_t kFew = 16, kLargest = std::size_t{1} << 29;  // few: one of so many
  const std::size_t count = planes.names.size(), row = count * planes.width;
  std::vector<std::size_t> order(count), rank(count);  // channels lie in a file by their names
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return planes.names[a] < planes.names[b]; });
  for (std::size_t i = 0; i < count; ++i) rank[order[i]] = i;
  Survey survey{std::vector<float>(count),
                std::vector<std::vector<SparseValue>>((planes.height - 1) / kBlockLines + 1)};
  std::size_t found = 0;
  bool few = row * kBlockLines < kLargest;
  for (int y = 0; y < planes.height; ++y) {
    std::vector<SparseValue>& block = survey.blocks[y / kBlockLines];
    const std::size_t before = block.size(), first = y % kBlockLines * row;
    planes.visit(y, [&](int column, std::size_t channel, float value) {
      if (std::bit_cast<std::uint32_t>(value) == 0) return;
      survey.peaks[channel] = std::max(survey.peaks[channel], std::abs(value));
      ++found;
      if (few) block.push_back({static_cast<std::uint32_t>(first + rank[channel] * planes.width + column), value});
    });
    few = few && kFew * found <= row * planes.height;
    std::sort(block.begin() + static_cast<std::ptrdiff_t>(before), block.end(),
              [](const SparseValue& a, const SparseValue& b) { return a.place < b.place; });
  }
  if (!few) survey.blocks.clear();
  return survey;
}

Imf::Header header_of(const Planes& planes, const ExrNotes& notes) {
  Imf::Header header(planes.width, planes.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const auto& [name, text] : notes) header.insert(name, Imf::StringAttribute(text));
  for (const std::string& name : planes.names) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
  return header;
}

/// By OpenEXR, in a time that goes with the number of values.
void write_all(Imf::OStream& stream, const Imf::Header& header, const Planes& planes) {
  const std::size_t count = planes.names.size();
  std::vector<float> row(count * planes.width);
  Imf::FrameBuffer buffer;
  for (std::size_t i = 0; i < count; ++i) {
    // One row for all scanlines (no stride in y).
    char* base = reinterpret_cast<char*>(row.data() + i);
    buffer.insert(planes.names[i], Imf::Slice(Imf::FLOAT, base, sizeof(float) * count, 0));
  }
  Imf::OutputFile output(stream, header);
  output.setFrameBuffer(buffer);
  for (int y = 0; y < planes.height; ++y) {
    std::fill(row.begin(), row.end(), 0.0f);
    planes.visit(y, [&](int column, std::size_t channel, float value) { row[column * count + channel] = value; });
    output.writePixels();
  }
}  // the table of offsets is written on destruction

template <class T>
void write_plain(Imf::OStream& stream, const T& value) {
  stream.write(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Of few values that are not zero.
void write_few(Imf::OStream& stream, const Imf::Header& header, const Planes& planes, const Survey& survey) {
  constexpr std::int32_t kMagic = 20000630, kVersion = 2, kLongNames = 0x400;
  write_plain(stream, kMagic);
  write_plain(stream, kVersion | kLongNames);
  header.writeTo(stream);
  const std::uint64_t table = stream.tellp();
  std::vector<std::uint64_t> offsets(survey.blocks.size());
  const auto write_table = [&] {
    for (const std::uint64_t offset : offsets) write_plain(stream, offset);
  };
  write_table();
  for (std::size_t i = 0; i < survey.blocks.size(); ++i) {
    const int y = static_cast<int>(i) * kBlockLines, lines = std::min(kBlockLines, planes.height - y);
    const std::size_t size = planes.names.size() * planes.width * lines;
    std::string block = compressed_block(size, survey.blocks[i]);
    if (block.size() >= size * sizeof(float)) block = plain_block(size, survey.blocks[i]);
    offsets[i] = stream.tellp();
    write_plain(stream, static_cast<std::int32_t>(y));
    write_plain(stream, static_cast<std::int32_t>(block.size()));
    stream.write(block.data(), static_cast<int>(block.size()));
  }
  stream.seekp(table);
  write_table();
}

/// `groups`: notes of what the channels belong to, equally many of each, `each` of them to a gate. A note of each group says how
/// large the gates' values are, so that readers need not look at all of them to choose some.
void write_planes(const std::string& file, const Planes& planes, ExrNotes notes, const std::vector<std::string>& groups,
                  int each) {
  on_first_rank([&] {
    const Survey survey = survey_of(planes);
    auto peak = survey.peaks.begin();
    for (const std::string& group : groups) {
      std::string text;
      for (std::size_t i = 0; i < planes.names.size() / groups.size(); i += each, peak += each)
        text += fmt::format("{}{:.3g}", text.empty() ? "" : " ", *std::max_element(peak, peak + each));
      notes.emplace_back(group, text);
    }
    NewFile out(file);
    FileStream stream(file, out);
    const Imf::Header header = header_of(planes, notes);
    if (survey.blocks.empty())
      write_all(stream, header, planes);
    else
      write_few(stream, header, planes, survey);
    out.finish();
  });
}

std::vector<std::string> peaks_of(const std::vector<std::string>& components) {
  std::vector<std::string> names;
  for (const std::string& component : components) names.push_back(kPeaks + "." + component);
  return names;
}

void require_pixels(int width, int height, int gates, int channels) {
  if (width < 1 || height < 1 || gates < 1 || (channels != 1 && channels != 3))
    throw std::invalid_argument("an image to be written needs pixels, gates, and one or three channels");
}

/// f(place, value) for a pixel's values [gate][channel].
template <class F>
void for_each_value(const GatedImage& image, int pixel, F&& f) {
  const std::size_t count = static_cast<std::size_t>(image.gates) * image.channels;
  for (std::size_t i = 0; i < count; ++i) f(i, image.data[pixel * count + i]);
}
template <class F>
void for_each_value(const StoredImage& image, int pixel, F&& f) {
  image.for_each(pixel, f);
}

template <class Image>
Planes planes_of(const Image& image) {
  require_pixels(image.width, image.height, image.gates, image.channels);
  Planes planes{image.width, image.height, {}, {}};
  for (int gate = 0; gate < image.gates; ++gate)
    for (int c = 0; c < image.channels; ++c)
      planes.names.push_back(gate_channel(gate, image.channels == 1 ? 'Y' : kRgb[c]));
  planes.visit = [&image](int y, const TakeValue& take) {
    for (int x = 0; x < image.width; ++x)
      for_each_value(image, y * image.width + x,
                     [&](std::size_t place, auto value) { take(x, place, static_cast<float>(value)); });
  };
  return planes;
}

/// Averages over channels of several images.
template <class Image>
Planes planes_of(const std::vector<std::string>& components, const std::vector<Image>& images) {
  if (components.empty() || components.size() != images.size())
    throw std::invalid_argument("one image per component is needed");
  Planes planes{images[0].width, images[0].height, {}, {}};
  for (std::size_t i = 0; i < images.size(); ++i) {
    require_pixels(images[i].width, images[i].height, images[i].gates, images[i].channels);
    if (!images[i].same_shape(images[0])) throw std::invalid_argument("the components' images differ in shape");
    for (int gate = 0; gate < images[i].gates; ++gate)
      planes.names.push_back(components[i] + "." + gate_channel(gate, 'Y'));
  }
  planes.visit = [&images](int y, const TakeValue& take) {
    const std::size_t channels = static_cast<std::size_t>(images[0].channels);
    RowSum sum(images.size() * images[0].gates);
    for (int x = 0; x < images[0].width; ++x) {
      for (std::size_t i = 0; i < images.size(); ++i)
        for_each_value(images[i], y * images[0].width + x, [&](std::size_t place, auto value) {
          if (value != 0) sum.add(i * images[0].gates + place / channels, value);
        });
      sum.take([&](std::size_t channel, double value) {
        take(x, channel, static_cast<float>(value / static_cast<double>(channels)));
      });
    }
  };
  return planes;
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
  write_planes(file, planes_of(image), notes, {kPeaks}, image.channels);
}
void write_exr(const std::string& file, const StoredImage& image, const ExrNotes& notes) {
  write_planes(file, planes_of(image), notes, {kPeaks}, image.channels);
}

void write_exr_components(const std::string& file, const std::vector<std::string>& components,
                          const std::vector<GatedImage>& images, const ExrNotes& notes) {
  write_planes(file, planes_of(components, images), notes, peaks_of(components), 1);
}
void write_exr_components(const std::string& file, const std::vector<std::string>& components,
                          const std::vector<StoredImage>& images, const ExrNotes& notes) {
  write_planes(file, planes_of(components, images), notes, peaks_of(components), 1);
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
