// Scenes made in code, for the renderer's tests.
#pragma once
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/mesh.h"
#include "core/scene/scene.h"

namespace isochron::testing {

inline Material diffuse(const Rgb& albedo, bool two_sided = false) {
  Material m("diffuse");
  m.set("albedo", albedo);
  m.bsdf().set_two_sided(two_sided);
  return m;
}

inline Material conductor(const Rgb& reflectance, double roughness, bool two_sided = false) {
  Material m("rough_conductor");
  m.set("reflectance", reflectance);
  m.set("roughness", roughness);
  m.bsdf().set_two_sided(two_sided);
  return m;
}

inline Material retroreflector(const Rgb& albedo, const Rgb& reflectance, double roughness, bool two_sided = false) {
  Material m("retroreflecting");
  m.set("albedo", albedo);
  m.set("reflectance", reflectance);
  m.set("roughness", roughness);
  m.bsdf().set_two_sided(two_sided);
  return m;
}

inline Material plastic(const Rgb& albedo, double roughness, double ior, bool two_sided = false) {
  Material m("plastic");
  m.set("albedo", albedo);
  m.set("roughness", roughness);
  m.set("ior", ior);
  m.bsdf().set_two_sided(two_sided);
  return m;
}

inline Material glass(double roughness, double ior) {
  Material m("rough_dielectric");
  m.set("roughness", roughness);
  m.set("ior", ior);
  return m;
}

/// Another material in place of the one of this name.
inline void replace_material(Scene& scene, const std::string& name, Material material) {
  Material& old = scene.materials[scene.find_material(name)];
  material.name = name;
  old = std::move(material);
}

/// Adds a mesh as it is (no welding) with a material of its own, both called `name`. Returns the shape's
/// index.
inline int add_shape(Scene& scene, const std::string& name, const Mesh& mesh, Material material,
                     const Rgb& emission = {}) {
  material.name = name;
  Shape shape;
  shape.name = name;
  shape.material = static_cast<int>(scene.materials.size());
  shape.emission = emission;
  scene.materials.push_back(std::move(material));
  return add_shape(scene, std::move(shape), mesh, build_edges(mesh));
}

/// Counter-clockwise seen from the side it faces.
inline Mesh quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return {{a, b, c, d}, {{0, 1, 2}, {0, 2, 3}}};
}

/// Axis-aligned box of twelve triangles and eight vertices, facing outwards or inwards.
inline Mesh box(const Vec3& low, const Vec3& high, bool inwards = false) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  const int side[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& s : side) {
    mesh.faces.push_back({s[0], s[1], s[2]});
    mesh.faces.push_back({s[0], s[2], s[3]});
  }
  if (inwards)
    for (auto& f : mesh.faces) std::swap(f[1], f[2]);
  return mesh;
}

/// Grid of `columns` x `rows` vertices over [low, high]^2 of the x-z plane, facing up, with y = height(x, z).
inline Mesh height_field(int columns, int rows, double low, double high,
                         const std::function<double(double, double)>& height) {
  Mesh mesh;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const double x = low + (high - low) * i / (columns - 1), z = low + (high - low) * j / (rows - 1);
      mesh.positions.push_back({x, height(x, z), z});
    }
  for (int j = 0; j + 1 < rows; ++j)
    for (int i = 0; i + 1 < columns; ++i) {
      const int a = j * columns + i, b = a + 1, c = a + columns, d = c + 1;
      mesh.faces.push_back({a, c, d});
      mesh.faces.push_back({a, d, b});
    }
  return mesh;
}

/// One column per degree of freedom in `dofs`, coefficient one.
inline TangentBasis free_dofs(const Scene& scene, const std::vector<int>& dofs) {
  const int size = DofLayout(scene).size();
  std::vector<int> column(size, -1);
  for (int dof : dofs) column[dof] = 0;
  TangentBasis basis;
  basis.row_begin.push_back(0);
  for (int dof = 0; dof < size; ++dof) {
    if (column[dof] == 0) basis.entries.push_back({basis.columns++, 1.0});
    basis.row_begin.push_back(static_cast<int>(basis.entries.size()));
  }
  return basis;
}

}  // namespace isochron::testing
