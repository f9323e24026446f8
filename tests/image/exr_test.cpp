#include <ImfChannelList.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <ImfStringVectorAttribute.h>
#include <gtest/gtest.h>
#include <half.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <string_view>

#include "core/image/image.h"
#include "tests/scene/temporary_folder.h"
#include "tests/seed.h"

namespace isochron {
namespace {

/// Floats of every magnitude and sign, by their bits, with the extremes among them.
GatedImage any_floats(int width, int height, int gates, int channels) {
  GatedImage image(width, height, gates, channels);
  std::mt19937 random(test_seed(5));
  for (double& value : image.data) {
    float f = 0;
    do {
      f = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    } while (!std::isfinite(f));
    value = f;
  }
  using Limits = std::numeric_limits<float>;
  const float extremes[] = {0.f,           -0.f,          Limits::denorm_min(), -Limits::denorm_min(),
                            Limits::min(), Limits::max(), Limits::lowest(),     1.f};
  for (std::size_t i = 0; i < std::size(extremes) && i < image.data.size(); ++i)
    image.data[i * 3 % image.data.size()] = extremes[i];
  return image;
}

/// All channels of a file as OpenEXR reads them, and what its header says.
struct RawExr {
  std::map<std::string, std::vector<float>> planes;
  Imf::Compression compression{};
  bool all_float = true;

  explicit RawExr(const std::string& file) {
    Imf::InputFile input(file.c_str());
    compression = input.header().compression();
    const auto window = input.header().dataWindow();
    const int width = window.max.x + 1, height = window.max.y + 1;
    Imf::FrameBuffer buffer;
    for (auto c = input.header().channels().begin(); c != input.header().channels().end(); ++c) {
      all_float &= c.channel().type == Imf::FLOAT;
      std::vector<float>& plane = planes[c.name()];
      plane.resize(static_cast<std::size_t>(width) * height);
      buffer.insert(c.name(), Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(plane.data()), 4,
                                         4 * static_cast<std::size_t>(width)));
    }
    input.setFrameBuffer(buffer);
    input.readPixels(0, height - 1);
  }
};

/// Writes constant channels with OpenEXR itself.
void write_raw(const std::string& file, const std::vector<std::string>& channels, float value = 1,
               Imf::PixelType type = Imf::FLOAT, Imf::Compression compression = Imf::PIZ_COMPRESSION) {
  Imf::Header header(4, 3);
  header.compression() = compression;
  const std::vector<float> floats(12, value);
  const std::vector<half> halves(12, half(value));
  const std::vector<unsigned> integers(12, static_cast<unsigned>(value));
  const void* data = type == Imf::FLOAT  ? static_cast<const void*>(floats.data())
                     : type == Imf::HALF ? static_cast<const void*>(halves.data())
                                         : static_cast<const void*>(integers.data());
  const std::size_t size = type == Imf::HALF ? 2 : 4;
  Imf::FrameBuffer buffer;
  for (const std::string& name : channels) {
    header.channels().insert(name, Imf::Channel(type));
    buffer.insert(name, Imf::Slice(type, static_cast<char*>(const_cast<void*>(data)), size, 4 * size));
  }
  Imf::OutputFile output(file.c_str(), header);
  output.setFrameBuffer(buffer);
  output.writePixels(3);
}

class Exr : public testing::Test {
 protected:
  std::string path(const std::string& name = "f.exr") { return folder.path(name); }
  std::string read_error() {
    const std::string message = error_of([&] { read_exr(path()); });
    EXPECT_EQ(message.find('\n'), std::string::npos);
    return message.starts_with(path()) ? message.substr(path().size()) : message;
  }

