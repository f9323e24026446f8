// Measurements of pulsed lasers and single-photon detectors, in the HDF5 layout of the `tal` library.
#pragma once
#include <string>
#include <vector>

#include "core/base/vec.h"
#include "core/image/image.h"
#include "core/image/stored_image.h"

namespace isochron {

/// Where light enters and leaves: points on walls and the walls' unit normals there. Lengths in metres.
struct CaptureGeometry {
  int columns = 0, rows = 0;                ///< of the sensor grid: tal's Sx and Sy
  std::vector<Vec3> sensor, sensor_normal;  ///< index row * columns + column
  bool confocal = true;                     ///< the laser points are the sensor points; `laser` is empty
  std::vector<Vec3> laser, laser_normal;    ///< else: spots, each of them seen from every sensor point
  /// Times include the ways from the laser's origin to the spot and from the sensor point to the sensor's origin.
  bool accounts_first_and_last = false;
  Vec3 laser_origin, sensor_origin;  ///< tal's laser_xyz and sensor_xyz
  /// A line for each thing that the file lacks, and what is taken in its place.
  std::vector<std::string> assumed;

  int spots() const { return confocal ? 1 : static_cast<int>(laser.size()); }
};

/// One measurement, or a rendering of one. `counts` has the sensor grid's columns, its rows times the number of spots
/// (spot after spot), one gate per time bin and one channel.
struct CaptureFile {
  CaptureGeometry geometry;
  GatedImage counts;
  double delta_t = 0;                ///< width of a bin: optical path, metres
  double t_start = 0;                ///< where the first bin begins: optical path, metres
  std::vector<std::string> assumed;  ///< as of the geometry
};

/// Reads all but the counts, which the file need not have. Where normals are missing or empty, the wall is the plane that
/// the points span, or for spots of the laser that span none the sensor's; its normal points to the side where laser and
/// sensor stand, if times include the ways from and to there, or else towards the positive end of the axis that it is closest
/// to. Throws InputError naming the file and the first thing amiss, as all that reads does here.
CaptureGeometry read_capture_geometry(const std::string& file);

/// H is [T, Sx, Sy] (confocal, or one spot) or [T, Lx, Ly, Sx, Sy], of any kind of number; in grids of points in no
/// order ([N, 3]) the pair Sx, Sy or Lx, Ly is one number. Without a laser grid, [T, Sx, Sy] is confocal. Spots are
/// numbered as sensor points are: ly * Lx + lx. A t_start that is missing or empty is 0. Values are what the file has:
/// below zero where a dark count was subtracted, not a number where a point is dead.
CaptureFile read_capture(const std::string& file);

/// Writes counts as 32-bit floats, by temporary name and rename; several spots as [T, spots, 1, Sx, Sy]. Throws
/// InputError where the file cannot be written, and std::invalid_argument where image and geometry do not fit together.
void write_capture(const std::string& file, const CaptureFile& capture);
/// The same with other counts than those of the capture.
void write_capture(const std::string& file, const CaptureFile& capture, const StoredImage& counts);

}  // namespace isochron
