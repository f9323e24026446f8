// A scene's gated images, and their derivative by the height of one of its shapes:
//   render SCENE.yaml SHAPE
#include <core/image/image.h>
#include <core/render/renderer.h>
#include <core/scene/scene_loader.h>

#include <cstdio>
#include <exception>
#include <vector>

using namespace isochron;

/// One unknown: the shape moves along +y, every vertex by as much as the unknown changes.
TangentBasis height_of(const Scene& scene, const Shape& shape) {
  const DofLayout dofs(scene);
  TangentBasis basis;
  basis.columns = 1;
  basis.row_begin.push_back(0);
  for (int dof = 0; dof < dofs.size(); ++dof) {
    for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v)
      if (dof == dofs.vertex(v, 1)) basis.entries.push_back({.column = 0, .coefficient = 1});
    basis.row_begin.push_back(static_cast<int>(basis.entries.size()));
  }
  return basis;
}

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: render SCENE.yaml SHAPE\n");
    return 2;
  }
  try {
    const Scene scene = load_scene(argv[1]);
    const int shape = scene.find_shape(argv[2]);
    if (shape < 0) {
      std::fprintf(stderr, "%s: no shape is called %s\n", argv[1], argv[2]);
      return 2;
    }
    const TangentBasis basis = height_of(scene, scene.shapes[shape]);
    // Path lengths around 5, 5.5 and 6 scene units; light that is scattered twice at most.
    const GateSet gates(GateShape::gaussian(0.2), {5, 5.5, 6});
    const Renderer renderer(scene, gates, {.max_bounces = 2}, &basis);

    // Each `pass` has random numbers of its own; 64 samples per pixel.
    const GatedImage image = renderer.render({.seed = 1, .pass = 0}, {0, 64});
    std::vector<double> slope(gates.size(), 0.0);
    for (const Term term : kTerms) {
      const Stream stream{.seed = 1, .pass = 1 + static_cast<unsigned>(term)};
      const GatedImage derivative = renderer.derive(term, stream, {0, 64})[0];
      for (int g = 0; g < gates.size(); ++g) slope[g] += derivative.mean(g);
    }
    for (int g = 0; g < gates.size(); ++g)
      std::printf("gate %g: mean %.6f, its derivative by the height %.6f\n", gates.center(g), image.mean(g), slope[g]);
    write_exr("images.exr", image);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
