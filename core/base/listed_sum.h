// Sums over so many numbers that a pass may touch only a few of them, far from each other: the values of an image of many
// gates.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "core/base/ranks.h"
#include "core/base/sparse_sum.h"

namespace isochron {

/// A long vector of sums that start at zero: a list of those that were added to, while they are few, then all of them. The bits
/// are those of a SparseSum, whichever it is.
class ListedSum {
 public:
  ListedSum() = default;
  explicit ListedSum(std::size_t size) : size_(size), listed_(size > kSmall) {
    if (!listed_) all_ = SparseSum(size);
  }

  std::size_t size() const { return size_; }
  /// The sums i ... i + count - 1, to be added to until this is called again; count is at most 64.
  double* at(std::size_t i, int count) {
    if (!listed_) return all_.at(i, count);
    list_latest();
    if (!listed_) return all_.at(i, count);
    first_ = i;
    count_ = count;
    std::fill_n(latest_.begin(), count, 0.0);
    return latest_.data();
  }

  /// Adds another vector of the same size. Both were finished.
  void add(const ListedSum& other);

  /// To be called once nothing more is added by `at`, before all else.
  void finish();

  /// f(i, value) for sums in [begin, end) that can be other than zero, in order.
  template <class F>
  void for_each(std::size_t begin, std::size_t end, F&& f) const {
    if (!listed_) return all_.for_each(begin, end, f);
    auto at = std::lower_bound(list_.begin(), list_.end(), begin,
                               [](const Entry& entry, std::size_t index) { return entry.index < index; });
    for (; at != list_.end() && at->index < end; ++at) f(at->index, at->value);
  }

  /// Of what it holds, about.
  std::size_t bytes() const { return listed_ ? list_.size() * sizeof(Entry) : size_ * sizeof(double); }

  void pack(Packer& packer) const;
  void unpack(Unpacker& unpacker);

 private:
  struct Entry {
    std::uint64_t index;
    double value;
  };
  static constexpr int kMostAtOnce = 64;
  /// Of so few numbers all are kept: they stay in the cache.
  static constexpr std::size_t kSmall = std::size_t{1} << 17;
  static constexpr std::size_t kFewestEntries = 1024;

  void list_latest() {
    for (int k = 0; k < count_; ++k)
      if (latest_[k] != 0) list_.push_back({first_ + k, latest_[k]});
    count_ = 0;
    if (list_.size() >= most_) tidy();
  }
  /// Sorts the list, with one entry for each number.
  void tidy();
  void keep_all_if_many();

  std::size_t size_ = 0;
  bool listed_ = false;
  SparseSum all_;                      ///< where they are not listed
  std::vector<Entry> list_;            ///< in the order in which they were added; once finished, sorted
  std::size_t most_ = kFewestEntries;  ///< entries, until the list is made tidy
  std::size_t first_ = 0;              ///< of the latest, which are not in the list yet
  int count_ = 0;
  std::array<double, kMostAtOnce> latest_{};
};

}  // namespace isochron
