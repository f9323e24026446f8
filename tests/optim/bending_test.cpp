// The integral of squared curvature against closed forms.
#include "optim/problem/bending.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "core/scene/mesh.h"
#include "optim/problem/penalties.h"
#include "optim/problem/smoothing.h"
#include "tests/seed.h"

namespace isochron {
namespace {

/// One shape, and a parameter that moves each of its vertices.
struct Surface {
  Scene scene;
  std::unique_ptr<Parameters> parameters;
  std::vector<LinearForm> forms() const {
    return bending_forms(*parameters, parameters->vertex_field(parameters->blocks()[0]), parameters->initial());
  }
};

std::unique_ptr<Surface> surface(const Mesh& mesh, VertexDirection direction) {
  auto result = std::make_unique<Surface>();
  result->scene.materials = {Material("diffuse", "white")};
  Shape shape;
  shape.name = "surface";
  add_shape(result->scene, std::move(shape), mesh, build_edges(mesh));
  ParameterSpec spec;
  spec.name = "dent";
  spec.type = ParameterType::vertices;
  spec.shape = "surface";
  spec.direction_kind = direction;
  spec.direction = {0, 0, 2};
  spec.initial = {0};
  result->parameters = std::make_unique<Parameters>(result->scene, std::vector<ParameterSpec>{spec});
  return result;
}

double energy(const std::vector<LinearForm>& forms, const std::vector<double>& theta) {
  double sum = 0;
  for (const LinearForm& form : forms) sum += form.at(theta) * form.at(theta);
  return sum;
}

/// Rings of latitude, closed at both poles.
Mesh sphere(double radius, int rings) {
  Mesh mesh;
  const int around = 2 * rings;
  mesh.positions.push_back({0, 0, radius});
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      const double theta = std::numbers::pi * i / rings, phi = std::numbers::pi * (2 * j + i % 2) / around;
      mesh.positions.push_back(Vec3{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)} *
                               radius);
    }
  const int south = static_cast<int>(mesh.positions.size());
  mesh.positions.push_back({0, 0, -radius});
  const auto at = [&](int i, int j) { return 1 + (i - 1) * around + (j + around) % around; };
  for (int j = 0; j < around; ++j) {
    mesh.faces.push_back({0, at(1, j), at(1, j + 1)});
    mesh.faces.push_back({south, at(rings - 1, j + 1), at(rings - 1, j)});
    for (int i = 1; i + 1 < rings; ++i) {
      const int shift = i % 2;
      mesh.faces.push_back({at(i, j), at(i + 1, j + shift), at(i, j + 1)});
      mesh.faces.push_back({at(i, j), at(i + 1, j + shift - 1), at(i + 1, j + shift)});
    }
  }
  return mesh;
}

/// The unit square in triangles, uneven by so much of their sides.
Mesh sheet(int side, double uneven) {
  Mesh mesh;
  std::mt19937 rng(test_seed(5));
  std::uniform_real_distribution<double> off(-uneven, uneven);
  for (int y = 0; y <= side; ++y)
    for (int x = 0; x <= side; ++x) {
      const bool inside = x > 0 && y > 0 && x < side && y < side;
      mesh.positions.push_back({(x + inside * off(rng)) / side, (y + inside * off(rng)) / side, 0});
    }
  const auto at = [&](int x, int y) { return y * (side + 1) + x; };
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      mesh.faces.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh.faces.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  return mesh;
}

TEST(Bending, OfASphereOfAnySizeIs16Pi) {
  for (const double radius : {0.02, 3.0}) {
    const auto ball = surface(sphere(radius, 40), VertexDirection::normal);
    EXPECT_NEAR(energy(ball->forms(), ball->parameters->initial()) / (16 * std::numbers::pi), 1, 0.01);
  }
}

/// Of vertices inside alone, which have more neighbours.
std::vector<LinearForm> inside(std::vector<LinearForm> forms) {
  std::erase_if(forms, [](const LinearForm& form) { return form.entries.size() <= 3; });
  return forms;
}

