#include "core/paths/prepared_scene.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "core/base/parallel.h"

namespace isochron {

PreparedScene::PreparedScene(const Scene& source, const TangentBasis* basis, const FollowOptions& follow,
                             CasterUpdate of_caster)
    : scene(source),
      camera(source.camera),
      layout(source),
      flows(source),
      caster(source, of_caster),
      records_(source.triangles.size()),
      changed_(source.triangles.size(), -1),
      shape_changed_(source.shapes.size(), -1) {
  // They are looked at shape by shape.
  std::size_t edges = 0;
  for (const Shape& shape : source.shapes) edges += static_cast<std::size_t>(shape.edge_count);
  if (edges != source.edges.size()) throw std::logic_error("a scene has edges of no shape");
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
    const auto begin = positions.begin() + shape.first_vertex, end = begin + shape.vertex_count;
    const auto old = scene.positions.begin() + shape.first_vertex;
    if (std::equal(begin, end, old)) continue;
    moved_shapes[s] = 1;
    std::transform(begin, end, old, moved.begin() + shape.first_vertex,
                   [](const Vec3& a, const Vec3& b) { return !(a == b); });
    std::copy(begin, end, old);
  }
  caster.update(scene, moved_shapes);
  return moved;
}

void PreparedScene::update(const Scene& source, const TangentBasis* basis, const FollowOptions& follow) {
  const bool first = revision_++ == 0;
  scene.materials = source.materials;
  scene.shapes = source.shapes;
  scene.detector = source.detector;
  scene.lights = source.lights;
  scene.texture = source.texture;
  if (scene.capture) scene.capture->left_out = source.capture->left_out;
  std::vector<char> moved_shapes(scene.shapes.size(), 0);
  const std::vector<char> moved = move_vertices(source.positions, moved_shapes);
  stacked.update(scene, first ? std::vector<char>(moved_shapes.size(), 1) : moved_shapes, caster.offset());
  const bool same_pattern = !first && same_columns(basis);
  if (same_pattern) {
    differentiable.find_bounds(scene);
  } else {
    differentiable = Differentiable(scene, basis);
    pattern_ = basis ? basis->row_begin : std::vector<int>();
  }
  update_shapes();
  bool any_changed = false;
  for (std::size_t s = 0; s < scene.shapes.size(); ++s) {
    if (same_pattern && !moved_shapes[s]) continue;
    any_changed = true;
    shape_changed_[s] = revision_;
    const Shape& shape = scene.shapes[s];
    parallel_ranges(shape.triangle_count, 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const int t = shape.first_triangle + static_cast<int>(i);
        const auto& v = scene.triangles[t].vertex;
        if (same_pattern && !moved[v[0]] && !moved[v[1]] && !moved[v[2]]) continue;
        update_record(t);
        changed_[t] = revision_;
      }
    });
  }
  const std::vector<int> emitted = emitters.triangles();
  update_emitters();
  hidden.update(*this);
  any_changed |= emitters.triangles() != emitted;
  flows.update(*this, follow);
  moving_bounds = differentiable.bounds.grown(caster.offset());
  flowing_bounds = flows.near().grown(caster.offset());
  if (any_changed || first)
    for (auto& hierarchy : hierarchies_) hierarchy = std::make_unique<LazyHierarchy>();
}

bool PreparedScene::same_columns(const TangentBasis* basis) const {
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
    shapes_.push_back({&bsdf, shape.material, bsdf.two_sided(), index, shape.emission, shape.textured});
    if (index == 0 || shape.triangle_count == 0) continue;
    has_medium_ = true;
    least_index_ = std::min(least_index_, index);
  }
}

int PreparedScene::top_face(int triangle, const Vec3& p, const Vec3& w) const {
  const auto rank = [&](int t) {
    if (dot(normal(t), w) < 0) return emits(t) ? 3 : 2;
    return two_sided(t) || transparent(t) ? 1 : 0;
  };
  const auto holds_p = [&](int t) {
    if (!(std::abs(height_over(t, p)) <= caster.offset())) return false;
    return std::ranges::min(barycentrics({p, normal(t), t})) >= 0;
  };
  int top = triangle, best = rank(triangle);
  for (const auto& [_, t] : stacked.of(triangle)) {
    const int own = rank(t);
    if (std::tie(own, t) <= std::tie(best, top) || !holds_p(t)) continue;
    top = t;
    best = own;
  }
  return top;
}

