// Writes small EXR files with OpenEXR itself, for exr_test.py to try the scripts' reader on: per compression,
// one with smooth and one with incompressible pixels, each in scanlines and in tiles.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledOutputFile.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

namespace {

constexpr int kWidth = 21, kHeight = 37;  // odd, and no multiple of a block's 16 lines

/// The same formulas stand in exr_test.py.
float pixel(bool smooth, int channel, int x, int y) {
  if (smooth) return static_cast<float>(channel + 1) * (static_cast<float>(x) / 4.0f - static_cast<float>(y));
  const std::uint32_t index = static_cast<std::uint32_t>((channel * kHeight + y) * kWidth + x);
  const std::uint32_t bits = (index * 2654435761u) & 0xbf7fffffu;  // finite
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

void write(const std::string& file, Imf::Compression compression, bool smooth, bool tiled) {
  const std::vector<std::string> names = {"gate000.Y", "interior.gate001.Y", "path_length.gate010.with.a.long.name.Y"};
  Imf::Header header(kWidth, kHeight);
  header.compression() = compression;
  Imf::FrameBuffer buffer;
  std::map<std::string, std::vector<float>> data;
  for (int c = 0; c < static_cast<int>(names.size()); ++c) {
    std::vector<float>& values = data[names[c]];
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) values.push_back(pixel(smooth, c, x, y));
    header.channels().insert(names[c], Imf::Channel(Imf::FLOAT));
    buffer.insert(names[c], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), sizeof(float),
                                       sizeof(float) * kWidth));
  }
  if (tiled) {
    header.setTileDescription(Imf::TileDescription(8, 16, Imf::MIPMAP_LEVELS));
    Imf::TiledOutputFile out(file.c_str(), header);
    out.setFrameBuffer(buffer);
    for (int level = 0; level < out.numLevels(); ++level)
      out.writeTiles(0, out.numXTiles(level) - 1, 0, out.numYTiles(level) - 1, level);
    return;
  }
  Imf::OutputFile out(file.c_str(), header);
  out.setFrameBuffer(buffer);
  out.writePixels(kHeight);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::string directory = argv[1];
  const std::map<std::string, Imf::Compression> compressions = {
      {"none", Imf::NO_COMPRESSION}, {"zips", Imf::ZIPS_COMPRESSION}, {"zip", Imf::ZIP_COMPRESSION}};
  for (const auto& [name, compression] : compressions) {
    for (const bool tiled : {false, true})
      for (const bool smooth : {false, true})
        write(directory + "/" + name + (smooth ? "_smooth" : "_rough") + (tiled ? "_tiles.exr" : ".exr"), compression,
              smooth, tiled);
  }
  return 0;
}
