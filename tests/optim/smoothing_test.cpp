// Diffusion and slopes over a mesh against their definitions.
#include "optim/problem/smoothing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "optim/solvers/adam.h"
#include "tests/optim/synthetic_objective.h"

namespace isochron {
namespace {

constexpr int kSide = 5;

/// A bumpy grid of kSide x kSide vertices, its edges along rows, columns and diagonals; two vertices of
/// another shape.
Scene grid(int side = kSide) {
  Scene scene;
  scene.positions.resize(2);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) scene.positions.push_back({1.0 * x, 0.3 * std::sin(x + 2.0 * y), 1.5 * y});
  const auto at = [&](int x, int y) { return 2 + y * side + x; };
  scene.edges.push_back({{0, 1}, {0, -1}});
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      if (x + 1 < side) scene.edges.push_back({{at(x, y), at(x + 1, y)}, {0, 1}});
      if (y + 1 < side) scene.edges.push_back({{at(x, y), at(x, y + 1)}, {0, 1}});
      if (x + 1 < side && y + 1 < side) scene.edges.push_back({{at(x + 1, y), at(x, y + 1)}, {0, 1}});
    }
  return scene;
}

/// All vertices of the grid but one corner; one unknown before them.
Parameters::VertexField field(int stride, int side = kSide) {
  Parameters::VertexField f{"dent", 1, stride, 1, {}};
  for (int v = side * side; v > 1; --v) f.vertices.push_back(v);
  return f;
}

std::vector<std::vector<double>> columns(const Preconditioner& p, std::size_t size) {
  std::vector<std::vector<double>> matrix;
  for (std::size_t i = 0; i < size; ++i) {
    std::vector<double> unit(size, 0.0);
    unit[i] = 1;
    p.apply(unit);
    matrix.push_back(unit);
  }
  return matrix;
}

TEST(Preconditioner, IsSymmetricPositiveDefiniteAndKeepsConstants) {
  constexpr double kLambda = 7;
  const Scene scene = grid();
  for (int stride : {1, 3}) {
    const Parameters::VertexField f = field(stride);
    Preconditioner p;
    EXPECT_TRUE(p.empty());
    p.add_diffusion(scene, f, kLambda);
    const std::size_t size = 1 + stride * f.vertices.size();
    const auto matrix = columns(p, size);
    for (std::size_t i = 0; i < size; ++i)
      for (std::size_t j = 0; j < i; ++j) EXPECT_NEAR(matrix[i][j], matrix[j][i], 1e-15);
    EXPECT_EQ(matrix[0][0], 1);  // not of the block
    for (std::size_t i = 1; i < size; ++i) EXPECT_EQ(matrix[0][i], 0);
    if (stride == 3) {
      EXPECT_GT(matrix[1][4], 1e-3);
      EXPECT_EQ(matrix[1][2], 0);  // axes do not mix
    }
    // (I + lambda L) P is the identity, and x'(I + lambda L)x = |x|^2 + lambda sum (x_a - x_b)^2 > 0:
    // definite.
    for (std::size_t i = 1; i < size; ++i) {
      std::vector<double> back = matrix[i];
      for (const Edge& edge : scene.edges) {
        int place[2] = {-1, -1};
        for (int k : {0, 1})
          for (std::size_t v = 0; v < f.vertices.size(); ++v)
            if (f.vertices[v] == edge.vertex[k]) place[k] = static_cast<int>(v);
        if (place[0] < 0 || place[1] < 0) continue;
        for (int axis = 0; axis < stride; ++axis) {
          const int a = 1 + stride * place[0] + axis, b = 1 + stride * place[1] + axis;
          back[a] += kLambda * (matrix[i][a] - matrix[i][b]);
          back[b] += kLambda * (matrix[i][b] - matrix[i][a]);
        }
      }
      for (std::size_t j = 0; j < size; ++j) EXPECT_NEAR(back[j], i == j ? 1 : 0, 1e-13);
    }
    std::vector<double> constant(size, 2.5);
    p.apply(constant);
    for (double value : constant) EXPECT_NEAR(value, 2.5, 1e-13);
  }
}

TEST(QuadraticPenalty, IsTheMeanSquaredSlope) {
  // Two vertices 2 apart with offsets 1 and 4, of which each unit is a length of 3: the slope is 4.5.
  Scene scene;
  scene.positions = {{0, 0, 0}, {2, 0, 0}, {2, 5, 0}};
  scene.edges = {{{0, 1}, {0, -1}}, {{1, 2}, {0, -1}}};
  QuadraticPenalty penalty;
  penalty.add_slopes(scene, {"dent", 1, 1, 3, {0, 1}}, 0.5);
  EXPECT_NEAR(penalty.value({100, 1, 4}, {.slopes = 1}), 0.5 * 4.5 * 4.5, 1e-13);
  // All three: the mean over two edges.
  QuadraticPenalty both;
  both.add_slopes(scene, {"dent", 0, 1, 1, {0, 1, 2}}, 1);
  EXPECT_NEAR(both.value({0, 2, 2}, {.slopes = 1}), 0.5, 1e-15);
}

