// How well the readings determine the unknowns where a run ends: from the Gauss-Newton matrix of the loss, all unknowns together.
//
// The covariance is that of the posterior: `scale` times the inverse of H + P, with H the curvature J'WJ of the readings' loss
// and P that of the smoothing. Errors of a pose, a gain or a background are thus what is left after albedos of vertices and the
// like have taken over all that they can.
//
// Noise of the renderer moves what is fitted to images of one set of random numbers: by as much as Newton steps by gradients of
// different random numbers scatter, whose variance is added. Noise in J: H comes from two independent halves of its samples, (J1'W J2 + J2'W J1)
// / 2, which has no bias but noise; J'WJ of all samples is semidefinite, but too large by the noise's own variance, and errors from it are too
// small.
//
// Undetermined is an unknown on which no reading depends; one that takes part in a direction that no reading sees, where only a
// product or a sum is determined (null_directions.h); and one whose error noise hides (joint_errors.h). The first two are judged
// by the readings alone. A penalty on slopes of albedos does have a say in their scale, but its least is at no scale: where
// readings leave a product alone it draws to a bound, and its curvature there is no knowledge.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "optim/problem/null_directions.h"
#include "optim/problem/objective.h"
#include "optim/problem/problem.h"

namespace isochron {

/// A pose, a gain, a colour. Such parameters are looked at one by one, longer ones are fields.
inline constexpr int kFewComponents = 3;

/// Of all unknowns or of some combinations of them, each n x n, row after row.
struct Curvatures {
  std::vector<double> data;   ///< H, without bias; a normal prior of an unknown counts as a reading of it
  std::vector<double> bound;  ///< H of all samples at once: semidefinite, on average too large
  std::vector<double> prior;  ///< P, of smoothing
};

/// What is determined together: see NullDirection::Partner.
struct Combination {
  std::string name;
  std::vector<double> values, errors;  ///< with each component of the other parameter
  double mean = 0, mean_error = 0;     ///< of the values
};

struct ParameterErrors {
  std::string from;            ///< gauss_newton_matrix or gauss_newton_products; empty where nothing is known
  std::vector<double> values;  ///< of each unknown; infinite: undetermined. Empty where the scale is not known
  std::vector<std::string> undetermined;  ///< parameters, or components of them
  std::vector<Combination> combinations;  ///< their errors are empty or NaN where the scale is not known
  /// Names of unknowns of parameters of few components, and by how much a Newton step from where the run ended moves them, where
  /// that is more than their error.
  std::vector<std::pair<std::string, double>> steps_left;
};

/// What the inverse of the Gauss-Newton matrix H is multiplied with to get the covariance of the unknowns, the loss being a mean
/// over N readings. Counts: 1 / N, as N H is Fisher's information. Else 2 s^2 / N with s^2 the mean squared error that is left,
/// taken for independent errors of the readings; NaN where that is not above 0.
double variance_scale(const Problem& problem, const Evaluation& at);

/// Of a linear function of the unknowns.
struct Spread {
  double variance = 0;        ///< but for the scale; infinite where noise hides it
  std::vector<double> steps;  ///< by which a Newton step moves it, for each gradient
};
/// Mean, and variance of a single one, of Newton steps.
struct StepMoments {
  double mean = 0, variance = 0;
};
StepMoments moments(const std::vector<double>& steps);

/// What is known about the noise of readings and of the renderer.
struct NoiseLevel {
  double scale = 0;       ///< see variance_scale()
  bool rendered = false;  ///< whether the unknowns were fitted to one set of random numbers, whose noise counts, too
};
/// Of functions with so many weights of the unknowns each; those that are fixed have none.
using Spreads = std::function<std::vector<Spread>(const std::vector<std::vector<double>>& weights)>;

/// What is known about the unknowns before anything is inverted.
class Determined {
 public:
  /// `matrix`: the curvature of `changes`, see null_directions(). `unseen`: the unknowns that no reading depends on; `free`: what
  /// keeps those in place all the same is a penalty.
  Determined(const std::vector<Parameters::Block>& blocks, const std::vector<std::string>& names,
             const std::vector<double>& theta, const std::vector<double>& matrix,
             const std::vector<ParameterChange>& changes, std::vector<bool> unseen, const std::vector<bool>& free);

  /// Unknowns that stay as they are while all others are inverted: the pivots of null directions, and what nothing keeps in place.
  const std::vector<bool>& fixed() const { return fixed_; }

  /// Errors of the unknowns that are `asked` for, by their spreads, of others `least`. Where the scale is NaN, only
  /// what is undetermined is found.
  ParameterErrors errors(const NoiseLevel& noise, const std::vector<bool>& asked, const std::vector<double>& least,
                         const Spreads& spreads) const;

 private:
  const std::vector<Parameters::Block>& blocks_;
  const std::vector<std::string>& names_;
  const std::vector<double>& theta_;
  std::vector<bool> undetermined_, fixed_;
  std::vector<NullDirection> directions_;  ///< exact ones, then those that are nearly null
  std::size_t exact_ = 0;
};

}  // namespace isochron