TEST(Bending, OfAPlaneIsNoneHoweverUnevenItsMesh) {
  const auto plane = surface(sheet(12, 0.3), VertexDirection::fixed);
  EXPECT_EQ(plane->forms().size(), 13u * 13u);
  EXPECT_LT(energy(plane->forms(), plane->parameters->initial()), 1e-20);
}

/// Along a border of straight sides all curvature is at its corners: there the unit tangent changes by the root of 2 over the
/// length of a side of the mesh, a tenth of which counts.
TEST(Bending, OfABorderIsThatOfItsCorners) {
  for (const double size : {0.01, 1.0, 300.0}) {
    Mesh mesh = sheet(12, 0.3);
    for (Vec3& p : mesh.positions) p = size * p;
    const auto plane = surface(mesh, VertexDirection::free);
    const std::vector<LinearForm> forms = plane->forms();
    EXPECT_EQ(forms.size(), 11u * 11u + 3 * 48u);
    EXPECT_NEAR(energy(forms, plane->parameters->initial()), 0.1 * 4 * 2 * 12, 1e-9);
  }
}

/// Curvature 1 / r all along 2 pi r, times a tenth of the root of pi r^2.
TEST(Bending, OfADiscsBorderIsTwicePiToTheThreeHalves) {
  constexpr int kSides = 100;
  for (const double radius : {0.02, 3.0}) {
    Mesh disc{{{0, 0, 0}}, {}};
    for (int i = 0; i < kSides; ++i) {
      const double phi = 2 * std::numbers::pi * i / kSides;
      disc.positions.push_back({radius * std::cos(phi), radius * std::sin(phi), 0});
      disc.faces.push_back({0, 1 + i, 1 + (i + 1) % kSides});
    }
    const auto plane = surface(disc, VertexDirection::free);
    EXPECT_NEAR(energy(plane->forms(), plane->parameters->initial()) / (0.2 * std::pow(std::numbers::pi, 1.5)), 1,
                0.003);
  }
}

/// A vertex of a plane that comes close to its neighbour, a little above it, makes triangles between them slivers. Below a hundredth of height
/// over length what they add grows no more.
TEST(Variation, OfSliversIsBounded) {
  const auto energy_at = [](double part) {
    Mesh mesh = sheet(8, 0);
    const int middle = static_cast<int>(mesh.positions.size()) / 2;
    mesh.positions[middle] = mesh.positions[middle + 1] + part * (mesh.positions[middle] - mesh.positions[middle + 1]);
    mesh.positions[middle].z += 1e-4;
    const auto plane = surface(mesh, VertexDirection::free);
    const Parameters& parameters = *plane->parameters;
    return energy(variation_forms(parameters, parameters.vertex_field(parameters.blocks()[0]), parameters.initial()),
                  parameters.initial());
  };
  const double thin = energy_at(1e-3);
  EXPECT_NEAR(energy_at(1e-6) / thin, 1, 0.05);
  EXPECT_NEAR(energy_at(0) / thin, 1, 0.05);
}

/// Triangles without area, and a vertex that has no other: forms are finite.
TEST(Variation, OfTrianglesWithoutAreaIsFinite) {
  Mesh mesh = sheet(8, 0);
  const int middle = static_cast<int>(mesh.positions.size()) / 2;
  for (const int neighbour : {middle + 1, middle - 1, middle + 10, middle - 10})
    mesh.positions[neighbour] = mesh.positions[middle] + Vec3{0.01 * (neighbour - middle), 0, 0};
  for (const int neighbour : {middle + 9, middle - 9}) mesh.positions[neighbour] = mesh.positions[middle];
  const auto plane = surface(mesh, VertexDirection::free);
  const Parameters& parameters = *plane->parameters;
  const Parameters::VertexField field = parameters.vertex_field(parameters.blocks()[0]);
  for (const auto& forms : {bending_forms, variation_forms, tangential_forms})
    EXPECT_TRUE(std::isfinite(energy(forms(parameters, field, parameters.initial()), parameters.initial())));
}

