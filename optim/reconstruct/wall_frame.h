// Coordinates of the space in front of a wall.
#pragma once
#include "core/image/capture_file.h"

namespace isochron {

/// Right-handed: `across` x `up` = `normal`. `across` is the axis of the capture's coordinates that is closest to lying in the
/// wall (of equals the first), projected on it; the origin is the middle of the sensor points. Lengths in metres.
struct WallFrame {
  Vec3 origin, across, up, normal;

  /// (across, up, distance from the wall) of a point in the capture's coordinates, and back.
  Vec3 to_wall(const Vec3& p) const {
    const Vec3 d = p - origin;
    return {dot(d, across), dot(d, up), dot(d, normal)};
  }
  Vec3 to_capture(const Vec3& q) const { return origin + across * q.x + up * q.y + normal * q.z; }
};

/// The normal is the mean of those of the sensor points. Throws InputError where these cancel.
WallFrame wall_frame(const CaptureGeometry& geometry);

}  // namespace isochron
