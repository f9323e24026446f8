// From a capture to an experiment whose run finds the hidden surface.
//
// The start is a mesh of the albedos that make the counts most likely (likely_albedos.h, start_surface.h). The fit moves all vertices
// freely, in levels, under four priors. Two weights follow from the evidence of the level before (evidence.h): in the first prior that of
// how evenly the surface bends, and that of the third.
// - The surface and its borders bend little, and evenly (bending.h).
// - It does not move far from where a level began: offsets of neighbours differ by a sixteenth of their distance.
// - Albedos differ little, by 6 % across the surface. One that falls off freely imitates a border that is elsewhere, and tilts
//   the surface to do so.
// - Only the product of gain and albedo is known: the gain is that of a start with an albedo of a quarter, so that parts may be four
//   times as bright, or the surface a quarter as large.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "optim/experiment/experiment.h"

namespace isochron {

/// Of ReconstructionSpec::seconds.
inline constexpr double kLeastSeconds = 0.1, kMostSeconds = 1e6;

struct ReconstructionSpec {
  std::string capture;   ///< HDF5 file
  std::string response;  ///< table of how much later than it arrives light is counted, ps; empty: as it arrives
  double seconds = 300;  ///< for which the fit has samples, on two cores: see fit_settings
  std::uint64_t seed = 1;
};

/// What a run of that begins with.
struct Reconstruction {
  bool has_signal = false;
  /// Photons in all histograms from the weakest surface of the size of a resolution cell that is significant above the background.
  double photons_needed = 0;
  /// By name, beside what the run writes: scene.yaml, start.ply, back_projection.ply, start.yaml (RunOptions::files).
  std::map<std::string, std::string> files;
  std::string experiment;  ///< contents of experiment.yaml, which reads the first two
};

/// Reads the capture and makes a start. `place` is a folder for what it writes on the way: scene.yaml, start.ply, experiment.yaml, and
/// mask.npy where some points have no counts. Throws InputError.
Reconstruction begin_reconstruction(const ReconstructionSpec& spec, const std::string& place,
                                    const std::function<void(const std::string&)>& warning);

}  // namespace isochron
