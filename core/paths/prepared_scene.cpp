#include "core/paths/prepared_scene.h"

#include <limits>
#include <utility>

#include "core/base/parallel.h"

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
    geometry |= triangle[t] != 0;
  }
  lengths |= geometry;
  any = !basis->entries.empty();
  find_bounds(scene);
}

void MovingParts::find_bounds(const Scene& scene) {
  bounds = {};
  for (std::size_t t = 0; t < triangle.size(); ++t)
    if (triangle[t])
      for (int v : scene.triangles[t].vertex) bounds.add(scene.positions[v]);
}

PreparedScene::PreparedScene(const Scene& source, const TangentBasis* basis, const FollowOptions& follow,
                             CasterUpdate of_caster)
    : scene(source),
      camera(source.camera),
      layout(source),
      flows(source),
      caster(source, of_caster),
      records_(source.triangles.size()),
      changed_(source.triangles.size(), -1) {
  for (std::size_t i = 0; i < records_.size(); ++i) {
    records_[i].shape = scene.triangles[i].shape;
    records_[i].vertex = scene.triangles[i].vertex;
  }
  update(source, basis, follow);
}

std::vector<char> PreparedScene::move_vertices(const std::vector<Vec3>& positions, std::vector<char>& moved_shapes) {
  std::vector<char> moved(positions.size());
  for (std::size_t s = 0; s < scene.shapes.size(); ++s) {
    const Shape& shape = scene.shapes[s];
    for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v)
      moved_shapes[s] |= moved[v] = !(positions[v] == scene.positions[v]);
  }
  scene.positions = positions;
  caster.update(scene, moved_shapes);
  return moved;
}

void PreparedScene::update(const Scene& source, const TangentBasis* basis, const FollowOptions& follow) {
  const bool first = revision_++ == 0;
  scene.materials = source.materials;
  scene.shapes = source.shapes;
  std::vector<char> moved_shapes(scene.shapes.size(), 0);
  const std::vector<char> moved = move_vertices(source.positions, moved_shapes);
  const bool same_pattern = !first && same_moves(basis);
  if (same_pattern) {
    moving.find_bounds(scene);
  } else {
    moving = MovingParts(scene, basis);
    pattern_ = basis ? basis->row_begin : std::vector<int>();
  }
  update_shapes();
  bool any_changed = false;
  for (std::size_t s = 0; s < scene.shapes.size(); ++s) {
    if (same_pattern && !moved_shapes[s]) continue;
    any_changed = true;
    const Shape& shape = scene.shapes[s];
    constexpr int kChunk = 4096;
    parallel((shape.triangle_count + kChunk - 1) / kChunk, [&](int chunk) {
      const int begin = chunk * kChunk, end = std::min(begin + kChunk, shape.triangle_count);
      for (int t = shape.first_triangle + begin; t < shape.first_triangle + end; ++t) {
        const auto& v = scene.triangles[t].vertex;
        if (same_pattern && !moved[v[0]] && !moved[v[1]] && !moved[v[2]]) continue;
        update_record(t);
        changed_[t] = revision_;
      }
    });
  }
  update_emitters();
  flows.update(*this, follow);
  moving_bounds = moving.bounds.grown(caster.offset());
  flowing_bounds = flows.near().grown(caster.offset());
  if (any_changed)
    for (auto& hierarchy : hierarchies_) hierarchy = std::make_unique<LazyHierarchy>();
}

bool PreparedScene::same_moves(const TangentBasis* basis) const {
  return basis ? basis->row_begin == pattern_ : pattern_.empty();
}

void PreparedScene::update_shapes() {
  shapes_.clear();
  has_medium_ = false;
  least_index_ = 1;
  for (const Shape& shape : scene.shapes) {
    const Material& material = scene.materials[shape.material];
    const Bsdf& bsdf = material.bsdf();
    const double index = bsdf.transparent() ? material.number(bsdf.index_number()) : 0;
    shapes_.push_back({&bsdf, shape.material, bsdf.two_sided(), index});
    if (index == 0 || shape.triangle_count == 0) continue;
    has_medium_ = true;
    least_index_ = std::min(least_index_, index);
  }
}

void PreparedScene::update_record(int t) {
  TriangleRecord& record = records_[t];
  const auto& v = record.vertex;
  const Vec3 &a = scene.positions[v[0]], &b = scene.positions[v[1]], &c = scene.positions[v[2]];
  record.origin = a;
  record.edge[0] = b - a;
  record.edge[1] = c - a;
  const Vec3 normal = cross(record.edge[0], record.edge[1]);
  const double doubled = length(normal);
  record.area = 0.5 * doubled;
  // A triangle that the parameters have flattened to nothing has a zero normal: no ray or ellipse meets it.
  record.normal = doubled > 0 ? normal / doubled : Vec3();
  record.moving_corners = 0;
  for (int k = 0; k < 3; ++k) record.moving_corners |= (moving.vertex[v[k]] != 0) << k;
  record.moves = record.moving_corners || moving.material[shapes_[record.shape].material];
}

void PreparedScene::update_emitters() {
  emitters.clear();
  emitter_bounds_.clear();
  camera_sees_emitters = false;
  std::vector<double> power;
  emitting_shapes_.resize(scene.shapes.size(), 0);
  for (std::size_t s = 0; s < scene.shapes.size(); ++s) {
    const Shape& shape = scene.shapes[s];
    const bool emits = !shape.emission.is_black();
    if (!std::exchange(emitting_shapes_[s], emits) && !emits) continue;
    for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
      TriangleRecord& record = records_[t];
      record.emits = emits && record.area > 0;
      if (!record.emits) continue;
      emitters.push_back(t);
      camera_sees_emitters |=
          height_over(t, camera.position) > 0 &&
          !camera.misses_image(record.origin, record.origin + record.edge[0], record.origin + record.edge[1]);
      power.push_back(record.area * shape.emission.max());
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
  LazyHierarchy& hierarchy = *hierarchies_[static_cast<int>(part)];
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
