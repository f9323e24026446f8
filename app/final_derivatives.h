#pragma once
#include <string>

namespace isochron {

/// Renders derivative images at the final parameters of a run that has ended (of one in levels: its last) into
/// FOLDER/report/derivatives, for its report: of
/// one unknown of each of the first parameters, with as many samples as about two seconds allow. Does nothing where
/// they are there already, or the run has not ended. Throws InputError, and Interrupted on a request to stop.
void write_final_derivatives(const std::string& folder);

}  // namespace isochron
