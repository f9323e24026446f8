// The flow of a path's vertices, which follow what moves close to them (VertexFlows): its differential against central
// differences.
#include "core/paths/vertex_flow.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/paths/path_differential.h"
#include "tests/render/scene_building.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

/// Point where the plane of three corners meets the ray from the camera through an image point.
Vec3 seen(const CameraModel& camera, double u, double v, const Vec3* corner) {
  const Vec3 m = cross(corner[1] - corner[0], corner[2] - corner[0]), d = camera.direction(u, v);
  return camera.position + d * (dot(m, corner[0] - camera.position) / dot(m, d));
}

std::array<double, 2> image_point(const CameraModel& camera, const Vec3& p) {
  const Vec3 d = p - camera.position;
  // u and v are linear fractional: by their gradients at p and the value at the middle of the image.
  const double depth = dot(d, camera.forward);
  const Vec3 off = d / depth - camera.forward;
  return {0.5 * camera.width + dot(camera.image_gradient(camera.forward, 0), off),
          0.5 * camera.height + dot(camera.image_gradient(camera.forward, 1), off)};
}

/// Exactly in the triangle's plane, whatever the rounding: all heights are the same number, and the normal is an axis.
TEST(VertexFlows, PointsSeenEdgeOnDoNotFlowAlongTheirPixel) {
  Scene scene;
  scene.camera = {{0, 0.7, 3}, {0, 0.7, 0}, {0, 1, 0}, 40, 16, 16};
  Mesh mesh;
  mesh.positions = {{-1, 0.7, -1}, {1, 0.7, -1}, {0, 0.7, 1}};
  mesh.faces = {{0, 1, 2}};
  add_shape(scene, "plate", mesh, diffuse(Rgb(0.5)));
  add_shape(scene, "lamp", mesh, diffuse(Rgb(0.5)), Rgb(1));
  const TangentBasis basis = make_basis(scene, {translate(scene, "plate", {0, 1, 0})});
  const PreparedScene prepared(scene, &basis, {});
  SurfacePoint x1{{0.1, 0.7, 0}, prepared.normal(0), 0};
  LocalDifferential out;
  add_pixel_flow(prepared, x1, {1, 2, 3}, out);
  EXPECT_TRUE(out.empty());
  x1.p.y = 0.6;
  add_pixel_flow(prepared, x1, {1, 2, 3}, out);
  EXPECT_EQ(out.vertices.size(), 3u);
}

