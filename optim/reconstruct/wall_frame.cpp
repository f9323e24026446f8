#include "optim/reconstruct/wall_frame.h"

#include <cmath>

#include "core/base/error.h"

namespace isochron {

WallFrame wall_frame(const CaptureGeometry& geometry) {
  WallFrame frame;
  Vec3 normal;
  for (std::size_t i = 0; i < geometry.sensor.size(); ++i) {
    frame.origin += geometry.sensor[i] / static_cast<double>(geometry.sensor.size());
    normal += geometry.sensor_normal[i];
  }
  if (!(length(normal) > 0.5 * static_cast<double>(geometry.sensor.size())))
    throw InputError("the normals at the sensor points differ by too much to be of one wall");
  frame.normal = normalize(normal);
  int axis = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::abs(frame.normal[i]) < std::abs(frame.normal[axis])) axis = i;
  }
  Vec3 along;
  along[axis] = 1;
  frame.across = normalize(along - frame.normal * frame.normal[axis]);
  frame.up = cross(frame.normal, frame.across);
  return frame;
}

}  // namespace isochron
