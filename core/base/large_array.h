// Arrays of many megabytes that are read here and there: in pages of 2 MiB where the system has them, so that a read does not
// wait for the page's address as well.
#pragma once
#include <sys/mman.h>

#include <cstddef>
#include <new>
#include <vector>

namespace isochron {

template <class T>
struct LargePageAllocator {
  using value_type = T;
  LargePageAllocator() = default;
  template <class U>
  LargePageAllocator(const LargePageAllocator<U>&) {}

  T* allocate(std::size_t n) {
    const std::size_t bytes = n * sizeof(T);
    void* memory = ::operator new(bytes, alignment(bytes));
    if (bytes >= kFewestBytes) madvise(memory, bytes, MADV_HUGEPAGE);  // as good as it was where that fails
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t n) { ::operator delete(memory, alignment(n * sizeof(T))); }
  friend bool operator==(const LargePageAllocator&, const LargePageAllocator&) { return true; }

 private:
  static constexpr std::size_t kPage = std::size_t{2} << 20, kFewestBytes = 2 * kPage;
  static std::align_val_t alignment(std::size_t bytes) {
    return std::align_val_t{bytes >= kFewestBytes ? kPage : alignof(T)};
  }
};

template <class T>
using LargeArray = std::vector<T, LargePageAllocator<T>>;

/// Asks early for a record that begins with a cache line: all of its lines.
template <class T>
void prefetch(const T& record) {
  constexpr std::size_t kLine = 64;
  static_assert(alignof(T) >= kLine);
  const char* address = reinterpret_cast<const char*>(&record);
  for (std::size_t i = 0; i < sizeof(T); i += kLine) __builtin_prefetch(address + i);
}

}  // namespace isochron
