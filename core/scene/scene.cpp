#include "core/scene/scene.h"

#include <algorithm>
#include <cmath>

namespace isochron {

std::vector<Vec3> vertex_normals(const Scene& scene) {
  std::vector<Vec3> sums(scene.positions.size());
  for (const Triangle& triangle : scene.triangles) {
    const auto& v = triangle.vertex;
    const Vec3& a = scene.positions[v[0]];
    const Vec3 normal = cross(scene.positions[v[1]] - a, scene.positions[v[2]] - a);
    for (const int corner : v) sums[corner] += normal;
  }
  return sums;
}

bool coordinates_fit(const Scene& scene) {
  return coordinates_fit(scene.camera.position) &&
         std::all_of(scene.lights.begin(), scene.lights.end(),
                     [](const PointLight& light) { return coordinates_fit(light.position); }) &&
         std::all_of(scene.positions.begin(), scene.positions.end(), [](const Vec3& p) { return coordinates_fit(p); });
}

namespace {

template <class T>
int find_name(const std::vector<T>& items, const std::string& name) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

}  // namespace

std::vector<int> Shape::numbers_in_file() const {
  std::vector<int> numbers(vertex_count, -1);
  for (int number = 0; number < file_vertex_count(); ++number)
    if (const int v = vertex_of_file(number); v >= 0 && numbers[v] < 0) numbers[v] = number;
  return numbers;
}

std::vector<Vec3> Shape::file_positions(const std::vector<Vec3>& scene_positions) const {
  std::vector<Vec3> positions;
  std::size_t loose = 0;
  for (int number = 0; number < file_vertex_count(); ++number) {
    const int v = vertex_of_file(number);
    positions.push_back(v < 0 ? file_vertices->loose[loose++] : scene_positions[first_vertex + v]);
  }
  return positions;
}

int Scene::find_shape(const std::string& name) const {
  return find_name(shapes, name);
}
int Scene::find_material(const std::string& name) const {
  return find_name(materials, name);
}
int Scene::find_light(const std::string& name) const {
  return find_name(lights, name);
}

DofLayout::DofLayout(const Scene& scene)
    : vertices(static_cast<int>(scene.positions.size())),
      shapes(static_cast<int>(scene.shapes.size())),
      textured(static_cast<int>(scene.texture.size())),
      lights(static_cast<int>(scene.lights.size())),
      time_offsets(static_cast<int>(scene.detector.time_offset.size())),
      backgrounds(static_cast<int>(scene.detector.background.size())) {
  first_number.push_back(3 * vertices);
  for (const Material& material : scene.materials) first_number.push_back(first_number.back() + material.numbers());
}

void set_value(Scene& scene, int dof, double value) {
  const DofLayout layout(scene);
  if (dof >= layout.background(0)) {
    scene.detector.background[dof - layout.background(0)] = value;
  } else if (dof >= layout.time_offset(0)) {
    scene.detector.time_offset[dof - layout.time_offset(0)] = value;
  } else if (dof == layout.gain()) {
    scene.detector.gain = value;
  } else if (dof >= layout.light_position(0, 0)) {
    const int i = (dof - layout.light_position(0, 0)) / 9, k = (dof - layout.light_position(0, 0)) % 9;
    PointLight& light = scene.lights[i];
    (k < 3 ? light.position[k] : k < 6 ? light.direction[k - 3] : light.intensity[k - 6]) = value;
  } else if (dof >= layout.texture(0)) {
    scene.texture[dof - layout.texture(0)] = value;
  } else if (dof >= layout.emission(0, 0)) {
    const int k = dof - layout.emission(0, 0);
    scene.shapes[k / 3].emission.radiance[k % 3] = value;
  } else {
    int m = 0;
    while (layout.number(m + 1, 0) <= dof) ++m;
    scene.materials[m].set_number(dof - layout.number(m, 0), value);
  }
}

std::vector<double> TangentBasis::transpose_apply(const std::vector<double>& dof_gradient) const {
  std::vector<double> gradient(columns, 0.0);
  for (std::size_t row = 0; row < dof_gradient.size(); ++row) {
    for (int e = row_begin[row]; e < row_begin[row + 1]; ++e)
      gradient[entries[e].column] += entries[e].coefficient * dof_gradient[row];
  }
  return gradient;
}

TangentBasis TangentBasis::combined(const std::vector<double>& coefficients) const {
  TangentBasis one;
  one.columns = 1;
  one.row_begin.push_back(0);
  for (std::size_t row = 0; row + 1 < row_begin.size(); ++row) {
    double sum = 0;
    bool changes = false;
    for (int e = row_begin[row]; e < row_begin[row + 1]; ++e) {
      const double coefficient = coefficients[entries[e].column];
      sum += coefficient * entries[e].coefficient;
      changes = changes || coefficient != 0;
    }
    if (changes) one.entries.push_back({0, sum});
    one.row_begin.push_back(static_cast<int>(one.entries.size()));
  }
  return one;
}

}  // namespace isochron
