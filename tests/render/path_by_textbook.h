// ln F and the length of a path as functions of all degrees of freedom, from textbook formulas; for dual numbers.
#pragma once
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/constants.h"
#include "core/scene/scene.h"
#include "tests/materials/walter.h"

namespace isochron::testing {

/// A path: camera, the pixel's ray, and per surface vertex its triangle and barycentrics (those of x1 follow
/// from the ray). The last triangle emits.
struct PathSpec {
  Vec3 camera, ray;
  std::vector<int> triangle;
  std::vector<std::array<double, 3>> b;
};

template <class T>
struct PathValue {
  T log_f[3], length;
};

template <class T>
Vec3T<T> constant(const Vec3& v) {
  return {T(v.x), T(v.y), T(v.z)};
}

/// Textbook GGX with height-correlated Smith masking, by half vector and angles; n on the side of both
/// directions.
template <class T>
T ggx(const T& alpha, const Vec3T<T>& n, const Vec3T<T>& w_i, const Vec3T<T>& w_o) {
  using std::sqrt;
  const T a2 = alpha * alpha, cos_h = dot(n, normalize(w_i + w_o));
  const T base = cos_h * cos_h * (a2 - 1.0) + 1.0;
  const auto lambda = [&](const T& c) { return 0.5 * (sqrt(1.0 + a2 * (1.0 / (c * c) - 1.0)) - 1.0); };
  const T c_i = dot(n, w_i), c_o = dot(n, w_o);
  return a2 / (kPi * base * base) / (1.0 + lambda(c_i) + lambda(c_o)) / (4.0 * c_i * c_o);
}

template <class T>
PathValue<T> evaluate(const Scene& scene, const PathSpec& spec, const std::vector<T>& dofs) {
  using std::abs, std::log, std::sqrt;
  const DofLayout layout(scene);
  const int count = static_cast<int>(spec.triangle.size());
  std::vector<Vec3T<T>> x{constant<T>(spec.camera)}, n{{}};
  T log_all(0.0);
  for (int k = 0; k < count; ++k) {
    Vec3T<T> corner[3];
    for (int i = 0; i < 3; ++i)
      for (int axis = 0; axis < 3; ++axis)
        corner[i][axis] = dofs[layout.vertex(scene.triangles[spec.triangle[k]].vertex[i], axis)];
    const Vec3T<T> m = cross(corner[1] - corner[0], corner[2] - corner[0]);
    n.push_back(normalize(m));
    if (k == 0) {
      const Vec3T<T> d = constant<T>(spec.ray);
      x.push_back(x[0] + d * (dot(m, corner[0] - x[0]) / dot(m, d)));
    } else {
      x.push_back(corner[0] * T(spec.b[k][0]) + corner[1] * T(spec.b[k][1]) + corner[2] * T(spec.b[k][2]));
      log_all += log(length(m));  // area factor, up to a constant
    }
  }
  const auto number = [&](int m, const char* quantity, int c = 0) {
    return dofs[layout.number(m, scene.materials[m].find(quantity) + c)];
  };
  PathValue<T> result;
  // Index of the medium from vertex k to the next, told by the ends' sides, the one before first.
  const auto index = [&](int k) {
    for (const int end : {k, k + 1}) {
      if (end == 0) continue;
      const int material = scene.shapes[scene.triangles[spec.triangle[end - 1]].shape].material;
      const T height = dot(n[end], x[end == k ? k + 1 : k] - x[end]);
      if (scene.materials[material].bsdf().transparent() && height < T(0.0)) return number(material, "ior");
    }
    return T(1.0);
  };
  result.length = index(0) * length(x[1] - x[0]);
  for (int c = 0; c < 3; ++c) result.log_f[c] = T(0.0);
  for (int k = 1; k < count; ++k) {
    const Vec3T<T> d = x[k + 1] - x[k], w_i = normalize(d), w_o = normalize(x[k - 1] - x[k]);
    result.length += index(k) * length(d);
    log_all += log(abs(dot(n[k], w_i)) * abs(dot(n[k + 1], w_i)) / dot(d, d));
    const int material = scene.shapes[scene.triangles[spec.triangle[k - 1]].shape].material;
    const std::string kind = scene.materials[material].kind();
    const Vec3T<T> facing = dot(n[k], w_o) < T(0.0) ? -n[k] : n[k];
    for (int c = 0; c < 3; ++c) {
      T f(0.0);
      if (kind == "diffuse") f = number(material, "albedo", c);
      if (kind == "rough_conductor")
        f = number(material, "reflectance", c) * ggx(number(material, "roughness"), facing, w_i, w_o);
      if (kind == "retroreflecting")
        f = number(material, "albedo", c) / kPi +
            number(material, "reflectance", c) *
                ggx(number(material, "roughness"), facing, w_i, facing * (dot(facing, w_o) * 2.0) - w_o);
      if (kind == "rough_dielectric")
        f = textbook::walter(dot(n[k], w_i), dot(n[k], w_o), dot(w_i, w_o), number(material, "roughness"),
                             number(material, "ior"));
      result.log_f[c] += log(f);
    }
  }
  const int emitter = scene.triangles[spec.triangle.back()].shape;
  for (int c = 0; c < 3; ++c)
    result.log_f[c] += log_all + log(dofs[layout.emission(emitter, c)]) + log(dofs[layout.gain()]);
  result.length += dofs[layout.time_offset(0)];
  return result;
}

inline std::vector<double> all_dofs(const Scene& scene) {
  const DofLayout layout(scene);
  std::vector<double> dofs(layout.size(), 0.0);
  for (int v = 0; v < layout.vertices; ++v)
    for (int axis = 0; axis < 3; ++axis) dofs[layout.vertex(v, axis)] = scene.positions[v][axis];
  for (int m = 0; m < layout.materials(); ++m)
    for (int k = 0; k < layout.numbers(m); ++k) dofs[layout.number(m, k)] = scene.materials[m].number(k);
  for (int s = 0; s < layout.shapes; ++s)
    for (int c = 0; c < 3; ++c) dofs[layout.emission(s, c)] = scene.shapes[s].emission.radiance[c];
  dofs[layout.gain()] = scene.detector.gain;
  return dofs;
}

}  // namespace isochron::testing
