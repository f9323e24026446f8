// Which freed blocks of memory are kept for the next pass.
#include "core/base/large_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <new>
#include <vector>

namespace isochron {
namespace {

constexpr std::size_t kMegabyte = std::size_t{1} << 20;

void* filled(std::size_t megabytes, int value) {
  void* const block = ::operator new(megabytes* kMegabyte);
  std::memset(block, value, megabytes * kMegabyte);
  return block;
}

void free_block(void* block, std::size_t megabytes) {
  ::operator delete(block, megabytes* kMegabyte);
}

/// Pages that the system gives anew are zero; those of a block that was kept have what was in them. The last byte of a new block.
int left_in_new(std::size_t megabytes) {
  const volatile unsigned char* const block = static_cast<unsigned char*>(::operator new(megabytes* kMegabyte));
  const int last = block[megabytes * kMegabyte - 1];
  free_block(const_cast<unsigned char*>(block), megabytes);
  return last;
}

TEST(LargeBlocks, AreKeptUpToAQuarterOfAGigabyte) {
  keep_freed_memory();
  for (const std::size_t megabytes : {31, 40, 256}) {
    free_block(filled(megabytes, 7), megabytes);
    EXPECT_EQ(left_in_new(megabytes), 7) << megabytes;
  }
  free_block(filled(258, 7), 258);
  EXPECT_EQ(left_in_new(258), 0);
}

/// Of 40 MB six fit. Blocks take the place of those that have waited longest.
TEST(LargeBlocks, TheLastOnesStay) {
  keep_freed_memory();
  std::vector<void*> blocks;
  for (int i = 1; i <= 9; ++i) blocks.push_back(filled(40, i));
  for (void* block : blocks) free_block(block, 40);
  std::vector<int> left;
  blocks.clear();
  for (int i = 0; i < 7; ++i) {
    blocks.push_back(::operator new(40 * kMegabyte));
    left.push_back(static_cast<unsigned char*>(blocks.back())[40 * kMegabyte - 1]);
  }
  for (void* block : blocks) free_block(block, 40);
  std::sort(left.begin(), left.end());
  EXPECT_EQ(left, (std::vector<int>{0, 4, 5, 6, 7, 8, 9}));
}

}  // namespace
}  // namespace isochron
