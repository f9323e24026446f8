// EXR files as other programs write them: tiles, alpha, images without gates.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/image/image.h"
#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

constexpr int kWidth = 21, kHeight = 13;  // no multiples of a tile's sides

float value(int channel, int x, int y) {
  return static_cast<float>(100 * channel + 0.5 * x - 3 * y);
}

class ExrKinds : public testing::Test {
 protected:
  std::string path() { return folder.path("f.exr"); }

  /// Channels with the values of `value`, by their place in the list, from `corner` on.
  std::vector<std::vector<float>> fill(Imf::Header& header, Imf::FrameBuffer& buffer,
                                       const std::vector<std::string>& names, Imath::V2i corner = {0, 0}) {
    std::vector<std::vector<float>> planes;
    for (std::size_t c = 0; c < names.size(); ++c) {
      header.channels().insert(names[c], Imf::Channel(Imf::FLOAT));
      std::vector<float>& plane = planes.emplace_back();
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) plane.push_back(value(static_cast<int>(c), x, y));
    }
    for (std::size_t c = 0; c < names.size(); ++c) {
      const std::ptrdiff_t before = corner.x + std::ptrdiff_t{kWidth} * corner.y;
      buffer.insert(names[c], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(planes[c].data() - before), sizeof(float),
                                         sizeof(float) * kWidth));
    }
    return planes;
  }

  void write_tiles(const std::vector<std::string>& names, Imf::LevelMode levels, Imf::LineOrder order,
                   Imf::Compression compression, Imath::V2i corner = {0, 0}) {
    const Imath::Box2i window(corner, corner + Imath::V2i(kWidth - 1, kHeight - 1));
    Imf::Header header(window, window);
    header.compression() = compression;
    header.lineOrder() = order;
    header.setTileDescription(Imf::TileDescription(8, 4, levels));
    Imf::FrameBuffer buffer;
    const auto planes = fill(header, buffer, names, corner);
    Imf::TiledOutputFile output(path().c_str(), header);
    output.setFrameBuffer(buffer);
    // Levels above the first hold part of the same pixels, which is of no concern here.
    for (int ly = 0; ly < output.numYLevels(); ++ly)
      for (int lx = 0; lx < output.numXLevels(); ++lx)
        if (output.isValidLevel(lx, ly))
          output.writeTiles(0, output.numXTiles(lx) - 1, 0, output.numYTiles(ly) - 1, lx, ly);
  }

  void expect_values(int gates, int channels, const std::vector<int>& planes) {
    const GatedImage image = read_exr(path());
    ASSERT_EQ(image.width, kWidth);
    ASSERT_EQ(image.height, kHeight);
    ASSERT_EQ(image.gates, gates);
    ASSERT_EQ(image.channels, channels);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (std::size_t p = 0; p < planes.size(); ++p)
          ASSERT_EQ(image.data[(y * kWidth + x) * planes.size() + p], value(planes[p], x, y)) << x << ", " << y;
  }
  std::string read_error() {
    return error_of([&] { read_exr(path()); }).substr(path().size());
  }

  TemporaryFolder folder;
};

TEST_F(ExrKinds, TilesOfAllLevelsOrdersAndCompressions) {
  for (const auto levels : {Imf::ONE_LEVEL, Imf::MIPMAP_LEVELS, Imf::RIPMAP_LEVELS})
    for (const auto order : {Imf::INCREASING_Y, Imf::DECREASING_Y, Imf::RANDOM_Y})
      for (const auto compression : {Imf::NO_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION}) {
        if (levels != Imf::ONE_LEVEL && order == Imf::RANDOM_Y) continue;
        write_tiles({"gate000.Y", "gate001.Y"}, levels, order, compression);
        expect_values(2, 1, {0, 1});
      }
  write_tiles({"gate000.Y"}, Imf::ONE_LEVEL, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION, {-5, 7});
  expect_values(1, 1, {0});
}