/// ln of the differential of a path camera - x1 - x2 whose first vertex flows as the header of VertexFlows
/// says, from the definition by central differences: contribution times Jacobian of the flow in the image.
TEST(VertexFlows, DifferentialOfX1IsThatOfTheFlow) {
  Rng rng(Stream{5, 0, 0}, 0, 0);
  const auto in = [&](double low, double high) { return low + (high - low) * rng.uniform(); };
  int following = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Scene scene;
    scene.camera = {{in(-0.2, 0.2), in(-0.2, 0.2), 3}, {0, 0, 0}, {0, 1, 0}, 40, 16, 16};
    // Two triangles about points close to each other that face each other and, the first one, the camera.
    Mesh mesh[2];
    for (int k = 0; k < 2; ++k)
      for (int i = 0; i < 3; ++i) {
        const double angle = kTwoPi * i / 3 + in(-0.3, 0.3), radius = in(0.4, 0.8);
        const Vec3 flat{radius * std::cos(angle), radius * std::sin(angle), 0};
        const Vec3 tilted = k == 0 ? flat + Vec3{0, 0, 0.4 * flat.x} : Vec3{flat.z, flat.x, flat.y} + Vec3{0.3, 0, 0.5};
        mesh[k].positions.push_back(tilted + Vec3{in(-0.05, 0.05), in(-0.05, 0.05), in(-0.05, 0.05)});
      }
    mesh[0].faces = {{0, 1, 2}};
    mesh[1].faces = {{0, 2, 1}};
    add_shape(scene, "near", mesh[0], diffuse(Rgb(0.5)));
    add_shape(scene, "far", mesh[1], diffuse(Rgb(0.5)), Rgb(1));
    std::vector<Motion> motions;
    for (const char* shape : {"near", "far"})
      for (const Vec3& p : mesh[shape[0] == 'f'].positions)
        for (int axis = 0; axis < 3; ++axis) {
          Vec3 direction;
          direction[axis] = 1;
          motions.push_back(translate(scene, shape, direction, [=](const Vec3& q) { return p == q; }));
        }
    const TangentBasis basis = make_basis(scene, motions);
    const double radius = 8;
    const PreparedScene prepared(scene, &basis, {radius, 0});
    const CameraModel& camera = prepared.camera;
    ASSERT_TRUE(prepared.flows.camera_possible());

    const double b1 = in(0.2, 0.4), b2 = in(0.2, 0.4), b[3] = {1 - b1 - b2, b1, b2};
    const auto second = [&](const std::vector<Vec3>& p) { return p[3] * b[0] + p[4] * b[1] + p[5] * b[2]; };
    const auto at_image =
        image_point(camera, prepared.scene.positions[0] * 0.4 + scene.positions[1] * 0.3 + scene.positions[2] * 0.3);
    SurfacePoint x[3];
    x[0].p = camera.position;
    x[1] = prepared.point_on_triangle(0, camera.position, camera.direction(at_image[0], at_image[1]));
    x[2] = {second(scene.positions), prepared.normal(1), 1};
    const double distance = length(x[2].p - x[1].p), depth = dot(x[1].p - x[0].p, camera.forward);
    const double expected_weight =
        std::pow(std::max(0.0, 1 - std::pow(distance / (radius * camera.pixel_size() * depth), 2)), 2);
    ASSERT_NEAR(prepared.flows.pair(prepared, x[1], x[2], 1).near.value, expected_weight, 1e-12);
    following += expected_weight > 0.05;

    for (std::size_t dof = 0; dof < motions.size(); ++dof) {
      const int moved = static_cast<int>(dof) / 3, axis = static_cast<int>(dof) % 3;
      const auto positions = [&](double t) {
        std::vector<Vec3> p = scene.positions;
        p[moved][axis] += t;
        return p;
      };
      constexpr double kStep = 1e-4;
      const Vec3 rate_2 = (second(positions(kStep)) - second(positions(-kStep))) / (2 * kStep);
      // Velocity of the image point: what x1 does beyond sliding along its ray.
      const auto velocity = [&](double u, double v) {
        const auto above = positions(kStep), below = positions(-kStep), here = positions(0);
        const Vec3 p = seen(camera, u, v, here.data());
        const Vec3 pixel_flow = (seen(camera, u, v, above.data()) - seen(camera, u, v, below.data())) / (2 * kStep);
        const Vec3 n = normalize(cross(here[1] - here[0], here[2] - here[0]));
        Vec3 across = rate_2 - pixel_flow;
        across -= n * dot(n, across);
        const double s = radius * camera.pixel_size() * dot(p - camera.position, camera.forward);
        const double ratio = length_squared(p - second(here)) / (s * s);
        across *= ratio < 1 ? (1 - ratio) * (1 - ratio) : 0;
        const auto a = image_point(camera, p + across * kStep), c = image_point(camera, p - across * kStep);
        return std::array<double, 2>{(a[0] - c[0]) / (2 * kStep), (a[1] - c[1]) / (2 * kStep)};
      };
      const auto v0 = velocity(at_image[0], at_image[1]);
      constexpr double kImageStep = 1e-3;
      const double divergence =
          (velocity(at_image[0] + kImageStep, at_image[1])[0] - velocity(at_image[0] - kImageStep, at_image[1])[0] +
           velocity(at_image[0], at_image[1] + kImageStep)[1] - velocity(at_image[0], at_image[1] - kImageStep)[1]) /
          (2 * kImageStep);
      const auto path = [&](double t) {
        const auto p = positions(t);
        const Vec3 x1 = seen(camera, at_image[0] + t * v0[0], at_image[1] + t * v0[1], p.data()), x2 = second(p),
                   d = x2 - x1;
        const Vec3 m1 = cross(p[1] - p[0], p[2] - p[0]), m2 = cross(p[5] - p[3], p[4] - p[3]);
        return std::array<double, 2>{std::log(std::abs(dot(normalize(m1), d) * dot(m2, d)) / std::pow(dot(d, d), 2)),
                                     length(x1 - camera.position) + length(d)};
      };
      const auto above = path(kStep), below = path(-kStep);
      const double log_f = (above[0] - below[0]) / (2 * kStep) + divergence,
                   path_length = (above[1] - below[1]) / (2 * kStep);

      LocalDifferential differential;
      differentiate_path(prepared, 0, x, 3, false, differential);
      double ours = 0, our_length = 0;
      for (const VertexGradient& g : differential.vertices)
        if (g.vertex == moved) ours += g.log_f[axis], our_length += g.length[axis];
      EXPECT_NEAR(ours, log_f, 1e-5 * (10 + std::abs(log_f))) << "trial " << trial << ", degree of freedom " << dof;
      EXPECT_NEAR(our_length, path_length, 1e-6) << "trial " << trial << ", degree of freedom " << dof;
    }
  }
  EXPECT_GT(following, 20) << "paths close enough to test anything";
}

