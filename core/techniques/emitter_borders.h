// What flows that keep the length carry across the borders of emitters (theory section 7): from the last scattering vertex q the
// emitter's points at the distance that is left lie on a circle, whose arcs end where it meets a border. Two techniques find such
// paths, combined by multiple importance sampling: the border's points on the circle about a given q (here), and surface arcs
// for a given point of the border (EllipsoidalConnections::connect_border).
#pragma once
#include <optional>
#include <vector>

#include "core/techniques/worker.h"

namespace isochron {

class EmitterBorders {
 public:
  explicit EmitterBorders(Worker& worker) : worker_(worker), scene_(worker.scene) {}

  /// At the worker's path, which ends at q: hands paths of length tau that end on a border to the sink. `throughput` counts one
  /// over the density of tau.
  void sample(double tau, int pixel, const Rgb& throughput, Rng& rng);

  struct Point {
    SurfacePoint y;
    Vec3 tangent;    ///< unit, counter-clockwise about the triangle
    double pdf = 0;  ///< per length of the border
  };
  /// A point of the border; none where the emitter's triangle that was picked has none.
  std::optional<Point> pick(double u_emitter, double u_border) const;

  /// X . (outward normal of the border at y) of a path that ends q, y.
  double outwards(const SurfacePoint& q, const Point& border) const;

 private:
  struct Crossing {
    Point point;
    Rgb value;
    double weight, inverse_probability;
  };
  double border_length(int triangle) const;
  /// Adds where the border of an emitting triangle meets the sphere about q.
  void cross(int triangle, double radius, double inverse_probability, const Rgb& throughput);

  Worker& worker_;
  const PreparedScene& scene_;
  std::vector<Crossing> crossings_;
};

}  // namespace isochron
