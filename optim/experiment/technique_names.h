// The key `techniques` of an experiment's `estimator`.
#pragma once
#include <string>
#include <vector>

#include "core/base/description.h"
#include "core/paths/options.h"

namespace isochron {

/// A list of the techniques that may be used, to measure what each brings; what it leaves out is set in `options`, whose `sampling` and
/// `light` have to be known before.
Field techniques(EstimatorOptions& options);
/// Those that may be used, by their names in the list.
std::vector<std::string> used_techniques(const EstimatorOptions& options);
/// One of these less. Of standard sampling and connections one has to stay.
void leave_out(const std::string& technique, EstimatorOptions& options);
/// Whether `options` leaves out any that the list alone can leave out.
bool leaves_out_techniques(const EstimatorOptions& options);

}  // namespace isochron
