// A hill over a sheet, and runs in levels that find it.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/base/constants.h"
#include "core/base/error.h"
#include "optim/remesh/surface.h"
#include "optim/run/run.h"
#include "tests/optim/temporary_folder.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {

inline double hill(double x, double y) {
  return 0.12 * std::cos(kPi * x) * std::cos(0.5 * kPi * y);
}

/// A sheet over [-1, 1]^2 of so many cells each way, at a height.
inline std::string sheet(int cells, double (*height)(double, double)) {
  std::string text;
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x) {
      const double u = 2.0 * x / cells - 1, v = 2.0 * y / cells - 1;
      text += "v " + std::to_string(u) + " " + std::to_string(v) + " " + std::to_string(height(u, v)) + "\n";
    }
  const auto at = [&](int x, int y) { return std::to_string(y * (cells + 1) + x + 1) + " "; };
  for (int y = 0; y < cells; ++y)
    for (int x = 0; x < cells; ++x)
      text += "f " + at(x, y) + at(x + 1, y) + at(x + 1, y + 1) + "\nf " + at(x, y) + at(x + 1, y + 1) + at(x, y + 1) +
              "\n";
  return text;
}

inline double flat(double, double) {
  return 0;
}

class LevelsTest : public testing::Test {
 protected:
  LevelsTest() {
    folder_.write("flat.obj", sheet(4, flat));
    folder_.write("hill.obj", sheet(40, hill));
    for (const std::string name : {"flat", "hill"})
      folder_.write(name + ".yaml",
                    "camera: {position: [0, 0, 3], look_at: [0, 0, 0], up: [0, 1, 0], fov: 40, resolution: [16, 16]}\n"
                    "materials: {paint: {type: diffuse, albedo: 0.5}}\n"
                    "shapes: [{name: hill, file: " +
                        name +
                        ".obj, material: paint}]\n"
                        "lights: [{name: lamp, type: point, position: [0, 0, 3.1], intensity: 10}]\n");
  }

  std::string experiment(const std::string& scene, const std::string& remesh, const std::string& target,
                         const std::string& more = "") {
    return folder_.write(
        "experiment.yaml",
        "name: hill\nscene: " + scene +
            ".yaml\nmax_bounces: 1\n"
            "gates: {kind: gaussian, centers: {start: 5.6, stop: 7, count: 8}, sigma: 0.15}\n"
            "parameters:\n  - {name: z, type: vertices, shape: hill, direction: [0, 0, 1], initial: 0, " +
            remesh + "}\n" + more +
            "samples: {primal: 32, interior: 32, visibility: 4, path_length: 0}\n"
            "optimizer: {method: quasi_newton, iterations: 4, inner_iterations: 4}\n"
            "target: " +
            target + "\n");
  }

  /// Images of the hill itself.
  void write_target() {
    const Problem problem(load_experiment(experiment("hill", "target: 0", "{samples: 256}")));
    write_exr(folder_.file("hill.exr"), problem.make_target(), {});
  }

  RunOptions options() {
    RunOptions options;
    options.folder = folder_.file("out");
    options.force = true;
    return options;
  }

  Mesh found(const std::string& of) { return read_mesh(folder_.file(of + "/geometry/final_hill.ply")); }

  /// Root mean square distance of points of the hill from a mesh.
  double distance(const Mesh& mesh) {
    const Surface surface(mesh);
    double sum = 0;
    int points = 0;
    for (double x = -0.9; x <= 0.9; x += 0.05)
      for (double y = -0.9; y <= 0.9; y += 0.05, ++points) {
        const Vec3 p{x, y, hill(x, y)};
        sum += length_squared(surface.closest(p, {}).position - p);
      }
    return std::sqrt(sum / points);
  }

  std::string refusal(const std::string& file) {
    try {
      start_run(load_experiment(file), options());
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder_;
};

}  // namespace isochron
