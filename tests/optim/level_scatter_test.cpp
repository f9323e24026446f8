// Distances between the surfaces of levels as errors. Closed forms, no random numbers.
#include "optim/run/level_scatter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/mesh.h"
#include "core/scene/mesh_writer.h"
#include "optim/remesh/surface.h"
#include "tests/optim/temporary_folder.h"

namespace isochron {
namespace {

/// A square of half that side about the axis, at that depth; `turned`: it faces away.
Mesh square(double half, double depth, bool turned = false) {
  Mesh mesh{{{-half, -half, depth}, {half, -half, depth}, {half, half, depth}, {-half, half, depth}}, {}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  if (turned) mesh.faces = {{0, 2, 1}, {0, 3, 2}};
  return mesh;
}

TEST(LevelScatter, AddsTheSquareOfTheLargestDistance) {
  TemporaryFolder folder;
  EarlierSurfaces earlier{"other", {}};
  for (const double depth : {1.03, 0.99}) {
    const Scene scene = scene_of(square(2, depth));
    earlier.meshes.push_back(folder.write(std::to_string(depth) + ".ply", to_ply(scene, scene.shapes[0])));
  }
  Scene scene = scene_of(square(1, 5));
  Shape other;
  other.name = "other";
  const Mesh mesh = square(1, 1);
  add_shape(scene, other, mesh, build_edges(mesh));
  std::vector<double> errors(8, 0.02);
  errors[5] = std::nan("");
  add_level_scatter(earlier, scene, errors);
  for (const int v : {0, 1, 2, 3}) EXPECT_EQ(errors[v], 0.02) << "of the shape before it";
  for (const int v : {4, 6, 7}) EXPECT_NEAR(errors[v], std::sqrt(0.0004 + 0.0009), 1e-12);
  EXPECT_TRUE(std::isnan(errors[5])) << "unknown errors stay unknown";
}

/// The back of a thin body is no part of its front.
TEST(LevelScatter, MeansSurfacesThatFaceAlike) {
  TemporaryFolder folder;
  Scene scene = scene_of(square(2, 1.1));
  const Mesh back = square(2, 1.01, true);
  add_shape(scene, {}, back, build_edges(back));
  Mesh both = square(2, 1.1);
  for (const auto& [a, b, c] : back.faces) both.faces.push_back({a + 4, b + 4, c + 4});
  both.positions.insert(both.positions.end(), back.positions.begin(), back.positions.end());
  const Scene thin = scene_of(both);
  Scene found = scene_of(square(1, 1));
  found.shapes[0].name = "plate";
  std::vector<double> errors(4, 0.0);
  add_level_scatter({"plate", {folder.write("thin.ply", to_ply(thin, thin.shapes[0]))}}, found, errors);
  for (const double error : errors) EXPECT_NEAR(error, 0.1, 1e-12);
}

}  // namespace
}  // namespace isochron
