// Images of which few values are not zero, as those of many gates: kept, and written to EXR files that OpenEXR reads.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <random>

#include "core/image/sparse_block.h"
#include "core/image/stored_image.h"
#include "tests/scene/temporary_folder.h"
#include "tests/seed.h"

namespace isochron {
namespace {

/// `share` of the values are floats of any magnitude and sign, by their bits; some of them neighbours.
GatedImage sparse(int width, int height, int gates, int channels, double share) {
  GatedImage image(width, height, gates, channels);
  std::mt19937 random(test_seed(11));
  std::bernoulli_distribution lit(share / 2);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    if (!lit(random)) continue;
    for (std::size_t k = i; k < std::min(i + 2, image.data.size()); ++k) {
      float value = 0;
      do {
        value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
      } while (!std::isfinite(value));
      image.data[k] = value;
    }
  }
  return image;
}

void expect_same(const GatedImage& found, const GatedImage& expected) {
  ASSERT_TRUE(found.same_shape(expected));
  EXPECT_EQ(found.data, expected.data);
}

TEST(SparseExr, OpenExrReadsEveryValue) {
  const TemporaryFolder folder;
  const std::string file = folder.path("image.exr");
  // Heights about the 16 lines of a block; names of more than three digits, which are not in the order of the gates.
  struct Case {
    int width, height, gates, channels;
    double share;
  };
  for (const Case& c : {Case{5, 16, 40, 1, 0.03}, Case{7, 17, 30, 3, 0.05}, Case{3, 33, 1200, 1, 0.002},
                        Case{1, 1, 1, 1, 0}, Case{64, 40, 70, 1, 0}, Case{9, 5, 3, 1, 1}, Case{16, 20, 33, 1, 0.06}}) {
    const GatedImage image = sparse(c.width, c.height, c.gates, c.channels, c.share);
    write_exr(file, image);
    expect_same(read_exr(file), image);
    write_exr(file, StoredImage(image));
    expect_same(read_exr(file), image);
  }
}

// A value at the very beginning, at the ends of blocks and of the file; runs of a value.
TEST(SparseExr, OpenExrReadsTheEnds) {
  const TemporaryFolder folder;
  const std::string file = folder.path("image.exr");
  GatedImage image(4, 32, 100, 1);
  for (const std::size_t i : {std::size_t{0}, image.index(63, 99), image.index(64, 0), image.data.size() - 1})
    image.data[i] = -1.5;
  for (int g = 20; g < 60; ++g) image.at(70, g) = std::numeric_limits<float>::max();
  write_exr(file, image);
  expect_same(read_exr(file), image);
}

TEST(SparseExr, TakesTheSpaceOfWhatIsNotZero) {
  const TemporaryFolder folder;
  const GatedImage image = sparse(64, 64, 500, 1, 0.01);
  write_exr(folder.path("image.exr"), image);
  EXPECT_LT(std::filesystem::file_size(folder.path("image.exr")), 20 * 0.01 * static_cast<double>(image.data.size()));
}

TEST(SparseExr, BlocksThatCompressionMakesLargerAreStoredAsTheyAre) {
  // One block of noise among black ones.
  const TemporaryFolder folder;
  GatedImage image = sparse(8, 16, 20, 1, 1);
  const std::size_t noise = image.data.size();
  image.height = 16 * 40;
  image.data.resize(noise * 40, 0.0);
  write_exr(folder.path("image.exr"), image);
  expect_same(read_exr(folder.path("image.exr")), image);
  std::vector<SparseValue> values;
  for (std::uint32_t i = 0; i < noise; ++i) values.push_back({i, static_cast<float>(image.data[i])});
  EXPECT_GT(compressed_block(noise, values).size(), 4 * noise);
}

TEST(StoredImage, KeepsEveryValue) {
  for (const double share : {0.0, 0.1, 1.0}) {
    const GatedImage image = sparse(6, 5, 40, 3, share);
    const StoredImage stored(image);
    expect_same(stored.to_gated(), image);
    EXPECT_EQ(stored.at(7, 11, 2), static_cast<float>(image.at(7, 11, 2)));
    std::vector<double> part(image.data.begin() + static_cast<std::ptrdiff_t>(image.index(29, 10)),
                             image.data.begin() + static_cast<std::ptrdiff_t>(image.index(29, 20)));
    std::vector<double> found(30, 0.0);
    stored.for_each(29, 30, 60, [&](std::uint32_t place, float value) { found[place - 30] = value; });
    EXPECT_EQ(found, part);
    Packer packer;
    stored.pack(3, packer);
    StoredImage copy(6, 5, 40, 3);
    Unpacker unpacker(packer.bytes);
    copy.unpack(3, unpacker);
    EXPECT_EQ(copy.at(3, 0, 0), stored.at(3, 0, 0));
    EXPECT_EQ(copy.at(2, 0, 0), 0);
  }
}

TEST(StoredImage, NamesValuesThatAreNotFinite) {
  GatedImage image(2, 2, 3, 1);
  EXPECT_NO_THROW(require_finite(StoredImage(image), "it"));
  image.at(2, 1) = std::numeric_limits<double>::infinity();
  image.at(1, 2) = std::numeric_limits<double>::quiet_NaN();
  try {
    require_finite(StoredImage(image), "it");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).rfind("2 of 12 values of it are no finite", 0), 0) << error.what();
  }
}

}  // namespace
}  // namespace isochron