/// The flow of a path camera - x1 ... x4 over four triangles, each a body, written independently from the header of VertexFlows.
struct FlowingPath {
  const Scene& scene;
  const CameraModel& camera;
  double follow, pixels;
  std::array<std::array<double, 3>, 5> b;  ///< barycentrics of x1 .. x4

  using Points = std::array<Vec3, 5>;

  Vec3 corner(const std::vector<Vec3>& p, int k, int i) const { return p[3 * (k - 1) + i]; }
  Vec3 normal(const std::vector<Vec3>& p, int k) const {
    return normalize(cross(corner(p, k, 1) - corner(p, k, 0), corner(p, k, 2) - corner(p, k, 0)));
  }
  double area(const std::vector<Vec3>& p, int k) const {
    return 0.5 * length(cross(corner(p, k, 1) - corner(p, k, 0), corner(p, k, 2) - corner(p, k, 0)));
  }
  double radius(int k) const {
    Bounds bounds;
    for (int i = 0; i < 3; ++i) bounds.add(corner(scene.positions, k, i));
    return follow * 0.5 * length(bounds.high - bounds.low);
  }
  /// (1 - |x - y|^2 / s^2)^2 for x on triangle k.
  double weight(int k, const Vec3& x, int j, const Vec3& y) const {
    double s = std::min(radius(k), radius(j));
    for (int i = 0; i < 3; ++i) {
      const Vec3 a = corner(scene.positions, k, i), d = corner(scene.positions, k, (i + 1) % 3) - a;
      const double along = std::clamp(dot(x - a, d) / dot(d, d), 0.0, 1.0);
      s = std::min(s, length(x - a - d * along));
    }
    const double q = length_squared(x - y) / (s * s);
    return q < 1 ? (1 - q) * (1 - q) : 0;
  }
  /// Of x_k to follow x_j, beside it on the path; k > 1.
  double pair_weight(int k, int j, const Points& x) const {
    const double w = weight(k, x[k], j, x[j]);
    if (j == 1) return w;  // x1 goes by what x2 does
    const bool first = area(scene.positions, k) > area(scene.positions, j);
    return first ? w : w * (1 - weight(j, x[j], k, x[k]));
  }
  /// Velocity of x_k beyond its base, given the material velocities v and the pixel flow of x1.
  Vec3 following(int k, const Points& x, const Points& v, const Vec3& pixel_flow) const {
    const Vec3 n = normal(scene.positions, k);
    Vec3 t;
    if (k == 1) {
      const double s = pixels * camera.pixel_size() * dot(x[1] - camera.position, camera.forward);
      const double q = length_squared(x[1] - x[2]) / (s * s), w = q < 1 ? (1 - q) * (1 - q) : 0;
      const double w2 = pair_weight(2, 1, x);
      t = (v[2] * (1 - w2) + v[1] * w2 - pixel_flow) * w;
    } else {
      const double w1 = pair_weight(k, k - 1, x), w2 = k < 4 ? pair_weight(k, k + 1, x) : 0;
      t = (v[k - 1] - v[k]) * (w1 * (1 - w2) / (1 - w1 * w2));
      if (k < 4) t += (v[k + 1] - v[k]) * (w2 * (1 - w1) / (1 - w1 * w2));
    }
    return t - n * dot(n, t);
  }
};

