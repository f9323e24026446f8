// Histograms of captures: counts of a target's file for the experiment's bins, and readings written like them.
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "core/image/stored_image.h"
#include "core/scene/scene.h"
#include "optim/experiment/experiment.h"

namespace isochron {

/// Counts of the file that the target names, for the bins of the experiment's gates, each of which holds one or several of the
/// file's; gates without bins of their own get those of the file that `target.window` leaves. Empty where the target is none of a
/// capture. Throws InputError where bins or sensor points do not fit. `warning`, unless empty, receives a line for what the file lacks.
std::optional<GatedImage> read_counts(Experiment& experiment, const Scene& scene,
                                      const std::function<void(const std::string&)>& warning = {});

/// Whether readings are histograms of a capture, so that write_histograms has something to write.
bool has_histograms(const Experiment& experiment, const Scene& scene);

/// Writes readings of a capture's bins as the HDF5 file of a measurement; false where they are none.
bool write_histograms(const std::string& file, const Experiment& experiment, const Scene& scene,
                      const StoredImage& readings);
bool write_histograms(const std::string& file, const Experiment& experiment, const Scene& scene,
                      const GatedImage& readings);

}  // namespace isochron
