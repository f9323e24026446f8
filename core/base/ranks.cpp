#include "core/base/ranks.h"

#include <algorithm>
#include <numeric>

#include "core/base/error.h"
#include "core/base/progress.h"

namespace isochron {
namespace {

Ranks* all_ranks = nullptr;
int alone = 0;  ///< calls of on_first_rank that are under way

bool shared() {
  return all_ranks != nullptr && alone == 0;
}

void require(bool in_step) {
  if (!in_step) throw Interrupted{};
}

/// While it lives, rank 0 works without the others.
struct OnlyFirstRank {
  OnlyFirstRank() { ++alone; }
  ~OnlyFirstRank() { --alone; }
};

/// What came of f on rank 0: its text behind one of these.
constexpr char kDone = 'd', kInputError = 'i', kFailed = 'f';

std::string outcome(const std::function<std::string()>& f) {
  const OnlyFirstRank guard;
  try {
    return kDone + f();
  } catch (const InputError& error) {
    return kInputError + std::string(error.what());
  } catch (const std::exception& error) {
    return kFailed + std::string(error.what());
  }
}

}  // namespace

void set_ranks(Ranks& ranks) {
  all_ranks = &ranks;
}

int rank() {
  return all_ranks ? all_ranks->rank() : 0;
}
int rank_count() {
  return shared() ? all_ranks->count() : 1;
}
int rank_count_here() {
  return all_ranks ? all_ranks->count_here() : 1;
}

void send(int to, const std::string& bytes) {
  require(all_ranks->send(to, bytes));
}

std::string receive(int from) {
  std::string bytes;
  require(all_ranks->receive(from, bytes));
  return bytes;
}

void broadcast(std::string& bytes) {
  if (rank_count() > 1) require(all_ranks->broadcast(bytes));
}

std::vector<std::string> gather(const std::string& own) {
  std::vector<std::string> all(rank_count());
  if (all.size() == 1) return {own};
  Packer packed;
  if (first_rank()) {
    for (int r = 0; r < rank_count(); ++r) {
      all[r] = r == 0 ? own : receive(r);
      packed.put(static_cast<std::uint64_t>(all[r].size()));
      packed.put(all[r].data(), all[r].size());
    }
  } else {
    send(0, own);
  }
  broadcast(packed.bytes);
  Unpacker unpacker(packed.bytes);
  for (std::string& bytes : all) {
    std::uint64_t size = 0;
    unpacker.get(size);
    bytes.resize(size);
    unpacker.get(bytes.data(), size);
  }
  return all;
}

std::string from_first_rank(const std::function<std::string()>& f) {
  if (!shared() || all_ranks->count() == 1) return f();
  if (stop_requested()) {  // the others may have left
    require(first_rank());
    const OnlyFirstRank guard;
    return f();
  }
  std::string result;
  if (first_rank()) result = outcome(f);
  broadcast(result);
  const std::string text = result.substr(1);
  if (result[0] == kInputError) throw InputError(text);
  if (result[0] == kFailed) throw SharedError(text);
  return text;
}

void on_first_rank(const std::function<void()>& f) {
  if (stop_requested() && !first_rank()) return;
  from_first_rank([&] {
    f();
    return std::string();
  });
}

RankParts::RankParts(int count, const std::vector<double>& costs) {
  std::vector<double> before(count + 1);  // cost of the things in front
  std::iota(before.begin(), before.end(), 0.0);
  if (static_cast<int>(costs.size()) == count &&
      std::any_of(costs.begin(), costs.end(), [](double c) { return c > 0; }))
    std::partial_sum(costs.begin(), costs.end(), before.begin() + 1);
  const int ranks = rank_count();
  begin_.assign(ranks + 1, count);
  begin_[0] = 0;
  for (int r = 1, i = std::min(1, count); r < ranks; ++r) {
    const double cut = before[count] * r / ranks;
    while (i < count && before[i] + before[i + 1] <= 2 * cut) ++i;  // the boundary that is closest
    begin_[r] = i;
  }
}

int RankParts::rank_of(int thing) const {
  return static_cast<int>(std::upper_bound(begin_.begin(), begin_.end() - 1, thing) - begin_.begin()) - 1;
}

}  // namespace isochron
