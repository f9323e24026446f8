#include "app/start_ranks.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <thread>

#include "app/installation.h"
#include "core/base/error.h"
#include "core/base/progress.h"
#include "core/base/ranks.h"

namespace isochron {
namespace {

std::unique_ptr<Ranks> ranks;

/// Open MPI's mpirun, or Slurm's srun with one of its plug-ins for MPI.
bool started_by_mpi() {
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"})
    if (std::getenv(variable)) return true;
  return false;
}

/// Keeps the program from printing what the first rank prints.
void be_silent() {
  spdlog::default_logger()->sinks().clear();
  if (!std::freopen("/dev/null", "w", stdout)) throw std::runtime_error("/dev/null cannot be written");
}

/// What keeps all ranks from starting, which do not know each other yet: the first of them says it, before the others end and
/// mpirun stops it.
InputError cannot_start(const std::string& reason) {
  for (const char* variable : {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"})
    if (const char* rank = std::getenv(variable)) {
      if (std::string(rank) != "0") {
        be_silent();
        std::this_thread::sleep_for(std::chrono::seconds(1));
      }
      break;
    }
  return InputError("started by MPI, " + reason);
}

}  // namespace

void start_ranks() {
  if (!started_by_mpi()) return;
  const std::string file = mpi_module();
  if (!std::filesystem::exists(file))
    throw cannot_start("but built without it (allowed: to install libopenmpi-dev and build again)");
  // Open MPI's own modules look for its symbols among the global ones.
  void* module = dlopen(file.c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (!module)
    throw cannot_start(fmt::format("which needs Open MPI's library (allowed: to install libopenmpi3): {}", dlerror()));
  using Start = Ranks* (*)(bool (*)());
  const auto start = reinterpret_cast<Start>(dlsym(module, "isochron_start_ranks"));
  ranks.reset(start ? start(stop_requested) : nullptr);
  if (!ranks) throw cannot_start("which does not start");
  set_ranks(*ranks);
  if (!first_rank()) be_silent();
}

int fail_alone(const std::string& what) {
  if (first_rank()) {
    spdlog::error("{}", what);
  } else {
    fmt::print(stderr, "isochron: error: rank {}: {}\n", rank(), what);
  }
  if (ranks) ranks->abort(1);
  return 1;
}

int end_ranks(int status) {
  if (!ranks) return status;
  std::fflush(nullptr);
  // Others may wait for this one: once it has gone, mpirun ends them.
  if (stop_requested()) _exit(status);
  ranks.reset();
  return status;
}

}  // namespace isochron
