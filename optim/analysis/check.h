// Analytic derivatives against finite differences: does an experiment's derivative hold, term by term?
#pragma once
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "optim/problem/problem.h"

namespace isochron {

/// The two derivatives of one gate's mean image by one scalar unknown, per unit of the unknown.
struct Comparison {
  std::string parameter;
  int gate = 0;
  std::array<double, 3> terms{};  ///< in the order of kTerms; 0 where a term vanishes
  double total = 0, standard_error = 0;
  double finite_difference = 0, finite_difference_error = 0;
  double rounding = 0;  ///< what the rounding of images makes of the difference, part of its error
  double z = 0;         ///< see z_score
  /// Of z under Student's law (Welch and Satterthwaite's formula), and of either side the smaller count (see Statistics).
  double degrees = std::numeric_limits<double>::infinity();
  double effective_count = std::numeric_limits<double>::infinity();
};

/// (a - b) / hypot(error_a, error_b); 0 where both are equal, infinite where they differ without error.
double z_score(double a, double error_a, double b, double error_b);

/// The |z| that one or more of `comparisons` true derivatives exceed with probability `rate` at most (Bonferroni), for errors of
/// so many degrees of freedom (see student_quantile).
double false_alarm_limit(int comparisons, double degrees, double rate = 0.01);

/// Whether one of so many comparisons disagrees: |z| above the limit for its degrees of freedom, or no number.
bool disagrees(const Comparison& row, int comparisons);

/// What one of so many comparisons says.
enum class Finding {
  agrees,
  differs,
  /// The two disagree, but none of the difference's samples changed by more than rounding. With common random numbers that
  /// happens if all samples missed what changes; their standard error is then zero, however much they missed.
  difference_saw_nothing,
  nothing,  ///< both are zero
};
Finding finding(const Comparison& row, int comparisons);

/// Value at step 0 of central differences at the steps h, h/2 and h/4: Richardson's extrapolation, exact for
/// polynomials of degree 6.
double extrapolate(double whole, double half, double quarter);

/// The experiment with the analytic method and one number of samples for the image and every term that can be
/// non-zero: the largest that it gives. Each term that it left out but that is needed adds a line to `notes`.
/// Throws InputError when that number is below 2.
Experiment check_experiment(Experiment experiment, std::vector<std::string>& notes);

/// Largest step of the finite differences by one unknown, in its unit: gradient.step where the experiment
/// gives one. Else, for motions, what moves no vertex further than 1 % of the scene's extent or half the
/// gates' standard deviation, and 1 degree for rotations at most; for materials 5 % of the value. Cut to the
/// bounds of material values. Throws InputError where theta lies on such a bound.
double check_step(const Problem& problem, const std::vector<double>& theta, int component);

/// Compares the derivatives by one unknown at theta, one row per gate. The problem is one of
/// check_experiment's. Finite differences have their own random numbers, common to all six images.
std::vector<Comparison> check_derivative(const Problem& problem, const std::vector<double>& theta, int component);

/// `parameter,gate,interior,visibility,path_length,total,standard_error,finite_difference,finite_difference_error,z,limit,
/// degrees_of_freedom,effective_count` and the gate's columns (gate_columns.h); `limit`: the |z| above which a row differs.
std::string check_csv(const Problem& problem, const std::vector<Comparison>& table);

}  // namespace isochron
