// Parameters that the readings determine together only: a gain times albedos, a position plus a relief.
#pragma once
#include <string>
#include <vector>

#include "optim/problem/parameters.h"

namespace isochron {

/// A change of one parameter, by a factor (its values are the parameter's) or by a summand (they are 1).
struct ParameterChange {
  int block;
  bool product;
  std::vector<double> values;  ///< of all unknowns, 0 of other parameters
};

/// Those of every parameter, both kinds where they differ.
std::vector<ParameterChange> parameter_changes(const std::vector<Parameters::Block>& blocks,
                                               const std::vector<double>& theta);

/// A change of whole parameters against each other that readings do not see, or hardly.
struct NullDirection {
  int pivot = 0;               ///< the unknown of a single-component parameter that takes part in it most
  std::vector<double> change;  ///< of each unknown; of the pivot 1

  /// One parameter that takes part besides the pivot. Determined is pivot * other^power, or pivot + power * other.
  struct Partner {
    int block;
    double power;
    bool product;
  };
  std::vector<Partner> partners;
};

/// Of eigenvalues of a matrix of unit diagonal: what round-off leaves of a singular one.
inline constexpr double kRoundOff = 1e-9;

/// Which changes of parameters of many components are looked at.
enum class ChangeKinds { all, factors, summands };

/// Null directions among `changes`, of which `matrix` is the curvature (semidefinite, row after row): eigenvalues, relative to
/// the curvatures of the changes one by one, of at most `tolerance`. Only those with a single-component parameter in them, one
/// for each such pivot, the pivots of all others staying as they are. Noise of a Jacobian of which the matrix was made hides no
/// exact one: both parameters scale or shift the same samples, as of light that is scattered once.
std::vector<NullDirection> null_directions(const std::vector<double>& matrix,
                                           const std::vector<ParameterChange>& changes,
                                           const std::vector<Parameters::Block>& blocks,
                                           const std::vector<double>& theta, double tolerance = kRoundOff,
                                           ChangeKinds kinds = ChangeKinds::all);

/// "gain * paint", "gain * paint^2", "z + relief", "z - 0.5 shift".
std::string combination_name(const std::string& pivot, const std::string& other, const NullDirection::Partner& partner);

}  // namespace isochron
