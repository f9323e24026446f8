#include "core/paths/prepared_scene.h"

#include <limits>

namespace isochron {

MovingParts::MovingParts(const Scene& scene, const TangentBasis* basis)
    : vertex(scene.positions.size(), 0),
      triangle(scene.triangles.size(), 0),
      material(scene.materials.size(), 0),
      emission(scene.shapes.size(), 0) {
  const DofLayout layout(scene);
  const int first_number = layout.first_number[0];
  number.assign(layout.first_number.back() - first_number, 0);
  if (!basis || basis->columns == 0) return;
  for (int v = 0; v < layout.vertices; ++v)
    for (int axis = 0; axis < 3; ++axis) vertex[v] |= basis->moves(layout.vertex(v, axis));
  for (int m = 0; m < layout.materials(); ++m) {
    for (int k = 0; k < layout.numbers(m); ++k) {
      const int dof = layout.number(m, k);
      material[m] |= number[dof - first_number] = basis->moves(dof);
    }
    const int index = scene.materials[m].bsdf().index_number();
    lengths |= index >= 0 && basis->moves(layout.number(m, index));
  }
  for (int s = 0; s < layout.shapes; ++s)
    for (int c = 0; c < 3; ++c) emission[s] |= basis->moves(layout.emission(s, c));
  for (std::size_t t = 0; t < triangle.size(); ++t) {
    for (int v : scene.triangles[t].vertex) triangle[t] |= vertex[v];
    if (!triangle[t]) continue;
    geometry = true;
    for (int v : scene.triangles[t].vertex) bounds.add(scene.positions[v]);
  }
  lengths |= geometry;
  any = !basis->entries.empty();
}

PreparedScene::PreparedScene(const Scene& source, const TangentBasis* basis, const FollowOptions& follow)
    : scene(source),
      camera(source.camera),
      layout(source),
      moving(source, basis),
      flows(source, camera, moving, follow),
      caster(source),
      moving_bounds(moving.bounds.grown(caster.offset())),
      flowing_bounds(flows.near().grown(caster.offset())) {
  for (const Shape& shape : scene.shapes) {
    const Material& material = scene.materials[shape.material];
    const Bsdf& bsdf = material.bsdf();
    shapes_.push_back(
        {&bsdf, shape.material, bsdf.two_sided(), bsdf.transparent() ? material.number(bsdf.index_number()) : 0});
  }
  const std::size_t count = scene.triangles.size();
  records_.resize(count);
  std::vector<double> power;
  for (std::size_t i = 0; i < count; ++i) {
    const int t = static_cast<int>(i);
    const auto& v = scene.triangles[t].vertex;
    const Vec3 &a = scene.positions[v[0]], &b = scene.positions[v[1]], &c = scene.positions[v[2]];
    TriangleRecord& record = records_[t];
    record.origin = a;
    record.edge[0] = b - a;
    record.edge[1] = c - a;
    const Vec3 normal = cross(record.edge[0], record.edge[1]);
    const double doubled = length(normal);
    record.area = 0.5 * doubled;
    record.shape = scene.triangles[t].shape;
    record.vertex = v;
    if (transparent(t)) {
      has_medium_ = true;
      least_index_ = std::min(least_index_, shapes_[record.shape].index);
    }
    for (int k = 0; k < 3; ++k) record.moving_corners |= (moving.vertex[v[k]] != 0) << k;
    record.moves = record.moving_corners || moving.material[shapes_[record.shape].material];
    // A triangle that the parameters have flattened to nothing keeps a zero normal: no ray or ellipse meets it.
    if (doubled > 0) record.normal = normal / doubled;
    if (!shape_of(t).emission.is_black() && record.area > 0) {
      record.emits = true;
      emitters.push_back(t);
      camera_sees_emitters |= height_over(t, camera.position) > 0 && !camera.misses_image(a, b, c);
      power.push_back(record.area * shape_of(t).emission.max());
    }
  }
  emitter_distribution_ = DiscreteDistribution(power);
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    const Shape& shape = scene.shapes[i];
    if (shape.emission.is_black()) continue;
    if (!emitters.empty()) shapes_[i].emitter_pdf = shape.emission.max() / emitter_distribution_.total();
    Bounds bounds;
    for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v) bounds.add(scene.positions[v]);
    emitter_bounds_.push_back(bounds);
  }
}

const EllipsoidBvh& PreparedScene::hierarchy(Part part) const {
  LazyHierarchy& hierarchy = hierarchies_[static_cast<int>(part)];
  std::call_once(hierarchy.made, [&] {
    std::vector<EllipsoidBvh::Input> input;
    for (std::size_t i = 0; i < scene.triangles.size(); ++i) {
      const TriangleRecord& record = records_[i];
      if ((part == Part::moving && !record.moves) || (part == Part::emitting && !record.emits)) continue;
      const auto& v = record.vertex;
      input.push_back({{scene.positions[v[0]], scene.positions[v[1]], scene.positions[v[2]]}, static_cast<int>(i)});
    }
    hierarchy.bvh = EllipsoidBvh(input);
  });
  return hierarchy.bvh;
}

double PreparedScene::distance_to_emitters(const Vec3& p) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Bounds& bounds : emitter_bounds_) nearest = std::min(nearest, bounds.distance_squared(p));
  return std::sqrt(nearest) * least_index_;
}

}  // namespace isochron
