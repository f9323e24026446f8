#pragma once
#include <string>

#include "optim/problem/problem.h"
#include "tests/optim/temporary_folder.h"

namespace isochron {

/// A floor, a raised quad and a lamp seen by 8 x 8 pixels; path lengths about 3.5 to 6.
inline void write_tiny_scene(const TemporaryFolder& folder) {
  folder.write("floor.obj", "v -2 0 -2\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nf 1 2 3 4\n");
  folder.write("block.obj", "v -0.5 0.5 -0.5\nv -0.5 0.5 0.5\nv 0.5 0.5 0.5\nv 0.5 0.5 -0.5\nf 1 2 3\nf 1 3 4\n");
  folder.write("lamp.obj", "v -0.5 2 -0.5\nv 0.5 2 -0.5\nv 0.5 2 0.5\nv -0.5 2 0.5\nf 1 2 3 4\n");
  folder.write("scene.yaml",
               "camera: {position: [0.2, 2.5, 2.5], look_at: [0, 0, 0], up: [0, 1, 0], fov: 40, resolution: [8, 8]}\n"
               "materials:\n"
               "  white: {type: diffuse, albedo: 0.6}\n"
               "  metal: {type: rough_conductor, roughness: 0.3, reflectance: 0.9}\n"
               "shapes:\n"
               "  - {name: floor, file: floor.obj, material: white}\n"
               "  - {name: block, file: block.obj, material: metal}\n"
               "  - {name: lamp, file: lamp.obj, material: white, emission: 10}\n");
}

/// An experiment on the tiny scene. The tests of error messages count on its lines.
inline std::string tiny_experiment() {
  return "name: tiny\n"                                                // 1
         "scene: scene.yaml\n"                                         // 2
         "max_bounces: 2\n"                                            // 3
         "gates: {kind: gaussian, centers: [4.5, 5.5], sigma: 0.3}\n"  // 4
         "parameters:\n"                                               // 5
         "  - {name: height, type: translation, shape: block, direction: [0, 1, 0], initial: 0.2, target: "
         "0}\n"                                                                      // 6
         "  - {name: power, type: emission, shape: lamp, initial: 8, target: 10}\n"  // 7
         "target: {samples: 64, seed: 7}\n"                                          // 8
         "samples: {primal: 16, interior: 16, visibility: 16, path_length: 0}\n"     // 9
         "optimizer: {method: adam, learning_rate: 0.02, iterations: 6}\n"           // 10
         "seed: 3\n";                                                                // 11
}

/// The text with one occurrence replaced; the occurrence must be there.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("not in the text: " + from);
  return text.replace(at, from.size(), to);
}

}  // namespace isochron
