// The histograms of a capture as back-projection reads them: of single points of the wall, or of neighbours together.
#pragma once
#include <cstdint>
#include <vector>

#include "optim/reconstruct/wall_frame.h"

namespace isochron {

/// Lengths in metres, places in the wall's frame.
struct Histograms {
  struct Row {
    Vec3 sensor;
    int spot = -1;     ///< into `spots`; -1: the sensor point itself
    double start = 0;  ///< optical path between wall and wall at the middle of the first bin
  };

  double bin = 0;  ///< width, optical path
  int bins = 0;
  std::vector<Vec3> spots;    ///< empty: confocal
  std::vector<Row> rows;      ///< by spot
  std::vector<float> counts;  ///< [row][bin]

  const float* of(std::size_t row) const { return &counts[row * bins]; }
  /// Half of the longer side of the rectangle that holds the sensor points.
  double half_side() const;
  /// Distance of neighbouring sensor points, were they evenly spread over their rectangle.
  double spacing() const;
};

/// Of the points that `used` names (one number per sensor point, zero: dead; empty: all), but for those with values that are not
/// finite. Throws InputError where there is none.
Histograms histograms(const CaptureFile& capture, const WallFrame& frame, const std::vector<std::uint8_t>& used = {});

/// Neighbours within squares of that side added up, at the mean of their places: of sensor points, and of spots. Their times are
/// shifted by whole bins where the ways from laser and to sensor differ.
Histograms grouped(const Histograms& histograms, double side);

}  // namespace isochron
