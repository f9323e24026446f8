#include "core/render/prepared_scene.h"

#include <limits>

namespace isochron {

DiscreteDistribution::DiscreteDistribution(const std::vector<double>& weights) {
  cumulative_.reserve(weights.size());
  double sum = 0;
  for (double w : weights) cumulative_.push_back(sum += w);
}

int DiscreteDistribution::sample(double& u) const {
  const double target = u * total();
  auto it = std::upper_bound(cumulative_.begin(), cumulative_.end(), target);
  // Rounding can carry the target to the very end, where trailing entries may have no weight.
  if (it == cumulative_.end()) it = std::lower_bound(cumulative_.begin(), cumulative_.end(), total());
  const int i = static_cast<int>(it - cumulative_.begin());
  const double below = i ? cumulative_[i - 1] : 0;
  u = std::clamp((target - below) / (cumulative_[i] - below), 0x1p-53, 1 - 0x1p-53);
  return i;
}

MovingParts::MovingParts(const Scene& scene, const TangentBasis* basis)
    : vertex(scene.positions.size(), 0),
      triangle(scene.triangles.size(), 0),
      albedo(scene.materials.size(), 0),
      roughness(scene.materials.size(), 0),
      ior(scene.materials.size(), 0),
      emission(scene.shapes.size(), 0),
      scatters(scene.triangles.size(), 0) {
  if (!basis || basis->columns == 0) return;
  const DofLayout layout(scene);
  for (int v = 0; v < layout.vertices; ++v)
    for (int axis = 0; axis < 3; ++axis) vertex[v] |= basis->moves(layout.vertex(v, axis));
  for (int m = 0; m < layout.materials; ++m) {
    for (int c = 0; c < 3; ++c) albedo[m] |= basis->moves(layout.albedo(m, c));
    roughness[m] = basis->moves(layout.roughness(m));
    ior[m] = basis->moves(layout.ior(m)) && scene.materials[m].type == MaterialType::rough_dielectric;
    lengths |= ior[m] != 0;
  }
  for (int s = 0; s < layout.shapes; ++s)
    for (int c = 0; c < 3; ++c) emission[s] |= basis->moves(layout.emission(s, c));
  for (std::size_t t = 0; t < triangle.size(); ++t) {
    for (int v : scene.triangles[t].vertex) triangle[t] |= vertex[v];
    const int m = scene.shapes[scene.triangles[t].shape].material;
    scatters[t] = albedo[m] || roughness[m] || ior[m];
    geometry |= triangle[t] != 0;
  }
  lengths |= geometry;
  any = !basis->entries.empty();
}

PreparedScene::PreparedScene(const Scene& source, const TangentBasis* basis, double follow_radius)
    : scene(source),
      camera(source.camera),
      layout(source),
      moving(source, basis),
      camera_flow(source, camera, moving, follow_radius),
      caster(source) {
  const std::size_t count = scene.triangles.size();
  normal.resize(count);
  area.resize(count);
  records_.resize(count);
  emitter_pdf_.assign(count, 0);
  std::vector<EllipsoidBvh::Input> all, moved, emitting;
  all.reserve(count);
  std::vector<double> power;
  for (std::size_t i = 0; i < count; ++i) {
    const int t = static_cast<int>(i);
    const Vec3 e1 = corner(t, 1) - corner(t, 0), e2 = corner(t, 2) - corner(t, 0), m = cross(e1, e2);
    const double doubled = length(m);
    area[t] = 0.5 * doubled;
    TriangleRecord& record = records_[t];
    record.origin = corner(t, 0);
    record.shape = scene.triangles[t].shape;
    record.material = &scene.materials[scene.shapes[record.shape].material];
    if (is_dielectric(t)) {
      has_dielectric_ = true;
      least_index_ = std::min(least_index_, record.material->ior);
    }
    record.moves = moving.triangle[t] || moving.scatters[t];
    // A triangle that the parameters have flattened to nothing keeps a zero normal: no ray or ellipse meets it.
    if (doubled > 0) {
      normal[t] = record.normal = m / doubled;
      record.to_b1 = cross(e2, record.normal) / doubled;
      record.to_b2 = cross(record.normal, e1) / doubled;
    }
    const EllipsoidBvh::Input input{{corner(t, 0), corner(t, 1), corner(t, 2)}, t};
    all.push_back(input);
    if (record.moves) moved.push_back(input);
    if (!shape_of(t).emission.is_black() && area[t] > 0) {
      record.emits = true;
      emitters.push_back(t);
      emitting.push_back(input);
      power.push_back(area[t] * shape_of(t).emission.max());
    }
  }
  all_triangles = EllipsoidBvh(all);
  moving_triangles = EllipsoidBvh(moved);
  emitter_triangles = EllipsoidBvh(emitting);

  emitter_distribution_ = DiscreteDistribution(power);
  for (std::size_t i = 0; i < emitters.size(); ++i)
    emitter_pdf_[emitters[i]] = emitter_distribution_.probability(static_cast<int>(i)) / area[emitters[i]];
  for (const Shape& shape : scene.shapes) {
    if (shape.emission.is_black()) continue;
    Bounds bounds;
    for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v) bounds.add(scene.positions[v]);
    emitter_bounds_.push_back(bounds);
  }
}

SurfacePoint PreparedScene::sample_emitter(double u0, double u1, double u2, double& pdf) const {
  const int t = emitters[emitter_distribution_.sample(u0)];
  const double root = std::sqrt(u1);
  SurfacePoint y;
  y.triangle = t;
  y.b[0] = 1 - root;
  y.b[1] = root * (1 - u2);
  y.b[2] = root * u2;
  y.p = corner(t, 0) * y.b[0] + corner(t, 1) * y.b[1] + corner(t, 2) * y.b[2];
  y.n = normal[t];
  pdf = emitter_pdf_[t];
  return y;
}

double PreparedScene::distance_to_emitters(const Vec3& p) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Bounds& bounds : emitter_bounds_) nearest = std::min(nearest, bounds.distance_squared(p));
  return std::sqrt(nearest) * least_index_;
}

}  // namespace isochron
