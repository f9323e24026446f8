// Where the light and the loss gradient of an experiment's full model come from, measured. See advice.h for
// what follows.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "optim/analysis/reduction.h"
#include "optim/analysis/sample_split.h"
#include "optim/problem/estimates.h"
#include "optim/problem/problem.h"

namespace isochron {

/// Where to look: theta, and what to call it.
struct InspectedPoint {
  std::string name;
  std::vector<double> theta;
};
/// The point to start from and, where the target values are known, half way and nine tenths of the way to
/// them.
std::vector<InspectedPoint> points_to_inspect(const Parameters& parameters, const std::vector<double>& start);

/// The most bounces that the experiment knows: of its model or of its rendered target.
int full_bounces(const Experiment& experiment);

/// Shares of the light, [bounces][gate], of the light on paths that meet a shape, [shape], and by [technique]; of the sum of
/// all. Shares of the gradient by terms in the order of kTerms: of the projections on the whole gradient;
/// [term][bounces], [term][gate], [term][technique] and [term][shape] (see GradientBreakdown::by_shape; paths may meet several
/// shapes).
struct Shares {
  Statistics light, light_by_shape, light_by_technique;
  Statistics by_bounces, by_gate, by_shape, by_technique;
};

struct PointInspection {
  InspectedPoint point;
  /// With a unit of each unknown that makes them comparable: the root mean square, over its parameter, of the
  /// way from initial to target values; 1 where that is unknown or zero.
  GradientReplicates gradient{0, 0};
  Shares shares;
  std::array<bool, 3> can_be{};  ///< whether a term can be other than zero at all
  std::array<bool, 3> found{};   ///< whether it was in any sample
  PerPass samples{};             ///< per pixel and replicate, of images and terms
  /// What each technique takes of the work of images and terms.
  std::array<std::array<double, kTechniques>, kPasses> work{};
  GatedImage target;  ///< mean over the replicates
};

/// Measures light and gradient of the full model (full_bounces) in independent replicates, as many samples
/// each as fit into so many CPU seconds (at least one per pixel). Images at theta and at the target
/// values share their random numbers: where they look alike their difference has little noise.
PointInspection inspect_point(const Problem& problem, const InspectedPoint& point, double seconds);

/// Per unknown: see PointInspection::gradient.
std::vector<double> comparable_units(const Parameters& parameters);

/// Random numbers of inspections, apart from those of any iteration.
Stream inspection_stream(const Problem& problem, Pass pass, int index);

}  // namespace isochron
