// Quadrature over a gate's support, split where its pieces meet, and the gates the tests run through.
#pragma once
#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/base/constants.h"
#include "core/gates/gate.h"

namespace isochron {

inline const std::vector<double> kMeasuredOffsets{-1, -0.4, -0.4, -0.1, 0.2, 0.2, 0.5, 0.9, 0.9, 1.6, 2.5};
inline const std::vector<double> kMeasuredValues{0.2, 0.5, 1.5, 4, 3, 2.2, 2.2, 1, 1.4, 0.3, 0};
/// A detector's: light is counted later, mostly by 0.2, now and then by much more.
inline const std::vector<double> kResponseOffsets{0, 0.2, 0.4, 0.6, 0.8, 1, 1.2, 1.4, 1.6};
inline const std::vector<double> kResponseValues{0, 5, 3, 2, 1.2, 0.7, 0.4, 0.2, 0};

/// Every kind but steady, at several proportions.
inline std::vector<std::pair<std::string, GateShape>> finite_gates() {
  return {{"gaussian", GateShape::gaussian(0.3)},
          {"boxcar", GateShape::boxcar(0.8)},
          {"truncated at sigma / 1000", GateShape::truncated_gaussian(0.3, 0.0003)},
          {"truncated at sigma", GateShape::truncated_gaussian(0.3, 0.3)},
          {"truncated at 4 sigma", GateShape::truncated_gaussian(0.3, 1.2)},
          {"truncated beyond rounding", GateShape::truncated_gaussian(0.3, 30)},
          {"triangle", GateShape::tabulated({-0.5, 0, 0.5}, {0, 1, 0})},
          {"box as a table", GateShape::tabulated({-0.5, 0.1, 0.5}, {3, 3, 3})},
          {"falling saw", GateShape::tabulated({0, 0, 1}, {0, 1, 0})},
          {"measured", GateShape::tabulated(kMeasuredOffsets, kMeasuredValues)},
          {"bin", GateShape::bin(0.4, kResponseOffsets, kResponseValues)},
          {"bin wider than its response", GateShape::bin(2.5, kResponseOffsets, kResponseValues)},
          {"bin, response with jumps", GateShape::bin(0.5, kMeasuredOffsets, kMeasuredValues)}};
}

/// Integral of f over the gate's support up to `to`: Gauss-Legendre of 5 points on 400 panels that end at the
/// tables' knots.
template <class F>
double integrate(const GateShape& gate, F&& f, double to = std::numeric_limits<double>::infinity()) {
  constexpr double kNode[5] = {-0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831, 0.9061798459386640};
  constexpr double kWeight[5] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                                 0.2369268850561891};
  const double last = std::min(gate.upper(), to);
  std::vector<double> ends{gate.lower(), last};
  if (gate.kind() == GateKind::tabulated) {
    for (const double x : {-1.0, -0.5, -0.4, -0.1, 0.0, 0.1, 0.2, 0.5, 0.9, 1.6}) {
      if (x > gate.lower() && x < last) ends.push_back(x);
    }
  }
  if (gate.kind() == GateKind::bin) {
    for (const LinearDensity::Knot& knot : gate.response().knots())
      for (const double x : {gate.begin() - knot.offset, gate.end() - knot.offset})
        if (x > gate.lower() && x < last) ends.push_back(x);
  }
  std::sort(ends.begin(), ends.end());
  constexpr int kPanels = 400;
  double sum = 0;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const double h = (ends[i + 1] - ends[i]) / kPanels;
    for (int p = 0; p < kPanels; ++p) {
      for (int k = 0; k < 5; ++k) sum += 0.5 * h * kWeight[k] * f(ends[i] + h * (p + 0.5 + 0.5 * kNode[k]));
    }
  }
  return sum;
}

}  // namespace isochron
