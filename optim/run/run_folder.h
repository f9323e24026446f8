// The folder of a run: what is in it, what becomes of it when another run comes, and that no two work in it.
#pragma once
#include <functional>
#include <string>

namespace isochron {

/// While it lives, no other process works in the folder: an exclusive flock on FOLDER/.lock, which the system releases
/// when the process ends in any way. Network file systems know it where their server does locks (NFS from Linux 2.6.12
/// on); where it cannot be had, `warning` receives one line and the run goes on. Whoever gets it removes the parts of files that a
/// killed process left.
class FolderLock {
 public:
  /// Throws InputError where another process holds it.
  FolderLock(const std::string& folder, const std::function<void(const std::string&)>& warning);
  ~FolderLock();
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;

 private:
  int descriptor_ = -1;
};

/// Makes `folder` ready for a new run: creates and locks it, and clears the run that it holds (`force`) or renames it
/// to the first free of FOLDER.1, FOLDER.2, ... so that no run is ever overwritten by accident; `warning`
/// receives one line then. Throws InputError, also where another process runs there.
FolderLock prepare_run_folder(const std::string& folder, bool force,
                              const std::function<void(const std::string&)>& warning);

}  // namespace isochron
