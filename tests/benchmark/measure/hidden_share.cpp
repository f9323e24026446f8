// Which share of a path's steps hidden geometry sampling should take in a capture with other shapes: isochron_hidden_share CSV
// [SEEDS]. Variance x CPU seconds over the mean square, summed over points and gates, of images and of the derivative (its
// interior term) by the motion of a board towards the wall; SEEDS independent images each, by all shares in turns.
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/parallel.h"
#include "core/render/renderer.h"
#include "tests/benchmark/measure/arguments.h"
#include "tests/benchmark/measure/relative_cost.h"
#include "tests/benchmark/scenes.h"
#include "tests/render/scene_building.h"

namespace isochron::benchmarks {
namespace {

using namespace testing;

std::vector<std::optional<double>> shares() {
  return {0.0, 0.25, 0.5, 0.75, 0.9, std::nullopt};
}

/// Eight by eight points of a confocal scan of the wall z = 0, lengths in metres.
Scene confocal_scan() {
  constexpr int kPoints = 8;
  Scene scene;
  scene.capture.emplace();
  scene.capture->columns = scene.capture->rows = scene.camera.width = scene.camera.height = kPoints;
  for (int i = 0; i < kPoints * kPoints; ++i)
    scene.capture->sensor.push_back({{0.1 * (i % kPoints) - 0.35, 0.35 - 0.1 * (i / kPoints), 0}, {0, 0, 1}});
  scene.camera.look_at = {0, 0, 1};
  return scene;
}

/// A square that faces the wall.
Mesh square(double x, double y, double z, double side) {
  const double h = side / 2;
  return quad({x - h, y - h, z}, {x - h, y + h, z}, {x + h, y + h, z}, {x + h, y - h, z});
}

/// A box that is seen from inside, without the face towards the wall.
Mesh open_box(const Vec3& low, const Vec3& high) {
  Mesh mesh = box(low, high, true);
  mesh.faces.erase(mesh.faces.begin() + 8, mesh.faces.begin() + 10);
  return mesh;
}

struct Case {
  const char* name;
  Scene scene;  ///< the board is its first shape
};

std::vector<Case> cases() {
  std::vector<Case> result;
  const auto add = [&](const char* name, double side) {
    Scene scene = confocal_scan();
    add_shape(scene, "board", square(0, 0, 0.5, side), diffuse(Rgb(0.7)));
    scene.shapes[0].hidden = true;
    result.push_back({name, std::move(scene)});
    return &result.back().scene;
  };
  add_shape(*add("board behind an occluder", 0.5), "occluder", square(-0.1, 0.05, 0.25, 0.2), diffuse(Rgb(0.5), true));
  add_shape(*add("board in a room", 0.3), "room", open_box({-1, -1, 0}, {1, 1, 1.5}), diffuse(Rgb(0.7)));
  add_shape(*add("letter in a box", 0.1), "box", open_box({-0.3, -0.3, 0.3}, {0.3, 0.3, 0.8}), diffuse(Rgb(0.7)));
  return result;
}

/// The board's motion, and the gain, if it is unknown.
TangentBasis towards_wall(const Scene& scene, bool gain) {
  const DofLayout layout(scene);
  std::vector<std::vector<TangentBasis::Entry>> rows(layout.size());
  if (gain) rows[layout.gain()].push_back({1, 1.0});
  for (int v = 0; v < scene.shapes[0].vertex_count; ++v) rows[3 * v + 2].push_back({0, -1.0});
  TangentBasis basis;
  basis.columns = gain ? 2 : 1;
  basis.row_begin.push_back(0);
  for (const auto& row : rows) {
    basis.entries.insert(basis.entries.end(), row.begin(), row.end());
    basis.row_begin.push_back(static_cast<int>(basis.entries.size()));
  }
  return basis;
}

enum class Of { image, derivative, derivative_beside_gain, image_without_names };

void measure(const Case& c, int bounces, Of of, int seeds, std::FILE* csv) {
  const TangentBasis basis = towards_wall(c.scene, of == Of::derivative_beside_gain);
  std::vector<double> centers;
  for (int i = 0; i < 48; ++i) centers.push_back(0.6 + 0.04 * i);
  const GateSet gates(GateShape::gaussian(0.02), centers);
  constexpr SampleRange kSamples{0, 256};
  constexpr const char* kNames[] = {"image", "derivative", "derivative beside gain", "image without names"};
  std::vector<EstimatorOptions> options;
  for (const auto& share : shares()) options.push_back({.max_bounces = bounces, .hidden = share});
  const bool is_image = of == Of::image || of == Of::image_without_names;
  const std::vector<double> costs =
      relative_costs(c.scene, gates, options, basis, seeds, [&](const Renderer& renderer, const Stream& stream) {
        return is_image ? renderer.render(stream, kSamples) : renderer.derive(Term::interior, stream, kSamples)[0];
      });
  for (std::FILE* out : {csv, stdout}) {
    std::fprintf(out, "%s,%d,%s", c.name, bounces, kNames[static_cast<int>(of)]);
    write_costs(costs, out);
  }
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  using namespace isochron::benchmarks;
  const Arguments arguments = read_arguments(argc, argv, 1, "isochron_hidden_share CSV [SEEDS]", 32, 2);
  isochron::set_thread_count(1);
  for (std::FILE* out : {arguments.csv.get(), stdout}) {
    std::fprintf(out, "scene,bounces,of");
    for (const auto& share : shares()) {
      if (share)
        std::fprintf(out, ",%g", *share);
      else
        std::fprintf(out, ",default");
    }
    std::fprintf(out, "\n");
  }
  for (Case& c : cases()) {
    for (const int bounces : {1, 3})
      for (const Of of : {Of::image, Of::derivative, Of::derivative_beside_gain})
        measure(c, bounces, of, arguments.number, arguments.csv.get());
    c.scene.shapes[0].hidden = false;  // which makes all of a capture's
    for (const int bounces : {1, 3})
      measure(c, bounces, Of::image_without_names, arguments.number, arguments.csv.get());
  }
}
