// The work-precision chart: what each way to the loss gradient costs on one experiment, at one point.
//
// Every method climbs a ladder of sample counts, each level twice the one below (the experiment's samples times a power of
// two), with as many independent repeats as the level's share of the time allows. Methods that come down to the same
// estimator, as `auto` may to another one, are measured once. All see one target image, and are compared with one reference:
// `auto` with other random numbers and far more samples. Costs are CPU seconds of the process, all threads; the renderings of
// the target and the trial by which `auto` chooses are not counted.
#pragma once
#include <string>
#include <vector>

#include "optim/analysis/gradient_error.h"
#include "optim/analysis/methods.h"

namespace isochron {

struct ChartOptions {
  double core_seconds = 120;  ///< for the whole chart, about, without the target; the reference takes a quarter
  double error = 0.01;        ///< relative, that the table asks for
  std::vector<double> steps;  ///< of finite differences
  bool techniques = false;    ///< in place of other methods, `auto` without each technique (methods_without)
  std::function<void(const std::string&)> progress;  ///< one line
};

/// A long estimate of the gradient.
struct Reference {
  Repeats repeats;
  double core_seconds = 0;  ///< all repeats together
  Measured norm2;           ///< squared norm of the gradient, unbiased
  double error = 0;         ///< standard error of the mean, relative to the gradient's norm
};

/// Whether the gradient is significantly above zero, and the reference precise enough to judge a bias of `error`:
/// half of it.
bool resolved(const Reference& reference);
bool fine_enough(const Reference& reference, double error);

/// `auto` with random numbers of its own and as many bounces as the target has, in 32 parts that take `core_seconds`
/// together (or one sample each).
Reference make_reference(const Experiment& experiment, const std::vector<double>& theta, const GatedImage& target,
                         double core_seconds);

struct ChartMethod {
  std::string name;
  int components = 0;  ///< unknowns that were measured
  std::vector<SampleLevel> levels;
  MethodError error;
  Measured to_error;  ///< core-seconds to ChartOptions::error, infinite: never
};

struct Chart {
  double error = 0;
  int unknowns = 0;
  Reference reference;
  std::vector<ChartMethod> methods;
  std::vector<std::string> notes;
};

/// Throws std::runtime_error where the reference is not resolved.
Chart make_chart(const Experiment& experiment, const std::vector<double>& theta, const GatedImage& target,
                 const ChartOptions& options);

/// `method,factor,repeats,core_seconds,error,variance,variance_error,bias2,bias2_error,components,unknowns`,
/// a row per level. core_seconds: of one repeat. All relative to the gradient's norm; error is the root of
/// variance + bias^2. The first row is the reference: the whole of it.
std::string chart_csv(const Chart& chart);
/// `method,core_seconds,standard_error,ratio,rate,slope,bias2,bias2_error,bias_significant`: what chart_table
/// prints; rate as in MethodError.
std::string chart_table_csv(const Chart& chart);
/// Core-seconds to the error, ratio to the best, and bias, for people.
std::string chart_table(const Chart& chart);

}  // namespace isochron