/// z = a sin(k x): the curvature is a k^2 sin(k x), its square's integral over whole waves a^2 k^4 / 2. The direction is 2 long.
/// Single vertices of uneven triangles see curvature that is not there, which adds to the sum of squares: 1.6 % here, up to 30 % where
/// triangles are uneven by 0.3.
TEST(Bending, OfAWaveOnAPlane) {
  constexpr int kSide = 64;
  const Mesh mesh = sheet(kSide, 0.1);
  const auto plane = surface(mesh, VertexDirection::fixed);
  const Parameters& parameters = *plane->parameters;
  const double a = 0.003, k = 2 * std::numbers::pi;
  std::vector<double> theta = parameters.initial();
  const Parameters::VertexField field = parameters.vertex_field(parameters.blocks()[0]);
  for (std::size_t i = 0; i < theta.size(); ++i)
    theta[i] = a / 2 * std::sin(k * parameters.scene().positions[field.vertices[i]].x);
  const double width = 1 - 2.0 / kSide;  // of what has no border; at the other two the wave has no curvature
  EXPECT_NEAR(energy(inside(plane->forms()), theta) / (width * a * a * std::pow(k, 4) / 2), 1, 0.03);
}

/// The forms are those of the surface where it begins, offsets included.
TEST(Bending, IsThatOfTheSurfaceAsItBegins) {
  const Mesh mesh = sheet(10, 0.3);
  const auto plane = surface(mesh, VertexDirection::fixed);
  const Parameters& flat = *plane->parameters;
  std::vector<double> bump = flat.initial();
  for (std::size_t i = 0; i < bump.size(); ++i) bump[i] = 0.01 * std::sin(7.0 * static_cast<double>(i));
  const Parameters::VertexField field = flat.vertex_field(flat.blocks()[0]);
  Mesh bent = mesh;
  const Scene moved = flat.apply(bump);
  for (std::size_t i = 0; i < bent.positions.size(); ++i) bent.positions[i] = moved.positions[i];
  const auto loaded = surface(bent, VertexDirection::fixed);
  const double expected = energy(loaded->forms(), loaded->parameters->initial());
  EXPECT_NEAR(energy(bending_forms(flat, field, bump), bump) / expected, 1, 1e-9);
}

std::vector<LinearForm> variation(const Surface& surface) {
  const Parameters& parameters = *surface.parameters;
  return variation_forms(parameters, parameters.vertex_field(parameters.blocks()[0]), parameters.initial());
}

/// Triangles at the poles are uneven, which looks like 1.6 where bending is 16 pi.
TEST(Variation, OfASphereOfAnySizeIsNone) {
  for (const double radius : {0.02, 3.0}) {
    const auto ball = surface(sphere(radius, 40), VertexDirection::normal);
    EXPECT_GT(variation(*ball).size(), 1000u);
    EXPECT_LT(energy(variation(*ball), ball->parameters->initial()), 2);
  }
}

TEST(Variation, OfAPlaneIsNoneHoweverUnevenItsMesh) {
  const auto plane = surface(sheet(12, 0.3), VertexDirection::fixed);
  EXPECT_LT(energy(variation(*plane), plane->parameters->initial()), 1e-18);
}

/// As above, of any size: the slope of the curvature a k^2 sin(k x) is a k^3 cos(k x), its square's integral over whole waves a^2 k^6 / 2, of
/// what has no border. The square of the radius of a sphere of the sheet's area is 1 / (4 pi).
TEST(Variation, OfAWaveOnAPlane) {
  constexpr int kSide = 64;
  for (const double size : {0.01, 1.0, 300.0}) {
    Mesh mesh = sheet(kSide, 0);
    for (Vec3& p : mesh.positions) p = size * p;
    const auto plane = surface(mesh, VertexDirection::fixed);
    const Parameters& parameters = *plane->parameters;
    const double a = 0.003 * size, k = 2 * std::numbers::pi / size;
    std::vector<double> theta = parameters.initial();
    const Parameters::VertexField field = parameters.vertex_field(parameters.blocks()[0]);
    for (std::size_t i = 0; i < theta.size(); ++i)
      theta[i] = a / 2 * std::sin(k * parameters.scene().positions[field.vertices[i]].x);
    // The slope is largest where the border is, with cos(k x)^2 = 1: two of the columns of edges are missing.
    const double across = 1 - 1.0 / kSide, along = 0.5 - 2.0 / kSide;
    const double expected = across * along * a * a * std::pow(k, 6) * std::pow(size, 4) / (4 * std::numbers::pi);
    EXPECT_NEAR(energy(variation(*plane), theta) / expected, 1, 0.01);
  }
}

