#include "core/base/listed_sum.h"

#include <utility>

namespace isochron {

void ListedSum::tidy() {
  // Stable, so that what is added to one number is added in the order in which it came.
  std::stable_sort(list_.begin(), list_.end(), [](const Entry& a, const Entry& b) { return a.index < b.index; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < list_.size(); ++i) {
    if (kept > 0 && list_[kept - 1].index == list_[i].index)
      list_[kept - 1].value += list_[i].value;
    else
      list_[kept++] = list_[i];
  }
  list_.resize(kept);
  most_ = std::max(kFewestEntries, 2 * kept);
  keep_all_if_many();
}

void ListedSum::keep_all_if_many() {
  // An entry takes twice the memory of a number; to find it takes longer.
  if (4 * list_.size() <= size_) return;
  all_ = SparseSum(size_);
  for (const Entry& entry : list_) all_.add(entry.index, entry.value);
  list_ = {};
  listed_ = false;
}

void ListedSum::finish() {
  if (!listed_) return;
  list_latest();
  if (!listed_) return;
  tidy();
  list_.shrink_to_fit();
}

void ListedSum::add(const ListedSum& other) {
  if (!other.listed_) {
    if (!listed_) return all_.add(other.all_);
    all_ = SparseSum(size_);
    for (const Entry& entry : std::exchange(list_, {})) all_.add(entry.index, entry.value);
    listed_ = false;
    return all_.add(other.all_);
  }
  if (!listed_) {
    for (const Entry& entry : other.list_) all_.add(entry.index, entry.value);
    return;
  }
  std::vector<Entry> both;
  both.reserve(list_.size() + other.list_.size());
  auto a = list_.cbegin(), b = other.list_.cbegin();
  while (a != list_.cend() && b != other.list_.cend()) {
    if (a->index == b->index) {
      both.push_back({a->index, a->value + b->value});
      ++a, ++b;
    } else {
      both.push_back(a->index < b->index ? *a++ : *b++);
    }
  }
  both.insert(both.end(), a, list_.cend());
  both.insert(both.end(), b, other.list_.cend());
  list_ = std::move(both);
  keep_all_if_many();
}

void ListedSum::pack(Packer& packer) const {
  packer.put(size_);
  packer.put(listed_);
  packer.put(list_);
  if (!listed_) all_.pack(packer);
}

void ListedSum::unpack(Unpacker& unpacker) {
  *this = ListedSum();
  unpacker.get(size_);
  unpacker.get(listed_);
  unpacker.get(list_);
  if (!listed_) all_.unpack(unpacker);
}

}  // namespace isochron
