#include "optim/run/run_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <utility>

#include "core/base/error.h"
#include "core/base/file.h"
#include "optim/experiment/files.h"

namespace isochron {
namespace {

/// Folders within that of a run.
constexpr const char* kParts[] = {"inputs", "geometry", "frames", "report", "levels"};

void remove_files(const std::string& folder, std::initializer_list<const char*> names) {
  for (const char* name : names) std::filesystem::remove(std::filesystem::path(folder) / name);
}

/// What a run would go on from.
void clear_state(const std::string& folder) {
  remove_files(folder, {"checkpoint.yaml", "checkpoint.previous.yaml", "checkpoint.new.yaml", "log.csv", "summary.yaml",
                        "target.exr"});
  if (file_exists(folder + "/levels/1/experiment.yaml")) std::filesystem::remove_all(folder + "/levels");
}

/// Everything a run writes, experiment.yaml first: without it a half-cleared folder is no run. Of a reconstruction's files those stay that its
/// experiment reads, scene.yaml and start.ply: another run may be of these.
void clear_run(const std::string& folder) {
  remove_files(folder, {"experiment.yaml"});
  clear_state(folder);
  remove_files(folder, {"own_loss.yaml", "initial.exr", "final.exr", "final.h5", "target.png", "initial.png",
                        "final.png", "residual.png", "rmse.png", "capture.png", "report.html", "start.yaml",
                        "surface.png", "back_projection.ply"});
  for (const char* part : kParts) std::filesystem::remove_all(std::filesystem::path(folder) / part);
}

/// Renames a folder to the first free of FOLDER.1, FOLDER.2, ...; returns the new name.
std::string set_aside(const std::string& folder) {
  const std::string base = std::filesystem::path(folder + "/").parent_path().string();
  for (int i = 1;; ++i) {
    const std::string kept = fmt::format("{}.{}", base, i);
    if (std::filesystem::exists(kept)) continue;
    std::error_code error;
    std::filesystem::rename(base, kept, error);
    if (error)
      throw InputError(
          fmt::format("{}: holds a run already, which cannot be moved to {}: {} (allowed: -o for another "
                      "folder, --force to overwrite)",
                      base, kept, error.message()));
    return kept;
  }
}

}  // namespace

FolderLock::FolderLock(const std::string& folder, const std::function<void(const std::string&)>& warning) {
  const std::string file = folder + "/.lock";
  const auto complain = [&] {
    if (warning)
      warning(fmt::format("{}: cannot be locked: {}; make sure that nothing else runs in its folder", file,
                          std::strerror(errno)));
  };
  descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) {
    complain();
    return;
  }
  int result = 0;
  do result = ::flock(descriptor_, LOCK_EX | LOCK_NB);
  while (result != 0 && errno == EINTR);
  if (result == 0) {
    remove_temporaries(folder);
    for (const char* part : kParts) remove_temporaries(folder + "/" + part);
    return;
  }
  if (errno == EWOULDBLOCK) {
    ::close(descriptor_);
    throw InputError(
        fmt::format("{}: another isochron is running in this folder (allowed: -o for another, or wait)", folder));
  }
  complain();
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

FolderLock::FolderLock(FolderLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderLock prepare_run_folder(const std::string& folder, bool force,
                              const std::function<void(const std::string&)>& warning) {
  make_output_folder(folder);
  FolderLock lock(folder, warning);
  if (!std::filesystem::exists(folder + "/experiment.yaml")) {
    clear_state(folder);  // as a run leaves it that was killed while its folder was cleared
    return lock;
  }
  if (force) {
    clear_run(folder);
    return lock;
  }
  const std::string kept = set_aside(folder);  // and the lock with it, until this returns
  if (warning) warning(fmt::format("{} held a run already: moved to {}", folder, kept));
  make_output_folder(folder);
  return FolderLock(folder, warning);
}

}  // namespace isochron