TEST_F(ExrKinds, AlphaIsLeftOut) {
  write_tiles({"gate000.A", "gate000.B", "gate000.G", "gate000.R"}, Imf::ONE_LEVEL, Imf::INCREASING_Y,
              Imf::ZIP_COMPRESSION);
  expect_values(1, 3, {3, 2, 1});
  write_tiles({"A", "B", "G", "R"}, Imf::ONE_LEVEL, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
  expect_values(1, 3, {3, 2, 1});
  write_tiles({"A", "Y"}, Imf::ONE_LEVEL, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
  expect_values(1, 1, {1});
  write_tiles({"A"}, Imf::ONE_LEVEL, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
  EXPECT_EQ(read_error(), ": has no channel but alpha");
}

TEST_F(ExrKinds, ImagesWithoutGatesAreOfOne) {
  Imf::Header header(kWidth, kHeight);
  Imf::FrameBuffer buffer;
  const auto planes = fill(header, buffer, {"B", "G", "R"});
  {
    Imf::OutputFile output(path().c_str(), header);
    output.setFrameBuffer(buffer);
    output.writePixels(kHeight);
  }
  expect_values(1, 3, {2, 1, 0});
}

TEST_F(ExrKinds, WhatIsRefusedIsNamed) {
  write_tiles({"B", "G"}, Imf::ONE_LEVEL, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
  EXPECT_EQ(read_error(), ": channel 'R' is missing (gates 0 to 0)");
  write_tiles({"B", "G", "R", "gate000.Y"}, Imf::ONE_LEVEL, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
  EXPECT_TRUE(read_error().starts_with(": channel 'gate000.Y' is not one of a gated image")) << read_error();
  write_tiles({"B", "G", "R", "Z"}, Imf::ONE_LEVEL, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
  EXPECT_TRUE(read_error().starts_with(": channel 'Z' is not one of a gated image")) << read_error();
  {
    Imf::RgbaOutputFile output(path().c_str(), 4, 2, Imf::WRITE_YC);
    const std::vector<Imf::Rgba> pixels(8, Imf::Rgba(1, 2, 3));
    output.setFrameBuffer(pixels.data(), 1, 4);
    output.writePixels(2);
  }
  EXPECT_EQ(read_error(), ": holds luminance and chroma (channels Y, RY, BY; allowed: R, G, B)");
  {
    Imf::Header header(kWidth, kHeight);
    Imf::FrameBuffer buffer;
    const auto planes = fill(header, buffer, {"gate000.Y"});
    header.setName("one");
    header.setType(Imf::SCANLINEIMAGE);
    Imf::Header other = header;
    other.setName("two");
    const Imf::Header headers[] = {header, other};
    Imf::MultiPartOutputFile output(path().c_str(), headers, 2);
    for (int part = 0; part < 2; ++part) {
      Imf::OutputPart out(output, part);
      out.setFrameBuffer(buffer);
      out.writePixels(kHeight);
    }
  }
  EXPECT_EQ(read_error(),
            ": cannot be read as OpenEXR: it has several parts (allowed: one image, in scanlines or tiles)");
}

TEST_F(ExrKinds, SizesOfTilesAreNotBelieved) {
  write_tiles({"gate000.Y"}, Imf::ONE_LEVEL, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
  const std::string whole = folder.read("f.exr");
  const auto error_with = [&](const std::string& from, const std::string& to) {
    std::string contents = whole;
    folder.write("f.exr", contents.replace(contents.find(from), from.size(), to));
    return read_error();
  };
  using namespace std::literals;
  EXPECT_EQ(
      error_with("\x8\0\0\0\x4\0\0\0\0"s, "\x8\0\0\0\0\0\0\1\0"s),
      ": cannot be read as OpenEXR: its tiles of 8 x 16777216 pixels are none, or too large (a row of them: half a "
      "gigabyte)");
  EXPECT_EQ(error_with("tiles\0tiledesc"s, "tales\0tiledesc"s),
            ": cannot be read as OpenEXR: its attribute tiles is missing");
  EXPECT_EQ(error_with("tiles\0tiledesc"s, "tiles\0tiledisc"s),
            ": cannot be read as OpenEXR: its attribute tiles is damaged");
  for (std::size_t size = 8; size < whole.size(); size += 41) {
    folder.write("f.exr", whole.substr(0, size));
    EXPECT_TRUE(read_error().starts_with(": cannot be read as OpenEXR: ")) << size;
  }
}

}  // namespace
}  // namespace isochron