void PreparedScene::update_record(int t) {
  TriangleRecord& record = records_[t];
  const auto& v = record.vertex;
  const Vec3 &a = scene.positions[v[0]], &b = scene.positions[v[1]], &c = scene.positions[v[2]];
  const Vec3 edge[] = {b - a, c - a}, normal = cross(edge[0], edge[1]);
  record.origin = a;
  record.edge[0] = edge[0];
  record.edge[1] = edge[1];
  const double doubled = length(normal);
  record.area = 0.5 * doubled;
  // A triangle that the parameters have flattened to nothing has a zero normal: no ray or ellipse meets it.
  record.normal = doubled > 0 ? normal / doubled : Vec3();
  record.moving_corners = 0;
  for (int k = 0; k < 3; ++k) record.moving_corners |= (differentiable.vertex[v[k]] != 0) << k;
  record.has_gradient =
      differentiable.every_path || record.moving_corners || differentiable.material[shapes_[record.shape].material];
  if (shapes_[record.shape].textured)
    for (const int vertex : v) record.has_gradient |= differentiable.texture[vertex] != 0;
}

Vec3 PreparedScene::texture_gradient(const SurfacePoint& x) const {
  const TriangleRecord& r = records_[x.triangle];
  const double b = scene.texture[r.vertex[1]] - scene.texture[r.vertex[0]],
               c = scene.texture[r.vertex[2]] - scene.texture[r.vertex[0]];
  return (cross(r.edge[1], r.normal) * b + cross(r.normal, r.edge[0]) * c) / (2 * r.area);
}

void PreparedScene::update_lights() {
  if (!captures()) {
    lights = scene.lights;
    return;
  }
  if (!lights.empty()) return;  // a capture stays where it is
  const Capture& capture = *scene.capture;
  for (const WallPoint& spot : capture.confocal() ? capture.sensor : capture.spots) {
    PointLight light;
    light.kind = PointLight::Kind::wall;
    light.position = spot.p;
    light.direction = spot.n;
    lights.push_back(light);
  }
}

void PreparedScene::update_emitters() {
  std::vector<int> triangles;
  std::vector<double> power;
  std::vector<Bounds> boxes;
  bool seen = false;
  emitting_shapes_.resize(scene.shapes.size(), 0);
  for (std::size_t s = 0; s < scene.shapes.size(); ++s) {
    const Shape& shape = scene.shapes[s];
    const bool emits = shape.emission.emits();
    if (!std::exchange(emitting_shapes_[s], emits) && !emits) continue;
    Bounds box;
    for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
      TriangleRecord& record = records_[t];
      record.emits = emits && record.area > 0;
      if (!record.emits) continue;
      const auto corner = corners(t);
      for (const Vec3& p : corner) box.add(p);
      seen |= height_over(t, camera.position) > 0 && !camera.misses_image(corner[0], corner[1], corner[2]);
      triangles.push_back(t);
      power.push_back(record.area * shape.emission.power());
    }
    if (!emits) continue;
    boxes.push_back(box);
    update_emitter_borders(shape);
  }
  const bool have_extent = !triangles.empty();
  update_lights();
  Bounds spots;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    Bounds box;
    box.add(lights[i].position);
    spots.add(box);
    triangles.push_back(index_of_light(static_cast<int>(i)));
    power.push_back(lights[i].power());
    if (!captures()) boxes.push_back(box);
  }
  if (captures()) boxes.push_back(spots);
  emitters = Emitters(std::move(triangles), power, std::move(boxes));
  emitters.have_extent = have_extent;
  emitters.seen_by_camera = seen;
  for (ShapeRecord& shape : shapes_)
    if (shape.emission.emits() && emitters.have_extent) shape.emitter_pdf = shape.emission.power() / emitters.power();
}

void PreparedScene::update_emitter_borders(const Shape& shape) {
  for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t)
    records_[t].emitter_borders = 0;
  for (int e = shape.first_edge; e < shape.first_edge + shape.edge_count; ++e) {
    const Edge& edge = scene.edges[e];
    const auto [t0, t1] = edge.face;
    const bool goes_on = t1 >= 0 && !edge.sector && emits(t0) && emits(t1) && face_alike(normal(t0), normal(t1));
    if (goes_on) continue;
    for (const int t : edge.face)
      for (int i = 0; t >= 0 && i < 3; ++i) {
        const auto& v = records_[t].vertex;
        if (const int from = v[i], to = v[(i + 1) % 3];
            std::minmax(from, to) == std::minmax(edge.vertex[0], edge.vertex[1]))
          records_[t].emitter_borders |= 1 << i;
      }
  }
}

const EllipsoidBvh& PreparedScene::hierarchy(Part part) const {
  LazyHierarchy& hierarchy = *hierarchies_[static_cast<int>(part)];
  std::call_once(hierarchy.made, [&] {
    std::vector<EllipsoidBvh::Input> input;
    for (std::size_t i = 0; i < scene.triangles.size(); ++i) {
      const TriangleRecord& record = records_[i];
      if ((part == Part::moving && !record.has_gradient) || (part == Part::emitting && !record.emits)) continue;
      const auto& v = record.vertex;
      input.push_back({{scene.positions[v[0]], scene.positions[v[1]], scene.positions[v[2]]}, static_cast<int>(i)});
    }
    hierarchy.bvh = EllipsoidBvh(input);
  });
  return hierarchy.bvh;
}

}  // namespace isochron
