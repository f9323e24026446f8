#include "core/paths/hidden_geometry.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "core/base/bounds.h"
#include "core/base/random.h"
#include "core/paths/path.h"
#include "core/paths/prepared_scene.h"

namespace isochron {
namespace {

/// EstimatorOptions::hidden of captures with other shapes: of images, of derivatives (isochron_hidden_share: the least loss against
/// the best share of each scene and number of bounces).
constexpr double kShareOfImages = 0.5, kShareOfDerivatives = 0.75;

/// Puts two zero bits after each of the lowest 21.
std::uint64_t spread(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

/// The numbers of points in an order in which neighbours are close (Morton order), so that evenly spread random numbers pick
/// evenly spread points.
std::vector<int> spatial_order(const std::vector<Vec3>& points) {
  Bounds box;
  for (const Vec3& p : points) box.add(p);
  const Vec3 size = box.high - box.low;
  const double largest = std::max({size.x, size.y, size.z});
  std::vector<std::uint64_t> code(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const double fraction = largest > 0 ? (points[i][axis] - box.low[axis]) / largest : 0;
      code[i] |= spread(static_cast<std::uint64_t>(fraction * 0x1fffff)) << axis;
    }
  std::vector<int> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return code[a] < code[b]; });
  return order;
}

/// Triangles of the shapes that are named, or of a capture without any names all.
std::vector<int> candidates_of(const PreparedScene& scene) {
  const std::vector<Shape>& shapes = scene.scene.shapes;
  const bool any = std::any_of(shapes.begin(), shapes.end(), [](const Shape& s) { return s.hidden; });
  std::vector<int> triangles;
  std::vector<Vec3> centers;
  for (int t = 0; t < std::ssize(scene.scene.triangles); ++t) {
    if (any ? !scene.shape_of(t).hidden : !scene.captures()) continue;
    triangles.push_back(t);
    centers.push_back(scene.corners(t)[0] + (scene.edges(t)[0] + scene.edges(t)[1]) / 3);
  }
  std::vector<int> ordered;
  for (const int i : spatial_order(centers)) ordered.push_back(triangles[i]);
  return ordered;
}

/// Of a box about the sensor points of a capture: a face that has all these corners behind it is invisible to every sensor point.
std::vector<Vec3> sensor_box(const PreparedScene& scene) {
  std::vector<Vec3> corners;
  if (!scene.captures()) return corners;
  Bounds box;
  for (const WallPoint& s : scene.scene.capture->sensor) box.add(s.p);
  for (int i = 0; i < 8; ++i)
    corners.push_back({i & 1 ? box.high.x : box.low.x, i & 2 ? box.high.y : box.low.y, i & 4 ? box.high.z : box.low.z});
  return corners;
}

}  // namespace

void HiddenGeometry::update(const PreparedScene& scene) {
  const int count = static_cast<int>(scene.scene.triangles.size());
  of_captures_ = scene.captures();
  if (!is_chosen_) candidates_ = candidates_of(scene);
  const std::vector<Vec3> box = sensor_box(scene);
  const auto seen = [&](int t) {
    if (!of_captures_ || scene.two_sided(t) || scene.transparent(t)) return true;
    return std::any_of(box.begin(), box.end(), [&](const Vec3& p) { return scene.height_over(t, p) > 0; });
  };
  triangles_.clear();
  on_it_.assign(candidates_.empty() ? 0 : count, 0);
  std::vector<double> areas;
  for (const int t : candidates_) {
    if (!(scene.area(t) > 0) || !seen(t)) continue;
    on_it_[t] = 1;
    triangles_.push_back(t);
    areas.push_back(scene.area(t));
  }
  distribution_ = DiscreteDistribution(areas);
  is_all_ = std::ssize(candidates_) == count;
  if (!is_chosen_) is_best_alone_ = is_all_ && of_captures_ && beats_cosine_sampling(scene);
  is_chosen_ = true;
  const auto changes = [](const std::vector<std::uint8_t>& which) {
    return std::ranges::count(which, 0) < std::ssize(which);
  };
  const Differentiable& differentiable = scene.differentiable;
  alone_changes_ = alone_changes_x1_ =
      !empty() && !differentiable.every_path && !changes(differentiable.light) && !changes(differentiable.emission);
  for (int t = 0; alone_changes_x1_ && t < count; ++t) {
    // An emitter that moves is at the end of paths, too, which next-event estimation finds.
    if (!scene.has_gradient(t) || (holds(t) && !scene.emits(t)) || scene.area(t) == 0) continue;
    alone_changes_ = false;
    alone_changes_x1_ = of_captures_ && !scene.emits(t) && !seen(t);
  }
}

bool HiddenGeometry::beats_cosine_sampling(const PreparedScene& scene) const {
  constexpr int kPoints = 1024;
  constexpr Stream kTrialStream{0x68696464656eu, 0, 0};  // what it decides about has other numbers
  double sum = 0, squares = 0;
  for (int i = 0; i < kPoints && !empty(); ++i) {
    Rng rng(kTrialStream, static_cast<std::uint64_t>(i), 0);
    const int pixel = std::min(static_cast<int>(rng.uniform() * scene.pixels()), scene.pixels() - 1);
    double u0 = rng.uniform();
    const double u1 = rng.uniform();
    const int triangle = pick(u0);
    const SurfacePoint s = scene.sensor_point(pixel), x = scene.uniform_point(triangle, u0, u1);
    const Vec3 d = x.p - s.p;
    const double r = length(d);
    if (!(r > 0) || (!(dot(x.n, d) < 0) && !scene.two_sided(x.triangle) && !scene.transparent(x.triangle))) continue;
    const double weight = scene.importance(pixel, d / r) * solid_angle_to_area(s.p, x) / pdf();
    sum += weight;
    squares += weight * weight;
  }
  return squares <= sum;
}

AreaSteps HiddenGeometry::steps(const EstimatorOptions& options, bool derivatives) const {
  AreaSteps steps;
  if (empty()) return steps;
  const double usual = derivatives ? kShareOfDerivatives : kShareOfImages;
  steps.first = options.hidden.value_or(is_best_alone_ ? 1 : usual);
  steps.standard_first = derivatives && options.max_bounces == 1 && alone_changes_x1_ ? 1 : steps.first;
  if (derivatives && !is_all_) steps.later = options.hidden.value_or(of_captures_ ? kShareOfDerivatives : 0);
  return steps;
}

}  // namespace isochron