/// The differential of paths whose vertices follow their neighbours, for every coordinate of every triangle, by central
/// differences of contribution and length along the flow, and of the flow for its divergence.
TEST(VertexFlows, DifferentialOfAPathIsThatOfTheFlow) {
  Rng rng(Stream{6, 0, 0}, 0, 0);
  const auto in = [&](double low, double high) { return low + (high - low) * rng.uniform(); };
  int following = 0, two_sided = 0, own = 0;
  for (int trial = 0; trial < 60; ++trial) {
    Scene scene;
    scene.camera = {{in(-0.2, 0.2), in(-0.2, 0.2), 3}, {0, 0, 0}, {0, 1, 0}, 40, 16, 16};
    for (int k = 1; k <= 4; ++k) {
      Mesh mesh;
      for (int i = 0; i < 3; ++i) {
        const double angle = kTwoPi * i / 3 + in(-0.3, 0.3), radius = in(0.6, 1.4);
        const Vec3 flat{radius * std::cos(angle), radius * std::sin(angle), 0};
        // In turns facing the camera and across, with their middles close to each other.
        const Vec3 tilted = k % 2 ? flat + Vec3{0, 0, 0.4 * flat.x} : Vec3{flat.z, flat.x, flat.y} + Vec3{0.15, 0, 0.2};
        mesh.positions.push_back(tilted + Vec3{in(-0.1, 0.1), in(-0.1, 0.1), in(-0.1, 0.1)});
      }
      mesh.faces = {{0, 1, 2}};
      add_shape(scene, std::to_string(k), mesh, diffuse(Rgb(0.5), true), k == 4 ? Rgb(1) : Rgb());
    }
    std::vector<int> dofs(36);
    for (int i = 0; i < 36; ++i) dofs[i] = i;
    const TangentBasis basis = free_dofs(scene, dofs);
    const double follow = 1, pixels = 8;
    const PreparedScene prepared(scene, &basis, {pixels, follow});
    FlowingPath path{scene, prepared.camera, follow, pixels, {}};
    SurfacePoint x[5];
    x[0].p = scene.camera.position;
    FlowingPath::Points points;
    points[0] = x[0].p;
    for (int k = 1; k <= 4; ++k) {
      const double b1 = in(0.25, 0.4), b2 = in(0.25, 0.4);
      path.b[k] = {1 - b1 - b2, b1, b2};
      for (int i = 0; i < 3; ++i) points[k] += path.corner(scene.positions, k, i) * path.b[k][i];
      x[k] = {points[k], prepared.normal(k - 1), k - 1};
    }
    bool too_close = false;  // to a kink of the flow, or where differences say little
    for (int k = 2; k <= 4; ++k)
      for (int j : {k - 1, k + 1})
        if (j >= 1 && j <= 4) {
          const double w = path.pair_weight(k, j, points);
          following += w > 0.05;
          two_sided += j > k && w > 0.01 && path.pair_weight(k, k - 1, points) > 0.01;
          own += k == 2 && j == 1 && w > 0.05;
          too_close |= (w > 0 && w < 1e-3) || length(points[k] - points[j]) < 0.06;
        }
    if (too_close) continue;

    LocalDifferential differential;
    differentiate_path(prepared, 0, x, 5, false, differential);
    for (int dof = 0; dof < 36; ++dof) {
      const auto positions = [&](double t) {
        std::vector<Vec3> p = scene.positions;
        p[dof / 3][dof % 3] += t;
        return p;
      };
      constexpr double kStep = 1e-5;
      const auto above = positions(kStep), below = positions(-kStep);
      const int moved = dof / 9 + 1;
      // Velocity of the material at any point of the moved triangle's plane.
      const auto material = [&](int k, const Vec3& at) {
        if (k != moved) return Vec3();
        const Vec3 a = path.corner(scene.positions, k, 0), e1 = path.corner(scene.positions, k, 1) - a,
                   e2 = path.corner(scene.positions, k, 2) - a, n = cross(e1, e2);
        const double b1 = dot(cross(at - a, e2), n) / dot(n, n), b2 = dot(cross(e1, at - a), n) / dot(n, n);
        const double share[3] = {1 - b1 - b2, b1, b2};
        Vec3 v;
        v[dof % 3] = share[dof / 3 - 3 * (k - 1)];
        return v;
      };
      const auto total = [&](const FlowingPath::Points& at) {
        FlowingPath::Points v;
        for (int k = 1; k <= 4; ++k) v[k] = material(k, at[k]);
        const Vec3 n = path.normal(scene.positions, 1), ray = at[1] - at[0];
        const Vec3 pixel_flow = ray * (dot(n, v[1]) / dot(n, ray));
        FlowingPath::Points sum;
        for (int k = 1; k <= 4; ++k) sum[k] = (k == 1 ? pixel_flow : v[k]) + path.following(k, at, v, pixel_flow);
        return sum;
      };
      // Contribution, with the measure of the image for x1 and areas for the others; areas and their spread apart.
      const auto log_f = [&](const FlowingPath::Points& at, const std::vector<Vec3>& p) {
        const Vec3 e = at[1] - at[0];
        double sum = std::log(std::abs(dot(path.normal(p, 1), e)) / std::pow(dot(e, prepared.camera.forward), 3));
        for (int k = 1; k < 4; ++k) {
          const Vec3 d = at[k + 1] - at[k];
          sum += std::log(std::abs(dot(path.normal(p, k), d) * dot(path.normal(p, k + 1), d)) / std::pow(dot(d, d), 2));
        }
        return sum;
      };
      const auto optical = [&](const FlowingPath::Points& at) {
        double sum = 0;
        for (int k = 0; k < 4; ++k) sum += length(at[k + 1] - at[k]);
        return sum;
      };
      const auto v = total(points);
      auto ahead = points, behind = points;
      for (int k = 1; k <= 4; ++k) ahead[k] += v[k] * kStep, behind[k] -= v[k] * kStep;
      double expected = (log_f(ahead, above) - log_f(behind, below)) / (2 * kStep);
      for (int k = 1; k <= 4; ++k) {
        const Vec3 n = path.normal(scene.positions, k);
        const Vec3 e1 = normalize(path.corner(scene.positions, k, 1) - path.corner(scene.positions, k, 0)),
                   e2 = cross(n, e1);
        for (const Vec3& e : {e1, e2}) {
          auto right = points, left = points;
          right[k] += e * kStep, left[k] -= e * kStep;
          expected += dot(total(right)[k] - total(left)[k], e) / (2 * kStep);
        }
      }
      const double expected_length = (optical(ahead) - optical(behind)) / (2 * kStep);
      double ours = 0, our_length = 0;
      for (const VertexGradient& g : differential.vertices)
        if (g.vertex == dof / 3) ours += g.log_f[dof % 3], our_length += g.length[dof % 3];
      // Where a cosine comes close to zero, the difference of its logarithm is off by slope^3 step^2 / 3.
      const double cut_off = std::pow(std::abs(expected), 3) * kStep * kStep / 2;
      EXPECT_NEAR(ours, expected, 5e-5 * (10 + std::abs(expected)) + cut_off) << "trial " << trial << ", dof " << dof;
      EXPECT_NEAR(our_length, expected_length, 1e-6) << "trial " << trial << ", dof " << dof;
    }
  }
  EXPECT_GT(following, 60);
  EXPECT_GT(two_sided, 15) << "vertices that follow both neighbours";
  EXPECT_GT(own, 15) << "x1 that follows itself, as x2 follows it";
}

}  // namespace
}  // namespace isochron::testing
