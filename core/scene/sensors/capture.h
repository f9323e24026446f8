// The sensor of a capture: a detector that looks at points of a wall, one after another, while a laser lights a spot of it. It
// records light that went from the spot l by way of hidden surfaces to the sensor point s.
//
// A path is x0 = s, x1, ..., xK = l; the wall's two reflections are no bounces, and its albedo counts as one:
//   I = integral of G(s,x1)/pi f(x1) G(x1,x2) ... f(x(K-1)) G(x(K-1),l)/pi W(length),     G = cos cos / r^2 with visibility.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "core/base/description.h"
#include "core/base/vec.h"

namespace isochron {

/// A point of the wall with its unit normal.
struct WallPoint {
  Vec3 p, n;
};

struct Capture {
  std::string file;               ///< that the geometry was read from; empty: from the scene file
  int columns = 0, rows = 0;      ///< of the grid of sensor points
  std::vector<WallPoint> sensor;  ///< row by row
  std::vector<WallPoint> spots;   ///< of the laser; none: confocal, each sensor point is lit while it is looked at
  /// Where laser and detector stand: with them, |laser - l| + |s - detector| counts in the length of paths.
  struct Origin {
    Vec3 laser, sensor;
  };
  std::optional<Origin> origin;
  std::vector<char> left_out;        ///< of each pixel, whether no sample starts there, and it is black; empty: none
  std::vector<std::string> assumed;  ///< lines of what the file of the geometry lacks and what is taken in its place

  bool leaves_out(int pixel) const { return !left_out.empty() && left_out[pixel]; }
  bool confocal() const { return spots.empty(); }
  /// Images have the grid's columns, and its rows once for each spot.
  int image_rows() const { return rows * (confocal() ? 1 : static_cast<int>(spots.size())); }

  /// Of a pixel of the image.
  const WallPoint& sensor_of(int pixel) const { return sensor[sensor_index(pixel)]; }
  const WallPoint& spot_of(int pixel) const { return confocal() ? sensor_of(pixel) : spots[spot_index(pixel)]; }
  int sensor_index(int pixel) const { return pixel % static_cast<int>(sensor.size()); }
  /// Which of the laser's spots; confocal: the sensor point's number.
  int spot_index(int pixel) const { return confocal() ? pixel : pixel / static_cast<int>(sensor.size()); }
  /// Constant length added to all its paths: from the laser to its spot l, and from the sensor point s to the detector.
  double extra_length(int pixel) const {
    return origin ? length(origin->laser - spot_of(pixel).p) + length(origin->sensor - sensor_of(pixel).p) : 0;
  }
};

/// Its keys. Points and normals are complete when they have been read.
void describe(Keys& keys, Capture& capture);

}  // namespace isochron