  TemporaryFolder folder;
};

TEST_F(Exr, RoundTripKeepsEveryBit) {
  for (const int channels : {1, 3}) {
    for (const int gates : {1, 12}) {
      const GatedImage image = any_floats(7, 5, gates, channels);
      write_exr(path(), image);
      const GatedImage back = read_exr(path());
      ASSERT_TRUE(back.same_shape(image));
      for (std::size_t i = 0; i < image.data.size(); ++i)
        ASSERT_EQ(std::bit_cast<std::uint64_t>(back.data[i]), std::bit_cast<std::uint64_t>(image.data[i])) << i;
    }
  }
}

TEST_F(Exr, DoublesAreRoundedToFloat) {
  GatedImage image(1, 1, 3, 1);
  image.data = {0.1, 1 + 1e-9, 1e-60};
  write_exr(path(), image);
  EXPECT_EQ(read_exr(path()).data, (std::vector<double>{0.1f, 1.0, 0.0}));
}

TEST_F(Exr, ChannelsAndRowsAreWhereOtherReadersExpectThem) {
  for (const int channels : {1, 3}) {
    const GatedImage image = any_floats(6, 40, 2, channels);
    write_exr(path(), image);
    const RawExr raw(path());
    EXPECT_EQ(raw.compression, Imf::ZIP_COMPRESSION);
    EXPECT_TRUE(raw.all_float);
    EXPECT_EQ(raw.planes.size(), 2u * channels);
    for (int gate = 0; gate < 2; ++gate) {
      for (int c = 0; c < channels; ++c) {
        const std::string name =
            "gate00" + std::string(1, static_cast<char>('0' + gate)) + "." + (channels == 1 ? 'Y' : "RGB"[c]);
        ASSERT_EQ(raw.planes.count(name), 1u) << name;
        for (int row = 0; row < 40; ++row) {
          for (int column = 0; column < 6; ++column)
            ASSERT_EQ(raw.planes.at(name)[row * 6 + column],
                      image.data[((row * 6 + column) * 2 + gate) * channels + c]);
        }
      }
    }
  }
}

TEST_F(Exr, MoreThanAThousandGates) {
  const GatedImage image = any_floats(2, 1, 1002, 1);
  write_exr(path(), image);
  EXPECT_EQ(RawExr(path()).planes.count("gate1001.Y"), 1u);
  EXPECT_EQ(RawExr(path()).planes.count("gate999.Y"), 1u);
  EXPECT_EQ(read_exr(path()).data, image.data);
}

TEST_F(Exr, ComponentsAreAveragesOverChannels) {
  GatedImage interior(2, 2, 2, 3), visibility(2, 2, 2, 3);
  for (std::size_t i = 0; i < interior.data.size(); ++i) {
    interior.data[i] = static_cast<double>(i);
    visibility.data[i] = -2.5 * static_cast<double>(i * i);
  }
  write_exr_components(path(), {"interior", "visibility"}, {interior, visibility});
  const RawExr raw(path());
  EXPECT_EQ(raw.planes.size(), 4u);
  EXPECT_TRUE(raw.all_float);
  for (int pixel = 0; pixel < 4; ++pixel) {
    for (int gate = 0; gate < 2; ++gate) {
      // Channels of a pixel and gate hold i, i + 1, i + 2.
      const double i = (pixel * 2 + gate) * 3;
      const std::string name = gate == 0 ? ".gate000.Y" : ".gate001.Y";
      EXPECT_EQ(raw.planes.at("interior" + name)[pixel], static_cast<float>(i + 1));
      EXPECT_FLOAT_EQ(raw.planes.at("visibility" + name)[pixel],
                      static_cast<float>(-2.5 * (i * i + (i + 1) * (i + 1) + (i + 2) * (i + 2)) / 3));
    }
  }
  EXPECT_THROW(write_exr_components(path(), {"interior"}, {interior, visibility}), std::invalid_argument);
  EXPECT_THROW(write_exr_components(path(), {"a", "b"}, {interior, GatedImage(2, 2, 1, 3)}), std::invalid_argument);
  EXPECT_THROW(write_exr(path(), GatedImage(0, 2, 1, 1)), std::invalid_argument);
  EXPECT_THROW(write_exr(path(), GatedImage(2, 2, 1, 2)), std::invalid_argument);
}

TEST_F(Exr, ReadsOtherCompressionsAndHalf) {
  using enum Imf::Compression;
  for (const Imf::Compression compression : {NO_COMPRESSION, RLE_COMPRESSION, ZIPS_COMPRESSION, PIZ_COMPRESSION}) {
    write_raw(path(), {"gate000.Y", "gate001.Y"}, 1.5f, Imf::FLOAT, compression);
    EXPECT_EQ(read_exr(path()).data, std::vector<double>(24, 1.5));
  }
  write_raw(path(), {"gate000.R", "gate000.G", "gate000.B"}, 0.25f, Imf::HALF);
  const GatedImage image = read_exr(path());
  EXPECT_EQ(image.channels, 3);
  EXPECT_EQ(image.gates, 1);
  EXPECT_EQ(image.data, std::vector<double>(36, 0.25));
}

TEST_F(Exr, ReadsDataWindowsAwayFromTheOrigin) {
  const Imath::Box2i window({-3, 100}, {-2, 101});
  Imf::Header header(window, window);
  header.channels().insert("gate000.Y", Imf::Channel(Imf::FLOAT));
  const float values[] = {1, 2, 3, 4};
  Imf::FrameBuffer buffer;
  buffer.insert("gate000.Y", Imf::Slice::Make(Imf::FLOAT, values, window));
  {
    Imf::OutputFile output(path().c_str(), header);
    output.setFrameBuffer(buffer);
    output.writePixels(2);
  }
  EXPECT_EQ(read_exr(path()).data, (std::vector<double>{1, 2, 3, 4}));
}

TEST_F(Exr, ReadErrorsNameTheFirstThingAmiss) {
  EXPECT_EQ(read_error(), ": cannot be opened: No such file or directory");
  folder.write("f.exr", "not an image");
  EXPECT_TRUE(read_error().starts_with(": cannot be read as OpenEXR: ")) << read_error();
  std::filesystem::create_directory(folder.path("d"));
  EXPECT_EQ(error_of([&] { read_exr(folder.path("d")); }), folder.path("d") + ": is a folder");

  const std::string kinds =
      " is not one of a gated image (gateNNN.Y, or gateNNN.R, .G, .B; for one gate Y, or R, G, B; alpha is left out)";
  for (const std::string name : {"gate00.Y", "gate0000.Y", "gate-01.Y", "gate000Y", "gate000.", "gat000.Y", "gate0a0.Y",
                                 "gate99999999999.Y", "Z", "alpha", "layer.R"}) {
    write_raw(path(), {name});
    EXPECT_EQ(read_error(), ": channel '" + name + "'" + kinds);
  }
  write_raw(path(), {"gate000.Y", "gate002.Y"});
  EXPECT_EQ(read_error(), ": channel 'gate001.Y' is missing (gates 0 to 2)");
  write_raw(path(), {"gate000.R", "gate000.G", "gate000.B", "gate001.R", "gate001.B"});
  EXPECT_EQ(read_error(), ": channel 'gate001.G' is missing (gates 0 to 1)");
  write_raw(path(), {"gate000.R", "gate000.G", "gate000.B", "gate001.Y"});
  EXPECT_EQ(read_error(), ": channel 'gate001.Y' mixes grey and colour");
  write_raw(path(), {"gate000.Y"}, 1, Imf::UINT);
  EXPECT_EQ(read_error(), ": channel 'gate000.Y' holds integers (half or float)");

  GatedImage image(4, 3, 2, 3);
  image.at(1 * 4 + 2, 1, 0) = std::numeric_limits<double>::quiet_NaN();
  write_exr(path(), image);
  EXPECT_EQ(read_error(), ": nan in row 1, column 2, gate 1");
  image.at(1 * 4 + 2, 1, 0) = -1e300;
  write_exr(path(), image);
  EXPECT_EQ(read_error(), ": -inf in row 1, column 2, gate 1");

  write_exr(path(), any_floats(20, 20, 3, 1));
  const std::string whole = folder.read("f.exr");
  folder.write("f.exr", whole.substr(0, whole.size() * 2 / 3));
  EXPECT_TRUE(read_error().starts_with(": cannot be read as OpenEXR: ")) << read_error();
}

TEST_F(Exr, HeadersAreNotBelieved) {
  // OpenEXR alone allocates two gigabytes for the first two.
  write_exr(path(), any_floats(2, 2, 1, 1));
  const std::string whole = folder.read("f.exr");
  const auto error_with = [&](std::string_view from, const std::string& to) {
    std::string contents = whole;
    folder.write("f.exr", contents.replace(contents.find(from), from.size(), to));
    return read_error();
  };
  using namespace std::literals;
  const std::string_view order = "lineOrder\0lineOrder\0\1\0\0\0"sv;
  const std::string cannot = ": cannot be read as OpenEXR: ";
  EXPECT_EQ(error_with(order, "other\0unknown\0\0\0\0\x70"s), cannot + "the header ends too early");
  EXPECT_EQ(error_with(order, "lineOrder\0lineOrder\0\xff\xff\xff\xff"s), cannot + "the header ends too early");
  // A list of channels without its end, which OpenEXR would look for in the attributes behind.
  EXPECT_EQ(error_with("\1\0\0\0\0compression\0"sv, "\1\0\0\0x"s + "compression\0"s),
            cannot + "the header ends too early");
  EXPECT_EQ(error_with("pixelAspectRatio\0float\0\4"sv, "pixelAspectRatio\0int\0\4"s),
            cannot + "its attribute pixelAspectRatio is damaged");
  EXPECT_TRUE(error_with("dataWindow\0box2i\0\x10\0\0\0\0\0\0\0\0\0\0\0\1\0\0\0"sv,
                         "dataWindow\0box2i\0\x10\0\0\0\0\0\0\0\0\0\0\0\1\0\0\x70"s)
                  .starts_with(cannot));
}

TEST_F(Exr, OtherAttributesAreSkipped) {
  Imf::Header header(1, 1);
  header.channels().insert("gate000.Y", Imf::Channel(Imf::FLOAT));
  header.insert("comments", Imf::StringAttribute("measured"));
  header.insert("names", Imf::StringVectorAttribute({"a", "b"}));
  const float value = 3;
  Imf::FrameBuffer buffer;
  buffer.insert("gate000.Y", Imf::Slice::Make(Imf::FLOAT, &value, header.dataWindow()));
  {
    Imf::OutputFile output(path().c_str(), header);
    output.setFrameBuffer(buffer);
    output.writePixels(1);
  }
  EXPECT_EQ(read_exr(path()).data, std::vector<double>{3});
}

TEST_F(Exr, CroppedImagesAreRejected) {
  Imf::Header header(Imath::Box2i({0, 0}, {7, 7}), Imath::Box2i({0, 0}, {3, 3}));
  header.channels().insert("gate000.Y", Imf::Channel(Imf::FLOAT));
  std::vector<float> values(16);
  Imf::FrameBuffer buffer;
  buffer.insert("gate000.Y", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), 4, 16));
  {
    Imf::OutputFile output(path().c_str(), header);
    output.setFrameBuffer(buffer);
    output.writePixels(4);
  }
  EXPECT_EQ(read_error(), ": is cropped (data window and display window differ)");
}

TEST_F(Exr, UnwritableFilesLeaveNothingBehind) {
  const GatedImage image(2, 2, 1, 1);
  EXPECT_EQ(error_of([&] { write_exr(path("none/f.exr"), image); }),
            path("none/f.exr") + ": cannot be written: No such file or directory");
  folder.write("sub/keep", "x");
  EXPECT_EQ(error_of([&] { write_exr(path("sub"), image); }), path("sub") + ": cannot be written: Is a directory");
  EXPECT_EQ(folder.read("sub/keep"), "x");
  EXPECT_EQ(folder.entries(), 1);
}

TEST(GatedImage, MeanIsPerGateOverPixelsAndChannels) {
  GatedImage image(3, 2, 2, 3);
  for (int pixel = 0; pixel < 6; ++pixel) {
    for (int c = 0; c < 3; ++c) {
      image.at(pixel, 0, c) = 1;
      image.at(pixel, 1, c) = 10 * pixel + c;
    }
  }
  EXPECT_EQ(image.mean(0), 1);
  EXPECT_EQ(image.mean(1), 26);  // 10 * 2.5 + 1
}

}  // namespace
}  // namespace isochron
