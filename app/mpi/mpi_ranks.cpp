// Ranks through MPI: a module of its own, which is loaded where mpirun started the program, and by nothing else.
#include <mpi.h>

#include <algorithm>
#include <thread>

#include "core/base/ranks.h"

namespace isochron {
namespace {

/// What one message holds at most: MPI counts in int.
constexpr std::size_t kMostBytes = 1 << 30;
constexpr int kTag = 0;

class MpiRanks : public Ranks {
 public:
  explicit MpiRanks(bool (*stop_requested)()) : stop_requested_(stop_requested) {
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    MPI_Comm here;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &here);
    MPI_Comm_size(here, &count_here_);
    MPI_Comm_free(&here);
  }
  ~MpiRanks() override {
    // Out of step, MPI_Finalize could wait for ever.
    if (in_step_ && !stop_requested_()) MPI_Finalize();
  }

  int rank() const override { return rank_; }
  int count() const override { return count_; }
  int count_here() const override { return count_here_; }

  bool broadcast(std::string& bytes) override {
    return in_parts(bytes, [](void* part, int size, MPI_Request* request) {
      MPI_Ibcast(part, size, MPI_BYTE, 0, MPI_COMM_WORLD, request);
    });
  }
  bool send(int to, const std::string& bytes) override {
    std::string& data = const_cast<std::string&>(bytes);  // sending does not change it
    return in_parts(data, [to](const void* part, int size, MPI_Request* request) {
      MPI_Isend(part, size, MPI_BYTE, to, kTag, MPI_COMM_WORLD, request);
    });
  }
  bool receive(int from, std::string& bytes) override {
    return in_parts(bytes, [from](void* part, int size, MPI_Request* request) {
      MPI_Irecv(part, size, MPI_BYTE, from, kTag, MPI_COMM_WORLD, request);
    });
  }
  void abort(int status) override { MPI_Abort(MPI_COMM_WORLD, status); }

 private:
  /// start(data, size, request) for the number of bytes, so that whoever receives them makes room, and then for the bytes.
  template <class Start>
  bool in_parts(std::string& bytes, const Start& start) {
    unsigned long long size = bytes.size();
    MPI_Request request;
    if (!in_step_) return false;
    start(&size, sizeof(size), &request);
    if (!wait(request)) return false;
    bytes.resize(size);
    for (std::size_t done = 0; done < size; done += kMostBytes) {
      start(bytes.data() + done, static_cast<int>(std::min<std::size_t>(size - done, kMostBytes)), &request);
      if (!wait(request)) return false;
    }
    return true;
  }

  /// Gives way to other processes, as there may be more ranks than cores.
  bool wait(MPI_Request& request) {
    for (int done = 0;;) {
      MPI_Test(&request, &done, MPI_STATUS_IGNORE);
      if (done) return true;
      if (stop_requested_()) return in_step_ = false;
      std::this_thread::yield();
    }
  }

  bool (*const stop_requested_)();
  int rank_ = 0, count_ = 1, count_here_ = 1;
  bool in_step_ = true;
};

}  // namespace
}  // namespace isochron

extern "C" isochron::Ranks* isochron_start_ranks(bool (*stop_requested)()) {
  int threads = MPI_THREAD_SINGLE;
  if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &threads) != MPI_SUCCESS) return nullptr;
  return new isochron::MpiRanks(stop_requested);
}
