// The folder of a run: what is in it, and what becomes of it when another run comes.
#pragma once
#include <functional>
#include <string>

namespace isochron {

/// Makes `folder` ready for a new run: creates it, and clears the run that it holds (`force`) or renames it
/// to the first free of FOLDER.1, FOLDER.2, ... so that no run is ever overwritten by accident; `warning`
/// receives one line then. Throws InputError.
void prepare_run_folder(const std::string& folder, bool force, const std::function<void(const std::string&)>& warning);

}  // namespace isochron
