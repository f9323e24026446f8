// The differential of paths that begin at a wall or end at a light without an extent, and of textured surfaces, against automatic
// differentiation of the capture's formula (core/scene/sensors/capture.h).
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/paths/path_differential.h"
#include "scene_building.h"

namespace isochron::testing {
namespace {

using Jet = ceres::Jet<double, 1>;

Vec3T<Jet> constant(const Vec3& v) {
  return {Jet(v.x), Jet(v.y), Jet(v.z)};
}

struct LogAndLength {
  Jet log_f, length;
};

/// Two scattering vertices on triangles 0 and 1 at given barycentrics; `ray`: of x1 where a camera looks, zero where a wall does.
struct CaptureCase {
  Scene scene;
  SurfacePoint start, end;
  Vec3 ray;
  std::array<double, 3> b[2];
};

LogAndLength by_textbook(const CaptureCase& c, const std::vector<Jet>& dofs) {
  const DofLayout layout(c.scene);
  const bool wall = c.ray == Vec3();
  Vec3T<Jet> x[4], n[3];
  x[0] = constant(c.start.p);
  LogAndLength result{Jet(0.0), Jet(0.0)};
  for (int k = 0; k < 2; ++k) {
    Vec3T<Jet> corner[3];
    for (int i = 0; i < 3; ++i)
      for (int axis = 0; axis < 3; ++axis) corner[i][axis] = dofs[layout.vertex(c.scene.triangles[k].vertex[i], axis)];
    const Vec3T<Jet> m = cross(corner[1] - corner[0], corner[2] - corner[0]);
    n[k + 1] = normalize(m);
    std::array<Jet, 3> b{Jet(c.b[k][0]), Jet(c.b[k][1]), Jet(c.b[k][2])};
    if (k == 0 && !wall) {
      const Vec3T<Jet> d = constant(c.ray);
      x[1] = x[0] + d * (dot(m, corner[0] - x[0]) / dot(m, d));
      const Vec3T<Jet> at = x[1] - corner[0];
      b[1] = dot(cross(at, corner[2] - corner[0]), m) / dot(m, m);
      b[2] = dot(cross(corner[1] - corner[0], at), m) / dot(m, m);
      b[0] = 1.0 - b[1] - b[2];
    } else {
      x[k + 1] = corner[0] * b[0] + corner[1] * b[1] + corner[2] * b[2];
      result.log_f += log(length(m));
    }
    Jet texture(0.0);
    for (int i = 0; i < 3; ++i) texture += b[i] * dofs[layout.texture(c.scene.triangles[k].vertex[i])];
    result.log_f += log(texture);
  }
  if (c.scene.lights.empty()) {
    x[3] = constant(c.end.p);
  } else {
    for (int axis = 0; axis < 3; ++axis) x[3][axis] = dofs[layout.light_position(0, axis)];
  }
  for (int k = 0; k < 3; ++k) {
    const Vec3T<Jet> d = x[k + 1] - x[k], w = normalize(d);
    result.length += length(d);
    if (k == 0 && !wall) continue;
    const Vec3T<Jet> near = k == 0 ? constant(c.start.n) : n[k];
    result.log_f += log(abs(dot(near, w)) / dot(d, d));
    if (k < 2) result.log_f += log(abs(dot(n[k + 1], w)));
  }
  const Vec3T<Jet> out = normalize(x[2] - x[3]);
  if (c.scene.lights.empty()) {
    result.log_f += log(dot(constant(c.end.n), out));
  } else {
    const PointLight& light = c.scene.lights[0];
    result.log_f += log(dofs[layout.light_intensity(0, 0)]);
    if (light.kind == PointLight::Kind::spot) {
      Jet cosine(0.0);
      for (int axis = 0; axis < 3; ++axis) cosine += out[axis] * dofs[layout.light_direction(0, axis)];
      const double dark = light.cone * kPi / 180;
      const Jet t = (dark - acos(cosine)) / (light.blend * dark);
      EXPECT_GT(t.a, 0.0);
      EXPECT_LT(t.a, 1.0);
      result.log_f += log(t * t * (3.0 - 2.0 * t));
    }
  }
  result.log_f += log(dofs[layout.gain()]);
  result.length += dofs[layout.time_offset(0)];
  return result;
}

/// Every degree of freedom is a column.
TangentBasis identity(const Scene& scene) {
  TangentBasis basis;
  basis.columns = DofLayout(scene).size();
  for (int i = 0; i < basis.columns; ++i) {
    basis.row_begin.push_back(i);
    basis.entries.push_back({i, 1.0});
  }
  basis.row_begin.push_back(basis.columns);
  return basis;
}

std::vector<double> values_of(const Scene& scene) {
  const DofLayout layout(scene);
  std::vector<double> dofs(layout.size(), 0.5);
  for (int v = 0; v < layout.vertices; ++v) {
    for (int axis = 0; axis < 3; ++axis) dofs[layout.vertex(v, axis)] = scene.positions[v][axis];
    dofs[layout.texture(v)] = scene.texture[v];
  }
  for (int i = 0; i < layout.lights; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      dofs[layout.light_position(i, axis)] = scene.lights[i].position[axis];
      dofs[layout.light_direction(i, axis)] = scene.lights[i].direction[axis];
      dofs[layout.light_intensity(i, axis)] = scene.lights[i].intensity[axis];
    }
  dofs[layout.gain()] = scene.detector.gain;
  return dofs;
}

/// Two triangles that face each other, the start and the end.
CaptureCase make_case(bool wall, std::optional<PointLight::Kind> light) {
  CaptureCase c;
  const Material white = diffuse(Rgb(1.0), true);
  add_shape(c.scene, "near", {{{-0.3, -0.2, 1.1}, {0.4, -0.1, 1.0}, {0.05, 0.5, 1.2}}, {{0, 1, 2}}}, white);
  add_shape(c.scene, "far", {{{0.6, -0.3, 0.6}, {1.1, 0.1, 0.4}, {0.7, 0.4, 0.9}}, {{0, 1, 2}}}, white);
  for (Shape& shape : c.scene.shapes) shape.textured = true;
  for (std::size_t v = 0; v < c.scene.positions.size(); ++v)
    c.scene.texture.push_back(0.2 + 0.1 * static_cast<double>(v));
  c.scene.detector.gain = 1.7;
  c.b[0] = {0.2, 0.5, 0.3};
  c.b[1] = {0.4, 0.25, 0.35};
  c.start.p = {-0.1, 0.2, 0};
  c.end.p = {0.2, -0.1, 0};
  if (wall) {
    c.start.n = c.end.n = normalize(Vec3{0.1, 0.05, 1});
    c.scene.capture.emplace();
    c.scene.capture->columns = c.scene.capture->rows = 1;
    c.scene.capture->sensor = {{c.start.p, c.start.n}};
    c.scene.capture->spots = {{c.end.p, c.end.n}};
  } else {
    PointLight l;
    l.kind = *light;
    l.position = c.end.p;
    l.direction = normalize(Vec3{1, 0.3, 0.7});
    l.cone = 40;
    l.blend = 0.9;
    l.intensity = Rgb(3.0);
    c.scene.lights.push_back(l);
  }
  Vec3 first;
  for (int i = 0; i < 3; ++i) first += c.scene.positions[i] * c.b[0][i];
  if (!wall) c.ray = normalize(first - c.start.p);
  c.scene.camera.position = c.start.p;
  c.scene.camera.look_at = first;
  return c;
}

void expect_right(const CaptureCase& c) {
  const TangentBasis basis = identity(c.scene);
  const PreparedScene prepared(c.scene, &basis, {});
  std::vector<SurfacePoint> x{c.start};
  for (int k = 0; k < 2; ++k) {
    SurfacePoint p{{}, prepared.normal(k), k};
    for (int i = 0; i < 3; ++i) p.p += c.scene.positions[c.scene.triangles[k].vertex[i]] * c.b[k][i];
    x.push_back(p);
  }
  x.push_back(prepared.point_of_light(index_of_light(0)));
  const std::vector<double> values = values_of(c.scene);
  std::vector<Jet> dofs(values.begin(), values.end());
  for (const bool length_only : {false, true}) {
    LocalDifferential raw;
    differentiate_path(prepared, 0, x.data(), 4, length_only, raw);
    std::vector<double> log_f(values.size(), 0.0), length(values.size(), 0.0);
    for (const VertexGradient& v : raw.vertices)
      for (int axis = 0; axis < 3; ++axis) {
        log_f[prepared.layout.vertex(v.vertex, axis)] += v.log_f[axis];
        length[prepared.layout.vertex(v.vertex, axis)] += v.length[axis];
      }
    for (const ScalarGradient& s : raw.scalars) {
      if (s.channel <= 0) log_f[s.dof] += s.log_f;
      length[s.dof] += s.length;
    }
    const DofLayout layout(c.scene);
    for (int i = 0; i < layout.size(); ++i) {
      const bool material = i >= layout.number(0, 0) && i < layout.texture(0);
      if (material) continue;  // see path_differential_test.cpp
      dofs[i].v[0] = 1;
      const LogAndLength expected = by_textbook(c, dofs);
      dofs[i].v[0] = 0;
      if (!length_only) {
        EXPECT_NEAR(log_f[i], expected.log_f.v[0], 1e-9 * (1 + std::abs(expected.log_f.v[0]))) << "dof " << i;
      }
      EXPECT_NEAR(length[i], expected.length.v[0], 1e-9) << "dof " << i;
    }
  }
}

TEST(CaptureDifferential, WallToWall) {
  expect_right(make_case(true, {}));
}

TEST(CaptureDifferential, CameraToPointLight) {
  expect_right(make_case(false, PointLight::Kind::point));
}

TEST(CaptureDifferential, CameraToSpotLight) {
  expect_right(make_case(false, PointLight::Kind::spot));
}

}  // namespace
}  // namespace isochron::testing
