// Where methods fail: a map over the width of the gates and the method. In each cell: do estimates of the
// loss gradient point the right way, and does a short reconstruction come near the target? All methods get
// the same CPU time for a gradient.
#pragma once
#include <string>
#include <vector>

#include "optim/analysis/chart.h"

namespace isochron {

/// Why a method fails, as measured where the reconstruction starts.
enum class Failure {
  none,
  no_signal,  ///< half of the estimates or more are exactly zero, or the true gradient is lost in the
              ///< reference's noise and the method's own noise is not larger still
  bias,       ///< the larger part of the error, significant, and at least a tenth of the gradient
  variance,   ///< the larger part of the error, and at least half of the gradient
  descent     ///< neither: the gradient is right at the start, but following it does not lead to the target
};
const char* name(Failure failure);

/// Gradient estimates of one cell against its reference.
struct Direction {
  double positive = 0;  ///< share of the estimates with a positive cosine
  Measured cosine;      ///< mean over the estimates; that of a zero estimate is 0
  double zero = 0;      ///< share of the estimates that are exactly zero
  Measured variance;    ///< of one estimate, relative to the gradient's squared norm
  SquaredNorm bias2;    ///< likewise
};

/// Where the reference is not resolved, squares are relative to the most that the gradient's may be, two
/// standard errors above the estimate; absolute where it is zero.
Direction direction(const Repeats& estimates, const Reference& reference);

/// A method works where the reconstruction leaves at most this share of the initial error, and its estimates
/// point the right way at least so often (the toss of a coin reaches that in 8 % of cells).
inline constexpr double kWorksError = 0.25, kWorksPositive = 2.0 / 3;

/// `error_ratio`: of the reconstruction; NaN where there was none, which then does not count.
Failure failure(const Direction& direction, bool reference_resolved, double error_ratio);

struct StabilityOptions {
  std::vector<double> widths;  ///< standard deviation of the gates over the path length; 0: Dirac gates
  double core_seconds = 360;   ///< for the whole map, about; but a sample per term and pixel at least
  int iterations = 50;         ///< of a reconstruction
  std::vector<double> steps;   ///< of finite differences
  std::function<void(const std::string&)> progress;  ///< one line
};

struct StabilityCell {
  double width = 0;
  std::string method;
  double factor = 0;        ///< samples, in units of the experiment's
  double core_seconds = 0;  ///< of a gradient
  Direction direction;
  double error_ratio = 0;  ///< parameters' RMS error at the end over that at the start; NaN without target values
  Failure failure = Failure::none;
  double reference_error = 0;
};

struct Stability {
  std::vector<StabilityCell> cells;  ///< width by width, the methods in the same order
  std::vector<std::string> notes;
};

/// Whether the method can find paths at all under the experiment's gates: Dirac gates need lengths drawn from them and, for derivatives,
/// paths that keep them.
bool may_find(const Method& method, Experiment experiment);

/// The gates with another standard deviation, relative to the mean of their centres: all lengths of the shape
/// scaled; Dirac gates for width 0. Throws InputError for steady and modulated gates, which have no width.
GateSpec with_relative_width(const GateSpec& gates, double width);

/// Throws InputError for gates without a width and for measured targets, which have one width of gates only.
Stability map_stability(const Experiment& experiment, const StabilityOptions& options);

/// `width,method,factor,core_seconds,positive,cosine,cosine_error,zero,variance,bias2,bias2_error,error_ratio,
/// reference_error,failure`
std::string stability_csv(const Stability& map);
/// A row per width, a column per method: share of right directions, error ratio, reason of failure.
std::string stability_table(const Stability& map);

}  // namespace isochron
