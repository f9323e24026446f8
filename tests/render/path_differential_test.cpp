// The differential of a path against automatic differentiation (ceres::Jet) of ln F and l written independently from
// theory section 2: as functions of all vertices, albedos, roughnesses and radiances, one degree of freedom
// at a time.
#include "core/paths/path_differential.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <map>

#include "core/base/random.h"
#include "scene_building.h"
#include "tests/render/path_by_textbook.h"

namespace isochron::testing {
namespace {

using Jet = ceres::Jet<double, 1>;

/// Gradients over all degrees of freedom: [channel][dof] and [dof].
struct Gradients {
  std::vector<double> log_f[3], length;
};

Gradients by_jets(const Scene& scene, const PathSpec& spec) {
  const std::vector<double> values = all_dofs(scene);
  std::vector<Jet> dofs(values.begin(), values.end());
  Gradients result;
  for (std::size_t i = 0; i < dofs.size(); ++i) {
    dofs[i].v[0] = 1;
    const PathValue<Jet> value = evaluate(scene, spec, dofs);
    for (int c = 0; c < 3; ++c) result.log_f[c].push_back(value.log_f[c].v[0]);
    result.length.push_back(value.length.v[0]);
    dofs[i].v[0] = 0;
  }
  return result;
}

std::vector<SurfacePoint> surface_points(const PreparedScene& scene, const PathSpec& spec) {
  std::vector<SurfacePoint> x(1);
  x[0].p = spec.camera;
  x.push_back(scene.point_on_triangle(spec.triangle[0], spec.camera, spec.ray));
  for (std::size_t k = 1; k < spec.triangle.size(); ++k) {
    const int t = spec.triangle[k];
    SurfacePoint p{{}, scene.normal(t), t};
    for (int i = 0; i < 3; ++i) p.p += scene.scene.positions[scene.scene.triangles[t].vertex[i]] * spec.b[k][i];
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(scene.barycentrics(p)[i], spec.b[k][i], 1e-12);
    x.push_back(p);
  }
  return x;
}

Gradients by_hand(const PreparedScene& scene, const PathSpec& spec, bool length_only, LocalDifferential& raw) {
  const std::vector<SurfacePoint> x = surface_points(scene, spec);
  differentiate_path(scene, 0, x.data(), static_cast<int>(x.size()), length_only, raw);
  Gradients result;
  for (auto& g : result.log_f) g.assign(scene.layout.size(), 0.0);
  result.length.assign(scene.layout.size(), 0.0);
  for (const VertexGradient& v : raw.vertices)
    for (int axis = 0; axis < 3; ++axis) {
      const int dof = scene.layout.vertex(v.vertex, axis);
      for (int c = 0; c < 3; ++c)
        if (v.channel < 0 || v.channel == c) result.log_f[c][dof] += v.log_f[axis];
      result.length[dof] += v.length[axis];
    }
  for (const ScalarGradient& s : raw.scalars) {
    for (int c = 0; c < 3; ++c)
      if (s.channel < 0 || s.channel == c) result.log_f[c][s.dof] += s.log_f;
    result.length[s.dof] += s.length;
  }
  return result;
}

double largest(const std::vector<double>& v) {
  double result = 0;
  for (double x : v) result = std::max(result, std::abs(x));
  return result;
}

void expect_same(const std::vector<double>& actual, const std::vector<double>& expected, const char* what) {
  const double scale = largest(expected);
  ASSERT_GT(scale, 0);
  for (std::size_t i = 0; i < expected.size(); ++i)
    ASSERT_NEAR(actual[i], expected[i], 1e-9 * scale) << what << ", degree of freedom " << i;
}

class RandomNumbers {
 public:
  explicit RandomNumbers(std::uint64_t seed) : rng_(Stream{seed, 0, 0}, 0, 0) {}
  double in(double low, double high) { return low + (high - low) * rng_.uniform(); }
  bool coin() { return rng_.uniform() < 0.5; }
  int below(int n) { return static_cast<int>(n * rng_.uniform()); }
  Vec3 vector() { return {in(-1, 1), in(-1, 1), in(-1, 1)}; }
  Rgb colour() { return {in(0.2, 0.9), in(0.2, 0.9), in(0.2, 0.9)}; }
  std::array<double, 3> barycentrics() {
    const double a = in(0.1, 1), b = in(0.1, 1), c = in(0.1, 1), sum = a + b + c;
    return {a / sum, b / sum, c / sum};
  }
  Material material() {
    const Rgb albedo = colour(), reflectance = colour();
    const double roughness = in(0.1, 0.9);
    const int kind = below(3);
    const bool two_sided = coin();
    return kind == 0   ? diffuse(albedo, two_sided)
           : kind == 1 ? conductor(reflectance, roughness, two_sided)
                       : retroreflector(albedo, reflectance, roughness, two_sided);
  }

