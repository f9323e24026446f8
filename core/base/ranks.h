// Processes that share the work of one command, as mpirun starts them: ranks. All run the same program on the same input and
// call what is below in the same order; without mpirun there is one, and nothing of it costs anything. Only rank 0 reads
// what users give, writes files and prints.
#pragma once
#include <cstdint>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace isochron {

/// How ranks reach each other. Messages are bytes of any number. Everything waits for the others, unless the process is told to
/// stop: then it returns false, and the ranks are out of step for good.
class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual int rank() const = 0;
  virtual int count() const = 0;
  /// Of those on this machine, which share its memory.
  virtual int count_here() const = 0;
  /// Rank 0's bytes, to all.
  virtual bool broadcast(std::string& bytes) = 0;
  virtual bool send(int to, const std::string& bytes) = 0;
  virtual bool receive(int from, std::string& bytes) = 0;
  /// Ends them all where they cannot go on together.
  virtual void abort(int status) = 0;
};

/// To be called once, before anything else. `ranks` must outlive all work.
void set_ranks(Ranks& ranks);

int rank();
int rank_count();
int rank_count_here();
inline bool first_rank() {
  return rank() == 0;
}

/// Of all ranks' bytes, in their order.
std::vector<std::string> gather(const std::string& own);
/// Throw Interrupted once a stop is requested.
void send(int to, const std::string& bytes);
std::string receive(int from);
void broadcast(std::string& bytes);

/// Thrown by all ranks alike, which stay in step.
struct SharedError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Runs f only on rank 0, where what is called from it does not wait for other ranks. An exception that f throws there is
/// thrown by all: an InputError, or else a SharedError with its message. After a request to stop the others do nothing.
void on_first_rank(const std::function<void()>& f);
/// The same, where f returns something for all.
std::string from_first_rank(const std::function<std::string()>& f);

/// Things in a row that a rank takes.
struct RankPart {
  int begin, end;
};
/// How ranks share things in a row: each takes a part, one after the other.
class RankParts {
 public:
  /// Parts of even cost, as far as whole things make them. `costs`: one of each of the `count` things, the same on all ranks;
  /// of another number of things, or zero in all: they count alike. A rank's part can be empty, but that of the first.
  explicit RankParts(int count, const std::vector<double>& costs = {});
  RankPart of(int rank) const { return {begin_[rank], begin_[rank + 1]}; }
  RankPart own() const { return of(rank()); }
  int rank_of(int thing) const;

 private:
  std::vector<int> begin_;  ///< of each rank's part, and behind the last
};

/// Bytes of plain values, put one behind the other and taken out in the same order.
class Packer {
 public:
  template <class T>
  void put(const T* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
  }
  template <class T>
  void put(const T& value) {
    put(&value, 1);
  }
  /// With its length.
  template <class T>
  void put(const std::vector<T>& values) {
    put(static_cast<std::uint64_t>(values.size()));
    put(values.data(), values.size());
  }
  std::string bytes;
};

class Unpacker {
 public:
  explicit Unpacker(const std::string& bytes) : at_(bytes.data()) {}
  template <class T>
  void get(T* values, std::size_t count) {
    if (count > 0) std::memcpy(values, at_, count * sizeof(T));
    at_ += count * sizeof(T);
  }
  template <class T>
  void get(T& value) {
    get(&value, 1);
  }
  template <class T>
  void get(std::vector<T>& values) {
    std::uint64_t count = 0;
    get(count);
    values.resize(count);
    get(values.data(), count);
  }

 private:
  const char* at_;
};

/// A plain value of every rank, in their order.
template <class T>
std::vector<T> of_all_ranks(const T& own) {
  if (rank_count() == 1) return {own};
  Packer packer;
  packer.put(own);
  std::vector<T> values;
  for (const std::string& bytes : gather(packer.bytes)) Unpacker(bytes).get(values.emplace_back());
  return values;
}

/// Sum over all ranks, in their order.
template <class T>
T sum_over_ranks(const T& own) {
  T sum{};
  for (const T& value : of_all_ranks(own)) sum += value;
  return sum;
}

/// Each rank has made its part of things; gathers the parts of all: pack(packer, thing) and unpack(unpacker, thing) of each.
template <class Pack, class Unpack>
void all_gather_parts(const RankParts& parts, Pack&& pack, Unpack&& unpack) {
  if (rank_count() == 1) return;
  Packer own;
  for (int i = parts.own().begin; i < parts.own().end; ++i) pack(own, i);
  const std::vector<std::string> all = gather(own.bytes);
  for (int r = 0; r < rank_count(); ++r) {
    if (r == rank()) continue;
    Unpacker other(all[r]);
    for (int i = parts.of(r).begin; i < parts.of(r).end; ++i) unpack(other, i);
  }
}
/// The same for one or more vectors of plain values, or of vectors of them.
template <class... Item>
void all_gather_parts(const RankParts& parts, std::vector<Item>&... items) {
  all_gather_parts(
      parts, [&](Packer& packer, int i) { (packer.put(items[i]), ...); },
      [&](Unpacker& unpacker, int i) { (unpacker.get(items[i]), ...); });
}

}  // namespace isochron
