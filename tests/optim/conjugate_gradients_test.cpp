#include "optim/problem/conjugate_gradients.h"

#include <gtest/gtest.h>

namespace isochron {
namespace {

/// A diagonal matrix, preconditioned by ones.
double solved(double small, double least_curvature) {
  const std::vector<double> diagonal = {4, 1, 0.5, small};
  const auto products = [&](const VectorList& vectors) {
    VectorList result = vectors;
    for (std::vector<double>& v : result)
      for (std::size_t i = 0; i < v.size(); ++i) v[i] *= diagonal[i];
    return result;
  };
  const auto same = [](const std::vector<double>& v) { return v; };
  const VectorList found =
      solve(products, {{1, 1, 1, 1}}, same, {.most_steps = 4, .least_gain = 0, .least_curvature = least_curvature});
  EXPECT_NEAR(found[0][0], 0.25, 0.1);  // all end together
  return found[0][3];
}

TEST(ConjugateGradients, SolveInAsManyStepsAsThereAreUnknowns) {
  EXPECT_NEAR(solved(0.2, 0), 5, 1e-9);
  EXPECT_NEAR(solved(1e-6, 0), 1e6, 1);
}

/// What noise makes of a direction that the readings say nothing about: a curvature close to zero, or below.
TEST(ConjugateGradients, DirectionsFarBelowTheExpectedCurvatureAreLeftOut) {
  for (const double small : {1e-6, 0.0, -1e-6}) {
    const double found = solved(small, 0.1);
    EXPECT_GT(found, 0.5) << small;
    EXPECT_LT(found, 5) << small;
  }
  EXPECT_NEAR(solved(0.2, 0.1), 5, 1e-9);
}

}  // namespace
}  // namespace isochron