 private:
  Rng rng_;
};

/// A triangle of the plane through p with unit normal n, of which p has barycentrics b.
Mesh triangle_about(const Vec3& p, const Vec3& n, const std::array<double, 3>& b, RandomNumbers& numbers) {
  Vec3 s, t;
  complete_frame(n, s, t);
  Mesh mesh{{}, {{0, 1, 2}}};
  Vec3 mean;
  for (int i = 0; i < 3; ++i) {
    const double angle = kTwoPi * (i + numbers.in(-0.3, 0.3)) / 3, radius = numbers.in(0.2, 0.8);
    mesh.positions.push_back((s * std::cos(angle) + t * std::sin(angle)) * radius);
    mean += mesh.positions.back() * b[i];
  }
  for (Vec3& v : mesh.positions) v += p - mean;
  return mesh;
}

/// `count` surface vertices at random places, each on a triangle of its own that faces both neighbours (or
/// neither, where it is two-sided), with random materials.
void random_path(int count, RandomNumbers& numbers, Scene& scene, PathSpec& spec) {
  std::vector<Vec3> x(count + 1);
  for (int k = 0; k <= count; ++k) x[k] = numbers.vector() * 0.7 + Vec3{k % 2 ? 1.5 : 0.0, 0.4 * k, 0.0};
  spec.camera = x[0];
  spec.ray = normalize(x[1] - x[0]);
  for (int k = 1; k <= count; ++k) {
    const Material material = numbers.material();
    const Vec3 w_o = normalize(x[k - 1] - x[k]), w_i = k < count ? normalize(x[k + 1] - x[k]) : w_o;
    Vec3 n;
    do {
      n = normalize(numbers.vector());
    } while (!(dot(n, w_o) > 0.15 && dot(n, w_i) > 0.15));
    if (k < count && material.bsdf().two_sided() && numbers.coin()) n = -n;
    const auto b = numbers.barycentrics();
    const Rgb emission = k == count ? numbers.colour() * 7.0 : Rgb();
    add_shape(scene, std::to_string(k), triangle_about(x[k], n, b, numbers), material, emission);
    spec.triangle.push_back(k - 1);
    spec.b.push_back(b);
  }
}

/// A path through glass, more or less straight on: every vertex but the last refracts or reflects at a triangle of its
/// own, of one of two kinds of glass.
void glass_path(int count, RandomNumbers& numbers, Scene& scene, PathSpec& spec) {
  std::vector<Vec3> x(count + 1);
  for (int k = 0; k <= count; ++k) x[k] = numbers.vector() * 0.25 + Vec3{0, 0, 1.0 * k};
  spec.camera = x[0];
  spec.ray = normalize(x[1] - x[0]);
  for (int k = 1; k <= count; ++k) {
    const Vec3 w_o = normalize(x[k - 1] - x[k]), w_i = k < count ? normalize(x[k + 1] - x[k]) : w_o;
    Material material = numbers.material();
    if (k < count) material = glass(numbers.in(0.1, 0.9), numbers.coin() ? numbers.in(1.3, 2.5) : numbers.in(0.4, 0.8));
    Vec3 n;
    double c_i, c_o;
    do {
      n = normalize(numbers.vector());
      c_i = dot(n, w_i), c_o = dot(n, w_o);
    } while (!(std::abs(c_i) > 0.1 && std::abs(c_o) > 0.1 &&
               material.bsdf().value({n, w_i, w_o, c_i, c_o, dot(w_i, w_o)}).r > 1e-3));
    const auto b = numbers.barycentrics();
    const Rgb emission = k == count ? numbers.colour() * 7.0 : Rgb();
    add_shape(scene, std::to_string(k), triangle_about(x[k], n, b, numbers), material, emission);
    spec.triangle.push_back(k - 1);
    spec.b.push_back(b);
  }
}

/// Two triangles that share an edge, like an open book, and a path that goes to and fro between them:
/// vertices and materials occur again and again.
void book_path(int count, RandomNumbers& numbers, Scene& scene, PathSpec& spec) {
  Mesh mesh;
  mesh.positions = {numbers.vector() * 0.1 + Vec3{0, -1, 0}, numbers.vector() * 0.1 + Vec3{0, 1, 0},
                    numbers.vector() * 0.1 + Vec3{-1, 0, 1}, numbers.vector() * 0.1 + Vec3{1, 0, 1}};
  mesh.faces = {{0, 1, 2}, {1, 0, 3}};
  for (auto& f : mesh.faces) std::swap(f[1], f[2]);
  Material material = numbers.material();
  material.bsdf().set_two_sided(true);
  add_shape(scene, "book", mesh, material, numbers.colour());
  for (int k = 0; k < count; ++k) {
    spec.triangle.push_back(k % 2);
    spec.b.push_back(numbers.barycentrics());
  }
  Vec3 first;
  for (int i = 0; i < 3; ++i) first += mesh.positions[mesh.faces[0][i]] * spec.b[0][i];
  spec.camera = numbers.vector() * 0.1 + Vec3{0.5, 0, 3};
  spec.ray = normalize(first - spec.camera);
}

std::vector<int> every_dof(const Scene& scene) {
  std::vector<int> dofs(DofLayout(scene).size());
  for (std::size_t i = 0; i < dofs.size(); ++i) dofs[i] = static_cast<int>(i);
  return dofs;
}

using MakePath = void (*)(int, RandomNumbers&, Scene&, PathSpec&);
struct MadePath {
  const char* name;
  MakePath make;
};

class PathDifferential : public ::testing::TestWithParam<MadePath> {};

TEST_P(PathDifferential, AgreesWithJets) {
  int rough = 0, from_behind = 0;
  for (int count = 1; count <= 5; ++count)
    for (std::uint64_t trial = 0; trial < 60; ++trial) {
      SCOPED_TRACE("surface vertices " + std::to_string(count) + ", trial " + std::to_string(trial));
      RandomNumbers numbers(1000 * count + trial);
      Scene scene;
      PathSpec spec;
      GetParam().make(count, numbers, scene, spec);
      const TangentBasis basis = free_dofs(scene, every_dof(scene));
      const PreparedScene prepared(scene, &basis);
      for (int k = 0; k + 1 < count; ++k) {
        rough += prepared.bsdf_of(spec.triangle[k]).depends_on_directions();
        if (k == 0) from_behind += dot(prepared.normal(spec.triangle[0]), spec.ray) > 0;
      }

      const Gradients expected = by_jets(scene, spec);
      LocalDifferential raw;
      const Gradients actual = by_hand(prepared, spec, false, raw);
      for (int c = 0; c < 3; ++c) expect_same(actual.log_f[c], expected.log_f[c], "ln F");
      expect_same(actual.length, expected.length, "length");

      const Gradients only = by_hand(prepared, spec, true, raw);
      EXPECT_EQ(only.length, actual.length);
      for (int c = 0; c < 3; ++c) EXPECT_EQ(largest(only.log_f[c]), 0);
    }
  EXPECT_GT(rough, 50);
  if (GetParam().make == random_path) {
    EXPECT_GT(from_behind, 10);
  }
}

TEST_P(PathDifferential, LeavesOutWhatIsStatic) {
  for (int count = 2; count <= 5; ++count)
    for (std::uint64_t trial = 0; trial < 40; ++trial) {
      RandomNumbers numbers(7000 * count + trial);
      Scene scene;
      PathSpec spec;
      GetParam().make(count, numbers, scene, spec);
      // A random third moves; vertices as wholes, because entries are per vertex.
      const DofLayout layout(scene);
      std::vector<char> moves(layout.size());
      std::vector<int> dofs;
      for (int dof = 0; dof < layout.size(); ++dof) {
        const bool same_vertex = dof < 3 * layout.vertices && dof % 3 != 0;
        moves[dof] = same_vertex ? moves[dof - 1] : numbers.below(3) == 0;
      }
      // The channels of a colour move as one.
      for (int m = 0; m < layout.materials(); ++m)
        for (const char* colour : {"albedo", "reflectance"})
          if (const int k = scene.materials[m].find(colour); k >= 0)
            for (int c = 1; c < 3; ++c) moves[layout.number(m, k + c)] = moves[layout.number(m, k)];
      for (int s = 0; s < layout.shapes; ++s)
        for (int c = 1; c < 3; ++c) moves[layout.emission(s, c)] = moves[layout.emission(s, 0)];
      for (int dof = 0; dof < layout.size(); ++dof)
        if (moves[dof]) dofs.push_back(dof);
      const TangentBasis some = free_dofs(scene, dofs), all = free_dofs(scene, every_dof(scene));
      const PreparedScene partly(scene, &some), wholly(scene, &all), still(scene, nullptr);
      LocalDifferential raw;
      const Gradients full = by_hand(wholly, spec, false, raw);
      const Gradients actual = by_hand(partly, spec, false, raw);
      for (const VertexGradient& v : raw.vertices) EXPECT_TRUE(moves[layout.vertex(v.vertex, 0)]);
      for (const ScalarGradient& s : raw.scalars) EXPECT_TRUE(moves[s.dof]);
      for (int dof : dofs) {
        EXPECT_EQ(actual.length[dof], full.length[dof]);
        for (int c = 0; c < 3; ++c) EXPECT_EQ(actual.log_f[c][dof], full.log_f[c][dof]);
      }
      by_hand(still, spec, false, raw);
      EXPECT_TRUE(raw.empty());
    }
}

/// A path along a floor, whose value may be other than zero by rounding: not 0/0.
TEST(EdgeOnPath, HasNoDifferential) {
  Scene scene;
  scene.camera = {{0, 1, 0}, {0, 0, 0}, {0, 0, 1}, 40, 8, 8};
  add_shape(scene, "floor", quad({-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}), diffuse(Rgb(0.5)));
  add_shape(scene, "wall", quad({1, -1, -1}, {1, -1, 1}, {1, 1, 1}, {1, 1, -1}), diffuse(Rgb(0.5)));
  add_shape(scene, "lamp", quad({-1, 2, -1}, {1, 2, -1}, {1, 2, 1}, {-1, 2, 1}), diffuse(Rgb(0)), Rgb(1));
  const TangentBasis all = free_dofs(scene, every_dof(scene));
  const PreparedScene prepared(scene, &all);
  const SurfacePoint eye{{0, 1, 0}, {}, -1}, floor{{0, 0, 0}, prepared.normal(0), 0},
      corner{{1, 0, 0.25}, prepared.normal(2), 2}, wall{{1, 0.5, 0.25}, prepared.normal(2), 2},
      lamp{{0.5, 2, 0.5}, prepared.normal(4), 4};
  LocalDifferential differential;
  const std::vector<SurfacePoint> along{eye, floor, corner, lamp}, above{eye, floor, wall, lamp};
  differentiate_path(prepared, 0, along.data(), 4, false, differential);
  EXPECT_TRUE(differential.empty());
  differentiate_path(prepared, 0, above.data(), 4, false, differential);
  EXPECT_FALSE(differential.empty());
}

INSTANTIATE_TEST_SUITE_P(, PathDifferential,
                         ::testing::Values(MadePath{"Scattered", random_path}, MadePath{"ToAndFro", book_path},
                                           MadePath{"ThroughGlass", glass_path}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace isochron::testing
