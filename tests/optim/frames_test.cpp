// Which images a run keeps over its iterations.
#include "optim/run/frames.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/optim/temporary_folder.h"

namespace isochron {
namespace {

GatedImage image_of(int iteration) {
  GatedImage image(2, 1, 1, 1);
  image.data = {1.0 * iteration, -0.5};
  return image;
}

std::set<std::string> names(const TemporaryFolder& folder) {
  std::set<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder.file("frames")))
    found.insert(entry.path().filename().string());
  return found;
}

/// Iterations [first, last] as a run goes through them.
void go(const TemporaryFolder& folder, int most, int first, int last) {
  const Frames frames(folder.path(), most, image_of(0), {});
  for (int i = first; i <= last; ++i)
    if (frames.wants(i)) frames.write(i, image_of(i));
}

TEST(Frames, AreEvenlySpreadAndBounded) {
  for (const int most : {1, 2, 5, 24}) {
    const TemporaryFolder folder;
    const Frames frames(folder.path(), most, image_of(0), {});
    for (int i = 0; i <= 150; ++i) {
      if (!frames.wants(i)) continue;
      frames.write(i, image_of(i));
      const std::set<std::string> found = names(folder);
      const int count = static_cast<int>(found.size());
      EXPECT_LE(count, most) << i;
      EXPECT_GE(2 * count, std::min(i + 1, most)) << i;
      int k = 0;
      const int step = count > 1 ? i / (count - 1) : 1;
      for (const std::string& name : found) {
        const int iteration = std::stoi(name);
        EXPECT_EQ(iteration, step * k++) << i;
        EXPECT_EQ(read_exr(folder.file("frames/" + name)).data, image_of(iteration).data) << i;
      }
    }
  }
}

TEST(Frames, OfAResumedRunAreThoseOfAWholeOne) {
  const TemporaryFolder whole;
  go(whole, 4, 0, 37);
  for (const int killed : {0, 3, 4, 17, 32, 36}) {
    const TemporaryFolder resumed;
    go(resumed, 4, 0, killed);
    go(resumed, 4, std::max(0, killed - 1), 37);  // from the checkpoint before the last row
    EXPECT_EQ(names(resumed), names(whole)) << killed;
  }
}

TEST(Frames, NoneWhereNoneAreWantedAndFewOfLargeImages) {
  const TemporaryFolder folder;
  EXPECT_FALSE(Frames(folder.path(), 0, image_of(0), {}).wants(0));
  const Frames large(folder.path(), 24, GatedImage(1000, 1000, 4, 1), {});  // 16 MB each: four of them
  EXPECT_TRUE(large.wants(3));
  EXPECT_FALSE(large.wants(5));
  EXPECT_TRUE(large.wants(6));
}

}  // namespace
}  // namespace isochron