/// Squares of the way within the surface over a third of the area of a vertex's triangles; neither borders nor motion along the normal count.
TEST(Tangential, IsMotionOfInnerVerticesWithinTheSurface) {
  Mesh mesh = sheet(6, 0.3);
  for (Vec3& p : mesh.positions) p = {p.x, 0.6 * p.y - 0.8 * p.z, 0.8 * p.y + 0.6 * p.z};  // turned about x
  const auto plane = surface(mesh, VertexDirection::free);
  const Parameters& parameters = *plane->parameters;
  const Parameters::VertexField field = parameters.vertex_field(parameters.blocks()[0]);
  ASSERT_EQ(field.stride, 3);
  std::vector<double> area(mesh.positions.size(), 0.0);
  for (const auto& [a, b, c] : mesh.faces)
    for (const int v : {a, b, c})
      area[v] += length(cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a])) / 6;
  std::vector<double> theta = parameters.initial();
  double expected = 0;
  for (std::size_t i = 0; i < field.vertices.size(); ++i) {
    const double x = std::cos(3.0 * static_cast<double>(i)), y = 0.5 * std::sin(5.0 * static_cast<double>(i)), z = 2;
    const Vec3 way{x, 0.6 * y - 0.8 * z, 0.8 * y + 0.6 * z};
    for (int axis = 0; axis < 3; ++axis) theta[field.begin + 3 * static_cast<int>(i) + axis] += way[axis];
    const int v = field.vertices[i], row = v / 7, column = v % 7;
    if (row > 0 && row < 6 && column > 0 && column < 6) expected += (x * x + y * y) / area[v];
  }
  const std::vector<LinearForm> forms = tangential_forms(parameters, field, parameters.initial());
  EXPECT_EQ(forms.size(), 2u * 25u);
  EXPECT_NEAR(energy(forms, parameters.initial()), 0, 1e-20);
  EXPECT_NEAR(energy(forms, theta) / expected, 1, 1e-9);
}

/// A tilt has slopes and no bending. As a prior only bending counts, and motion within the surface is held; without bending slopes stay a prior.
TEST(Prior, SlopesOfASurfaceThatBendsAreNone) {
  const auto plane = surface(sheet(6, 0), VertexDirection::free);
  const Parameters& parameters = *plane->parameters;
  const Parameters::VertexField field = parameters.vertex_field(parameters.blocks()[0]);
  std::vector<double> tilt = parameters.initial(), shift = tilt;
  for (std::size_t i = 0; i < field.vertices.size(); ++i)
    tilt[field.begin + 3 * static_cast<int>(i) + 2] = 0.1 * parameters.scene().positions[field.vertices[i]].x;
  const int middle = 3 * (3 * 7 + 3);
  ASSERT_EQ(field.vertices[3 * 7 + 3], 3 * 7 + 3);
  shift[field.begin + middle] = 0.01;
  ParameterSpec spec;
  spec.slopes = 5;
  spec.bending = 3;
  const auto value = [&](const QuadraticPenalty& penalty, const std::vector<double>& theta) {
    return penalty.value(theta, {1, 1});
  };
  const QuadraticPenalty penalty = penalty_of({spec}, parameters, plane->scene),
                         prior = prior_of({spec}, parameters, plane->scene);
  const double border = value(prior, parameters.initial());
  EXPECT_NEAR(value(prior, shift) - border, kHeldTangents * 0.0001 * 36, 1e-9);  // of 36 cells of the unit square
  const double all = value(penalty, tilt);
  spec.slopes = 0;
  const double bends = value(penalty_of({spec}, parameters, plane->scene), tilt);
  EXPECT_GT(all, bends + 0.01);
  EXPECT_NEAR(value(prior, tilt), bends, 1e-9);
  spec.slopes = 5;
  spec.bending = 0;
  EXPECT_EQ(value(prior_of({spec}, parameters, plane->scene), tilt),
            value(penalty_of({spec}, parameters, plane->scene), tilt));
}

}  // namespace
}  // namespace isochron