TEST(QuadraticPenalty, PriorIsANormalsNegativeLogarithm) {
  QuadraticPenalty penalty;
  penalty.add_prior({"late", 1, 2}, {9, 1, 2}, 0.5);
  // Two and four standard deviations off.
  EXPECT_NEAR(penalty.value({0, 2, 4}, {.slopes = 7, .priors = 3}), 3 * (4.0 / 2 + 16.0 / 2), 1e-13);
}

TEST(QuadraticPenalty, DerivativesAgreeWithFiniteDifferences) {
  const Scene scene = grid();
  const Parameters::VertexField f = field(3);
  QuadraticPenalty penalty;
  penalty.add_slopes(scene, f, 0.8);
  penalty.add_prior({"late", 0, 2}, {0.3, -0.2}, 0.7);
  penalty.add_forms({{{{4, 1.5}, {1, -0.5}, {7, 0.25}}, 0.1}, {{{7, 2.0}, {4, 0.5}}, -0.3}}, 0.4);
  constexpr PenaltyScale kScale{.slopes = 2, .priors = 3};
  const int size = 1 + 3 * static_cast<int>(f.vertices.size());
  std::vector<double> theta(size), gradient(size, 1.0), curvature(static_cast<std::size_t>(size) * size, 0.0),
      diagonal(size, 0.0);
  for (int i = 0; i < size; ++i) theta[i] = std::sin(3.0 * i);
  penalty.add_gradient(theta, kScale, gradient);
  penalty.add_curvature(size, kScale, curvature);
  penalty.add_diagonal(kScale, diagonal);
  std::vector<double> coupled(curvature.size(), 0.0);
  for (const Coupling& c : penalty.couplings(kScale)) {
    EXPECT_NE(c.a, c.b);
    for (const int place : {c.a * size + c.b, c.b * size + c.a}) coupled[place] += c.curvature;
  }
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) EXPECT_NEAR(i == j ? 0 : curvature[i * size + j], coupled[i * size + j], 1e-12);
    // Quadratic: central differences are exact but for round-off.
    std::vector<double> up = theta, down = theta, slope_up(size, 0.0), slope_down(size, 0.0);
    up[i] += 0.5, down[i] -= 0.5;
    EXPECT_NEAR(gradient[i] - 1, penalty.value(up, kScale) - penalty.value(down, kScale), 1e-12);
    EXPECT_NEAR(diagonal[i], curvature[i * size + i], 1e-12);
    penalty.add_gradient(up, kScale, slope_up);
    penalty.add_gradient(down, kScale, slope_down);
    for (int j = 0; j < size; ++j) EXPECT_NEAR(curvature[i * size + j], slope_up[j] - slope_down[j], 1e-12);
  }
}

TEST(AdamWithDiffusion, FindsASmoothShapeThroughNoiseThatAdamAloneFollows) {
  // Offsets of 225 vertices towards a smooth bump; the gradient of each has noise as large as the bump.
  constexpr int kGrid = 15;
  const Scene scene = grid(kGrid);
  Parameters::VertexField f = field(1, kGrid);
  f.begin = 0;
  const std::size_t n = f.vertices.size();
  std::vector<double> target(n), bound(n, 10.0), low(n, -10.0);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3& p = scene.positions[f.vertices[i]];
    target[i] = std::exp(-(std::pow(p.x - 7, 2) + std::pow(p.z / 1.5 - 7, 2)) / 18);
  }
  Preconditioner diffusion;
  diffusion.add_diffusion(scene, f, 2);
  const Preconditioner none;
  // Each at the best of five rates.
  double best[2] = {1, 1};
  for (int with : {0, 1})
    for (double rate : {0.01, 0.02, 0.05, 0.1, 0.2}) {
      std::vector<double> theta(n, 0.0);
      AdamState state;
      for (std::uint32_t i = 0; i < 100; ++i) {
        std::vector<double> gradient(n);
        for (std::size_t k = 0; k < n; ++k) {
          Rng rng({3, i, 0}, k, 0);
          gradient[k] = theta[k] - target[k] + ExponentialFit::normal(rng);
        }
        adam_step({.learning_rate = rate}, gradient, low, bound, state, theta, with ? diffusion : none);
      }
      double squares = 0;
      for (std::size_t k = 0; k < n; ++k) squares += std::pow(theta[k] - target[k], 2);
      best[with] = std::min(best[with], std::sqrt(squares / static_cast<double>(n)));
    }
  EXPECT_LT(best[1], 0.6 * best[0]);
  EXPECT_GT(best[0], 0.07);
}

}  // namespace
}  // namespace isochron
