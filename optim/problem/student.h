// Student's law, for intervals and tests of means whose errors are estimates, too.
#pragma once

namespace isochron {

/// The t that |t| exceeds with probability `tail` under Student's law with so many degrees of freedom (rounded down; infinite or
/// not, 1000 at most): the two-sided quantile. The distribution function is the finite series of Abramowitz and Stegun 26.7.3 and
/// 26.7.4.
double student_quantile(double tail, double degrees);

/// Of a tail of 0.05; a table of those asked for before, as long tables of estimates ask for few.
double student_quantile_95(double degrees);

}  // namespace isochron
