#include "core/base/large_blocks.h"

#include <malloc.h>
#include <sys/mman.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <mutex>
#include <new>
#include <utility>

namespace isochron {
namespace {

/// The kernel clears 2 MiB at a time in place of 4 KiB. A gradient of 16384 histograms of 512 bins takes half the processor's time of what
/// it takes with small pages.
constexpr std::size_t kHugePage = std::size_t{2} << 20, kLarge = 2 * kHugePage;

/// What the library keeps by itself, aligned to a huge page, and what is kept of larger blocks in all.
constexpr std::size_t kOfLibrary = std::size_t{32} << 20, kMostKept = std::size_t{256} << 20;

std::size_t whole_pages(std::size_t size) {
  return (size + kHugePage - 1) / kHugePage * kHugePage;
}

/// Freed blocks that the library would give back to the system: a gradient of 16384 histograms of 245 bins, of which an eighth is rendered,
/// takes a tenth of its time for fresh pages.
class KeptBlocks {
 public:
  void begin() { on_ = true; }

  /// Null: none of that size.
  void* take(std::size_t size) {
    const std::lock_guard lock(mutex_);
    for (Block& block : blocks_)
      if (block.size == size) return std::exchange(block, {}).memory;
    return nullptr;
  }

  /// In the place of those that have waited longest, so that all stay within kMostKept.
  void put(void* memory, std::size_t size) {
    if (!on_ || size > kMostKept) return std::free(memory);
    const std::lock_guard lock(mutex_);
    std::size_t kept = size;
    for (const Block& block : blocks_) kept += block.size;
    Block* oldest = nullptr;
    do {
      oldest = &blocks_[next_++ % blocks_.size()];
      kept -= oldest->size;
      std::free(std::exchange(*oldest, {}).memory);
    } while (kept > kMostKept);
    *oldest = {memory, size};
  }

 private:
  struct Block {
    void* memory = nullptr;
    std::size_t size = 0;
  };
  std::mutex mutex_;
  std::array<Block, 16> blocks_;
  std::size_t next_ = 0;
  bool on_ = false;
};

constinit KeptBlocks kept_blocks;

bool is_kept(std::size_t whole) {
  return whole + kHugePage > kOfLibrary;
}

void* allocate(std::size_t size) {
  if (size < kLarge || size > SIZE_MAX - kHugePage) return std::malloc(size > 0 ? size : 1);
  const std::size_t whole = whole_pages(size);
  if (is_kept(whole))
    if (void* block = kept_blocks.take(whole)) return block;
  void* block = std::aligned_alloc(kHugePage, whole);
  if (block) madvise(block, whole, MADV_HUGEPAGE);  // where there are none the kernel says so, which changes nothing
  return block;
}

void deallocate(void* block, std::size_t size) {
  if (size < kLarge || !is_kept(whole_pages(size))) return std::free(block);
  kept_blocks.put(block, whole_pages(size));
}

}  // namespace

void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, kOfLibrary);  // the most that the GNU library takes
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  kept_blocks.begin();
}

}  // namespace isochron

void* operator new(std::size_t size) {
  for (;;) {
    if (void* block = isochron::allocate(size)) return block;
    const std::new_handler handler = std::get_new_handler();
    if (!handler) throw std::bad_alloc();
    handler();
  }
}

void operator delete(void* block) noexcept {
  std::free(block);
}

void operator delete(void* block, std::size_t size) noexcept {
  isochron::deallocate(block, size);
}
